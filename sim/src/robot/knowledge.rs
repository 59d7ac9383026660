//! A robot's estimate of its own body: by its sensors and an estimator, or, for comparison, from the
//! simulator's state.

use std::sync::Arc;

use rapier3d::math::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::sensors::{SensorModel, Sensors};
use crate::body::{BodyEstimate, KnownOfBody, RobotModel, WAIST_JOINTS};
use crate::dynamics::Tree;
use crate::estimate::{SensorReadings, StateEstimator};
use crate::mechanism::rounded;
use crate::plane::{flat, heading_rad};
use crate::{PHYSICS_DT_S, Sides};

/// Source of the state estimate of a robot's pelvis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StateSource {
    /// A filter over inertial measurement unit, joint encoders and joint torques, as a real robot needs it.
    #[default]
    Estimator,
    /// The simulator's own state, which no real robot has.
    Truth,
}

/// Configuration of the robots' sensors and state estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sensing {
    pub state_estimate: StateSource,
    pub sensors: SensorModel,
}

impl StateSource {
    pub const ALL: [StateSource; 2] = [StateSource::Estimator, StateSource::Truth];

    pub fn name(self) -> &'static str {
        match self {
            StateSource::Estimator => "estimator",
            StateSource::Truth => "truth",
        }
    }
}

impl Sensing {
    /// Configuration from before the estimator existed: the simulator's state and ideal sensors.
    pub const TRUTH: Sensing = Sensing { state_estimate: StateSource::Truth, sensors: SensorModel::Ideal };
}

/// Sensors, their last readings, and the estimate from these readings.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct SelfKnowledge {
    sensors: Sensors,
    readings: SensorReadings,
    /// The estimator; `None` if truth is the source.
    estimator: Option<StateEstimator>,
    /// Start frame: on the floor under the initial position of the pelvis, z up, x in the direction that the
    /// pelvis faced.
    world_from_start: Pose,
}

impl SelfKnowledge {
    /// Creates the estimate of a robot that has stood still for a second. The initial position and heading of
    /// the pelvis are those of `told`. Equal seeds give equal noise.
    pub(super) fn new(
        model: &RobotModel,
        tree: &Tree,
        told: &Pose,
        sensing: Sensing,
        seed: u64,
    ) -> SelfKnowledge {
        let mut sensors = Sensors::new(sensing.sensors, seed);
        let readings = sensors.read(tree, model, PHYSICS_DT_S);
        let rotation = rounded(&tree.world_from_link(0)).rotation;
        let estimator = (sensing.state_estimate == StateSource::Estimator).then(|| {
            let upwards = rotation.inverse() * Vector::Z;
            let still_force_m_s2 = sensors.still_force_m_s2(upwards * crate::GRAVITY_M_S2);
            StateEstimator::new(model, told, &readings.joints.q_rad, still_force_m_s2, sensors.latency_s())
        });
        let heading = Rotation::from_rotation_z(heading_rad(told));
        let world_from_start = Pose::from_parts(flat(told.translation), heading);
        SelfKnowledge { sensors, readings, estimator, world_from_start }
    }

    /// Runs one physics step. Returns the resulting body estimate, with empty hands.
    pub(super) fn update(&mut self, model: &Arc<RobotModel>, tree: &Tree) -> BodyEstimate {
        self.readings = self.sensors.read(tree, model, PHYSICS_DT_S);
        let Some(estimator) = &mut self.estimator else { return from_truth(model, tree, &self.readings) };
        let pelvis_from_link = estimator.update(model, &self.readings, PHYSICS_DT_S);
        estimator.body(model, &self.readings, &pelvis_from_link)
    }

    pub(super) fn readings(&self) -> &SensorReadings {
        &self.readings
    }

    pub(super) fn world_from_start(&self) -> &Pose {
        &self.world_from_start
    }

    /// Returns the body estimate of the last update.
    pub(super) fn body(&self, model: &Arc<RobotModel>, tree: &Tree) -> BodyEstimate {
        match &self.estimator {
            Some(estimator) => {
                let pelvis_from_link = model.forward_kinematics(Pose::IDENTITY, &self.readings.joints.q_rad);
                estimator.body(model, &self.readings, &pelvis_from_link)
            }
            None => from_truth(model, tree, &self.readings),
        }
    }
}

/// Returns the body estimate from the simulator's state. With ideal sensors the two are bit-identical. Masses
/// are the model's, regardless of loads on a hand.
fn from_truth(model: &Arc<RobotModel>, tree: &Tree, readings: &SensorReadings) -> BodyEstimate {
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
        let palm_m = tree.world_from_link(hand.wrist) * hand.palm_in_wrist_m.as_dvec3();
        tree.point_velocity_m_s(hand.wrist, palm_m).as_vec3()
    });
    BodyEstimate {
        model: Arc::clone(model),
        q_rad: readings.joints.q_rad,
        qd_rad_s: readings.joints.qd_rad_s,
        pelvis_velocity_m_s: tree.link_velocity_m_s(0).as_vec3(),
        pelvis_angular_velocity_rad_s: tree.link_spin_rad_s(0).as_vec3(),
        world_from_link,
        com_m: com_m / model.mass_kg,
        com_velocity_m_s: com_velocity_m_s / model.mass_kg,
        palm_velocity_m_s,
        hand_reaction_n: Sides::both(Vector::ZERO),
        hand_holds: Sides::both(false),
        hand_presses: Sides::both(false),
        arms_told: false,
        waist_target_rad: [0.0; WAIST_JOINTS],
        known: KnownOfBody::default(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::{Robot, RobotPlacement};
    use crate::PHYSICS_DT_S;
    use crate::body::posed::{Posed, model};
    use crate::dynamics::{DVec3, Dynamics, Settings};

    /// The values read from the physics world match the model's kinematics for joints and pelvis. The robot
    /// is in the air without contacts, with a moving arm.
    #[test]
    fn poses_and_velocities_are_those_of_the_model() {
        let mut dynamics = Dynamics::new(Settings::new(f64::from(PHYSICS_DT_S), DVec3::Z * -9.81));
        let placement = RobotPlacement { name: "A".into(), position_m: [0.3, -0.2], yaw_rad: 0.8 };
        let model = Arc::new(model().clone());
        let mut robot = Robot::spawn(&mut dynamics, &model, &placement, 0).unwrap();
        let mut command = robot.rest_command();
        command.upper_rad[0] -= 0.1;
        for substep in 0..4 {
            robot.drive(&mut dynamics, &command, substep);
            dynamics.step().unwrap();
            robot.sense(&dynamics);
        }
        let sensed = &robot.body;
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
        // They agree to the order of one physics step.
        assert!(error_m_s < 0.01, "{} {}", sensed.com_velocity_m_s, body.com_velocity_m_s);
    }
}
