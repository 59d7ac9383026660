//! What a robot takes its own body to be.

use rapier3d::math::Vector;

use super::joints;
use crate::Sides;
use crate::body::{BodyEstimate, PALM_IN_WRIST_M, RobotModel, WAIST_JOINTS};
use crate::dynamics::Tree;
use crate::mechanism::rounded;

/// The body as the simulator has it. This stands in for an estimator, which would replace it: whatever senses, balances
/// and steers a robot takes what is known of the body from here, and asks the simulator nothing. Masses are the model's,
/// whatever was loaded on a hand.
pub(super) fn from_truth<'a>(
    model: &'a RobotModel,
    tree: &Tree,
    hand_force_n: Sides<Vector>,
    waist_target_rad: [f32; WAIST_JOINTS],
) -> BodyEstimate<'a> {
    let (q_rad, qd_rad_s) = joints::read(tree, model);
    let mut com_m = Vector::ZERO;
    let mut com_velocity_m_s = Vector::ZERO;
    let mut world_from_link = Vec::with_capacity(model.links.len());
    for (index, link) in model.links.iter().enumerate() {
        let world = tree.world_from_link(index);
        let centre_m = world * link.mass.local_com.as_dvec3();
        com_m += centre_m.as_vec3() * link.mass.mass();
        com_velocity_m_s += tree.point_velocity_m_s(index, centre_m).as_vec3() * link.mass.mass();
        world_from_link.push(rounded(&world));
    }
    let palm_velocity_m_s = model.hands.each_ref().map(|hand| {
        let palm_m = tree.world_from_link(hand.wrist) * PALM_IN_WRIST_M.as_dvec3();
        tree.point_velocity_m_s(hand.wrist, palm_m).as_vec3()
    });
    BodyEstimate {
        model,
        q_rad,
        qd_rad_s,
        pelvis_velocity_m_s: tree.link_velocity_m_s(0).as_vec3(),
        pelvis_angular_velocity_rad_s: tree.link_spin_rad_s(0).as_vec3(),
        world_from_link,
        com_m: com_m / model.mass_kg,
        com_velocity_m_s: com_velocity_m_s / model.mass_kg,
        palm_velocity_m_s,
        hand_force_n,
        waist_target_rad,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::{Robot, RobotPlacement};
    use crate::PHYSICS_DT_S;
    use crate::body::posed::{Posed, model};
    use crate::dynamics::{DVec3, Dynamics, Settings};

    /// What is read from the physics world is what the model's kinematics make of joints and pelvis: here of a robot in the
    /// air, touching nothing, with an arm on the move.
    #[test]
    fn poses_and_velocities_are_those_of_the_model() {
        let mut dynamics = Dynamics::new(Settings::new(f64::from(PHYSICS_DT_S), DVec3::Z * -9.81));
        let placement = RobotPlacement { name: "A".into(), position_m: [0.3, -0.2], yaw_rad: 0.8 };
        let model = Arc::new(model().clone());
        let mut robot = Robot::spawn(&mut dynamics, &model, &placement, 0).unwrap();
        let mut command = robot.rest_command(&dynamics);
        command.upper_rad[0] -= 0.1;
        for substep in 0..4 {
            robot.drive(&mut dynamics, &command, substep);
            dynamics.step().unwrap();
        }
        let sensed = robot.estimated_body(&dynamics);
        let body = Posed {
            world_from_pelvis: sensed.world_from_pelvis(),
            pelvis_velocity_m_s: sensed.pelvis_velocity_m_s,
            pelvis_angular_velocity_rad_s: sensed.pelvis_angular_velocity_rad_s,
            q_rad: sensed.q_rad,
            qd_rad_s: sensed.qd_rad_s,
        }
        .body();
        assert!(sensed.qd_rad_s.iter().any(|rate| rate.abs() > 0.1), "the arm moves");
        for (seen, expected) in sensed.world_from_link.iter().zip(&body.world_from_link) {
            assert!((seen.translation - expected.translation).length() < 1e-4, "{seen:?} {expected:?}");
        }
        assert!((sensed.com_m - body.com_m).length() < 1e-4);
        let error_m_s = (sensed.com_velocity_m_s - body.com_velocity_m_s).length();
        // To the order of one physics step.
        assert!(error_m_s < 0.01, "{} {}", sensed.com_velocity_m_s, body.com_velocity_m_s);
    }
}
