//! State of a robot: sensor readings, the robot's estimate of its pose in the world, and ground truth.

use rapier3d::math::{Pose, Vector};
use serde::{Deserialize, Serialize};

use super::{Robot, RobotCommand};
use crate::Sides;
use crate::body::UPPER;
use crate::dynamics::Dynamics;
use crate::estimate::JointReadings;
use crate::locomotion::BaseCommand;
use crate::mechanism::rounded;

/// Values that a robot senses, in its own frames. A reply or a policy may use only these and
/// [`RobotTruth::fallen`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotSensed {
    pub joints: JointReadings,
    /// Direction of gravity, which the IMU measures, in the pelvis frame.
    pub gravity_in_pelvis: Vector,
    /// Pose of the pelvis by the robot's own odometry. The start frame is on the floor under the initial
    /// position of the pelvis, z up, x in the direction that the pelvis faced.
    pub start_from_pelvis: Pose,
    pub pelvis_from_wrist: Sides<Pose>,
    /// Pose of the camera; axes as in [`crate::mjcf::MjcfCamera`].
    pub pelvis_from_camera: Pose,
    /// External force on each hand, pelvis frame, estimated from joint torques.
    pub hand_force_in_pelvis_n: Sides<Vector>,
    /// True while its base controller steps; `None` if the controller does not report it.
    pub is_stepping: Option<bool>,
}

/// A robot's own estimate of its pose, by which its hands and base are controlled. The frame was the world
/// frame at the start. No reply contains this estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotEstimate {
    pub world_from_pelvis: Pose,
    /// External force on each hand, in the same frame, estimated from joint torques.
    pub hand_force_n: Sides<Vector>,
}

/// State of a robot in the simulator, to which the robot has no access: for scoring, recordings, images and
/// experts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotTruth {
    /// Pose of every link, in the order of [`crate::body::RobotModel::links`]; the pelvis is the first.
    pub world_from_link: Vec<Pose>,
    pub world_from_wrist: Sides<Pose>,
    /// Pose of the camera; axes as in [`crate::mjcf::MjcfCamera`].
    pub world_from_camera: Pose,
    /// Pose of the camera one control step earlier; `None` before the first step and if it is unknown.
    /// Recordings leave it out, since the step before has it.
    #[serde(skip)]
    pub world_from_camera_before: Option<Pose>,
    /// True once the pelvis was below 0.4 m or tilted beyond 60 degrees. It stays true, since no robot is put
    /// back on its feet. No other field here affects a robot and its policy: the legs lose power, and replies
    /// report the fall.
    pub fallen: bool,
}

impl RobotSensed {
    /// Returns the sum of the absolute mechanical powers of all joints.
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
    /// Returns the sensed values and the poses derived from these values.
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

    /// Returns the robot's estimate of its own pose.
    pub(crate) fn estimate(&self) -> RobotEstimate {
        RobotEstimate {
            world_from_pelvis: self.body.world_from_pelvis(),
            hand_force_n: self.memory.hand_loads.force_n(),
        }
    }

    /// Returns the simulator's state of the robot.
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
            world_from_camera: self.world_from_camera(dynamics),
            world_from_camera_before: None,
            world_from_link,
            fallen: self.memory.fallen,
        }
    }

    /// Returns the pose of the camera as in [`RobotTruth`].
    pub(crate) fn world_from_camera(&self, dynamics: &Dynamics) -> Pose {
        let model = &self.model;
        let world_from_head = dynamics.tree(self.tree).world_from_link(model.egocentric_link);
        rounded(&world_from_head) * model.egocentric.body_from_camera
    }

    /// Returns the command of the last control step.
    pub(crate) fn last_command(&self) -> RobotCommand {
        let upper_rad = std::array::from_fn(|i| self.memory.last_upper_rad[i]);
        RobotCommand { upper_rad, base: self.memory.base }
    }

    /// Returns the command that keeps the robot in its present state, by its encoders and its estimate of its
    /// pelvis.
    pub(crate) fn rest_command(&self) -> RobotCommand {
        let base = BaseCommand::standing(self.body.world_from_pelvis().translation.z);
        let upper_rad = UPPER.map(|joint| {
            let model = &self.model.joints[joint];
            // With noise, a joint at its stop may read as beyond it.
            self.body.q_rad[joint].clamp(model.lower_rad, model.upper_rad)
        });
        RobotCommand { upper_rad, base: self.base_limits().clamp(base) }
    }
}
