//! What a robot can measure of itself.

use rapier3d::math::{Pose, Vector};
use serde::{Deserialize, Serialize};

use super::{Robot, RobotCommand, joints};
use crate::body::{JOINTS, PALM_IN_WRIST_M, RobotModel, UPPER, WholeBody};
use crate::dynamics::{Dynamics, Tree};
use crate::locomotion::BaseCommand;
use crate::mechanism::rounded;
use crate::{PHYSICS_DT_S, Sides};

/// What a robot can measure of itself; poses as named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotState {
    /// Published order, as the velocities and torques.
    #[serde(with = "joints")]
    pub q_rad: [f32; JOINTS],
    #[serde(with = "joints")]
    pub qd_rad_s: [f32; JOINTS],
    #[serde(with = "joints")]
    pub torque_n_m: [f32; JOINTS],
    pub world_from_pelvis: Pose,
    /// By the robot's own odometry: the start frame lies on the floor under the pelvis as it was put into the world, z up, x
    /// where the pelvis faced.
    pub start_from_pelvis: Pose,
    pub pelvis_from_wrist: Sides<Pose>,
    /// Axes as [`crate::mjcf::MjcfCamera`]'s.
    pub pelvis_from_camera: Pose,
    /// Weight that each hand carries beyond its own, estimated from joint torques.
    pub payload_n: Sides<f32>,
    /// External force on each hand, world frame, estimated from joint torques.
    pub hand_force_n: Sides<Vector>,
    /// Pelvis below 0.4 m or tilted beyond 60 degrees. Stays true: nothing puts a robot back.
    pub fallen: bool,
}

impl RobotState {
    /// Mechanical power of all joints, each counted whichever way it works.
    pub fn power_w(&self) -> f32 {
        self.torque_n_m.iter().zip(&self.qd_rad_s).map(|(torque, rate)| (torque * rate).abs()).sum()
    }
}

impl Robot {
    /// The robot as its controller may know it.
    pub(crate) fn measure(&self, dynamics: &Dynamics) -> WholeBody<'_> {
        self.sense(&self.model, dynamics.tree(self.tree))
    }

    /// [`Robot::measure`], for a robot that changes while its model is looked at. Masses are the model's, whatever was
    /// loaded on a hand.
    pub(super) fn sense<'a>(&self, model: &'a RobotModel, tree: &Tree) -> WholeBody<'a> {
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
        WholeBody {
            model,
            q_rad,
            qd_rad_s,
            pelvis_velocity_m_s: tree.link_velocity_m_s(0).as_vec3(),
            pelvis_angular_velocity_rad_s: tree.link_spin_rad_s(0).as_vec3(),
            world_from_link,
            com_m: com_m / model.mass_kg,
            com_velocity_m_s: com_velocity_m_s / model.mass_kg,
            palm_velocity_m_s,
            hand_force_n: self.memory.hand_loads.force_n(),
            waist_target_rad: self.waist_target_rad(),
        }
    }

    /// What the robot reports when it is measured as `body`.
    pub(crate) fn state(&self, body: &WholeBody, dynamics: &Dynamics) -> RobotState {
        let model = body.model;
        let pelvis_from_world = body.world_from_pelvis().inverse();
        RobotState {
            q_rad: body.q_rad,
            qd_rad_s: body.qd_rad_s,
            torque_n_m: joints::torques_n_m(dynamics.tree(self.tree), model),
            world_from_pelvis: body.world_from_pelvis(),
            start_from_pelvis: self.memory.odometry.start_from_pelvis(body, PHYSICS_DT_S),
            pelvis_from_wrist: model
                .wrists
                .each_ref()
                .map(|wrist| pelvis_from_world * body.world_from_site(wrist)),
            pelvis_from_camera: pelvis_from_world
                * body.world_from_link[model.egocentric_link]
                * model.egocentric.body_from_camera,
            payload_n: self.memory.hand_loads.weight_n(),
            hand_force_n: body.hand_force_n,
            fallen: self.memory.fallen,
        }
    }

    /// The command of the last control step.
    pub(crate) fn last_command(&self) -> RobotCommand {
        let upper_rad = std::array::from_fn(|i| self.memory.last_upper_rad[i]);
        RobotCommand { upper_rad, base: self.memory.base }
    }

    /// The command under which the robot stays as it is.
    pub(crate) fn rest_command(&self, dynamics: &Dynamics) -> RobotCommand {
        let tree = dynamics.tree(self.tree);
        let (q_rad, _) = joints::read(tree, &self.model);
        let base = BaseCommand::standing(tree.world_from_link(0).translation.z as f32);
        RobotCommand { upper_rad: UPPER.map(|joint| q_rad[joint]), base: self.base_limits().clamp(base) }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::body::posed::{Posed, model};
    use crate::dynamics::{DVec3, Settings};
    use crate::robot::RobotPlacement;

    /// What is sensed in the physics world is what the model's kinematics make of joints and pelvis: here of a robot in the
    /// air, touching nothing, with an arm on the move.
    #[test]
    fn sensed_poses_and_velocities_are_those_of_the_model() {
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
        let sensed = robot.measure(&dynamics);
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
