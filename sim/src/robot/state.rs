//! What is known of a robot, by who may know it: what it senses, what it takes its place in the world to be, and what only the
//! simulator knows.

use rapier3d::math::{Pose, Vector};
use serde::{Deserialize, Serialize};

use super::{Robot, RobotCommand};
use crate::Sides;
use crate::body::UPPER;
use crate::dynamics::Dynamics;
use crate::estimate::JointReadings;
use crate::locomotion::BaseCommand;
use crate::mechanism::rounded;

/// What a robot senses, in frames of its own: all that a reply or a policy may be made of, but for
/// [`RobotTruth::fallen`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotSensed {
    pub joints: JointReadings,
    /// The way down, which the IMU measures, in the pelvis frame.
    pub gravity_in_pelvis: Vector,
    /// The pelvis by the robot's own odometry: the start frame lies on the floor under the pelvis as it was put into the world,
    /// z up, x where the pelvis faced.
    pub start_from_pelvis: Pose,
    pub pelvis_from_wrist: Sides<Pose>,
    /// Axes as [`crate::mjcf::MjcfCamera`]'s.
    pub pelvis_from_camera: Pose,
    /// External force on each hand, pelvis frame, estimated from joint torques.
    pub hand_force_in_pelvis_n: Sides<Vector>,
    /// Whether its base controller steps, as far as that tells.
    pub is_stepping: Option<bool>,
}

/// Where a robot takes itself to be, for what steers its hands and its base: by its estimator, in a frame that was the world's
/// when it started. No reply shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotEstimate {
    pub world_from_pelvis: Pose,
    /// External force on each hand, in the same frame, estimated from joint torques.
    pub hand_force_n: Sides<Vector>,
}

/// What only the simulator knows of a robot: for scoring, recordings, pictures and experts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotTruth {
    /// Every link, in the order of [`crate::body::RobotModel::links`]; the pelvis is the first.
    pub world_from_link: Vec<Pose>,
    pub world_from_wrist: Sides<Pose>,
    /// Axes as [`crate::mjcf::MjcfCamera`]'s.
    pub world_from_camera: Pose,
    /// Pelvis below 0.4 m or tilted beyond 60 degrees. Stays true: nothing puts a robot back. The one thing here that reaches
    /// a robot and its policy: it takes the power from the legs, and replies tell it.
    pub fallen: bool,
}

impl RobotSensed {
    /// Mechanical power of all joints, each counted whichever way it works.
    pub fn power_w(&self) -> f32 {
        let JointReadings { qd_rad_s, torque_n_m, .. } = &self.joints;
        torque_n_m.iter().zip(qd_rad_s).map(|(torque, rate)| (torque * rate).abs()).sum()
    }
}

impl RobotTruth {
    pub fn world_from_pelvis(&self) -> Pose {
        self.world_from_link[0]
    }
}

impl Robot {
    /// What the robot senses, and what it makes of that.
    pub(crate) fn sensed(&self) -> RobotSensed {
        let body = &self.body;
        let world_from_pelvis = body.world_from_pelvis();
        let pelvis_from_world = world_from_pelvis.inverse();
        RobotSensed {
            joints: self.memory.knowledge.readings().joints.clone(),
            gravity_in_pelvis: pelvis_from_world.rotation * -Vector::Z,
            start_from_pelvis: self.memory.knowledge.world_from_start().inverse() * world_from_pelvis,
            pelvis_from_wrist: self
                .model
                .wrists
                .each_ref()
                .map(|wrist| pelvis_from_world * body.world_from_site(wrist)),
            pelvis_from_camera: pelvis_from_world
                * body.world_from_link[self.model.egocentric_link]
                * self.model.egocentric.body_from_camera,
            hand_force_in_pelvis_n: self
                .memory
                .hand_loads
                .force_n()
                .map(|force_n| pelvis_from_world.rotation * force_n),
            is_stepping: self.locomotion.is_stepping(),
        }
    }

    /// Where the robot takes itself to be.
    pub(crate) fn estimate(&self) -> RobotEstimate {
        RobotEstimate {
            world_from_pelvis: self.body.world_from_pelvis(),
            hand_force_n: self.memory.hand_loads.force_n(),
        }
    }

    /// What the simulator knows.
    pub(crate) fn truth(&self, dynamics: &Dynamics) -> RobotTruth {
        let tree = dynamics.tree(self.tree);
        let links = 0..self.model.links.len();
        let world_from_link: Vec<Pose> = links.map(|link| rounded(&tree.world_from_link(link))).collect();
        let model = &self.model;
        RobotTruth {
            world_from_wrist: model
                .wrists
                .each_ref()
                .map(|wrist| world_from_link[wrist.link] * wrist.link_from_site),
            world_from_camera: world_from_link[model.egocentric_link] * model.egocentric.body_from_camera,
            world_from_link,
            fallen: self.memory.fallen,
        }
    }

    /// The command of the last control step.
    pub(crate) fn last_command(&self) -> RobotCommand {
        let upper_rad = std::array::from_fn(|i| self.memory.last_upper_rad[i]);
        RobotCommand { upper_rad, base: self.memory.base }
    }

    /// The command under which the robot stays as it is, by its encoders and by where it takes its pelvis to be.
    pub(crate) fn rest_command(&self) -> RobotCommand {
        let base = BaseCommand::standing(self.body.world_from_pelvis().translation.z);
        let upper_rad = UPPER.map(|joint| {
            let model = &self.model.joints[joint];
            // Noise may read a joint at its stop as beyond it.
            self.body.q_rad[joint].clamp(model.lower_rad, model.upper_rad)
        });
        RobotCommand { upper_rad, base: self.base_limits().clamp(base) }
    }
}
