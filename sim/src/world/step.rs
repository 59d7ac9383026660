//! The result of one control step: plain, serialisable, complete. All observers of a world read it.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

use super::objects::Object;
use super::{ObjectState, World};
use crate::robot::{RobotCommand, RobotEstimate, RobotSensed, RobotTruth};
use crate::{CONTROL_HZ, Side, Sides};

/// The world after one control step, or before the first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Number of steps made so far.
    pub control_step: u64,
    /// Simulated time since the first step.
    pub time_s: f64,
    /// Robots, in the order of [`World::robots`].
    pub robots: Vec<RobotStep>,
    /// Objects, in the order of [`World::object_models`].
    pub objects: Vec<ObjectStep>,
    /// Hands that touch an object; hands that touch none have no entry.
    pub touches: Vec<Touch>,
    /// Robots that touch an object with any of their parts, including hands.
    pub body_touches: Vec<BodyTouch>,
}

/// One robot: sensed values after the step, its estimate of its pose, the truth, and the step's command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotStep {
    pub sensed: RobotSensed,
    pub estimate: RobotEstimate,
    pub truth: RobotTruth,
    /// The command of the step; before the first step, the one under which the robot rests.
    pub command: RobotCommand,
}

/// Name and state of one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectStep {
    pub name: String,
    pub state: ObjectState,
}

/// Contact of one hand with one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Touch {
    /// Index into [`Step::robots`].
    pub robot: usize,
    pub side: Side,
    /// Index into [`Step::objects`].
    pub object: usize,
    pub contacts: HandContacts,
}

/// Contact of any part of a robot with one object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct BodyTouch {
    /// Index into [`Step::objects`].
    pub object: usize,
    /// Index into [`Step::robots`].
    pub robot: usize,
}

/// Mean normal contact forces (N, world) of a hand's parts on an object in the last physics step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HandContacts {
    pub thumb_n: Vector,
    pub fingers_n: Vector,
    pub palm_n: Vector,
}

impl RobotStep {
    /// Returns the external force on each hand that the robot senses, converted to the world frame with
    /// the true pose.
    pub fn hand_force_in_world_n(&self) -> Sides<Vector> {
        let world_from_pelvis = self.truth.world_from_pelvis();
        self.sensed.hand_force_in_pelvis_n.map(|force_n| world_from_pelvis.rotation * force_n)
    }
}

impl Step {
    /// Returns the state of an object, by its name in tasks.
    pub fn object(&self, name: &str) -> Option<&ObjectState> {
        self.objects.iter().find(|object| object.name == name).map(|object| &object.state)
    }

    /// Returns true if any part of any robot touches an object; false for an unknown object.
    pub fn is_touched(&self, object: &str) -> bool {
        self.body_touches.iter().any(|touch| self.objects[touch.object].name == object)
    }

    /// Returns the forces of one hand on one object; zero if the object is unknown or not touched.
    pub fn contacts(&self, robot: usize, side: Side, object: &str) -> HandContacts {
        let of_hand = |touch: &&Touch| {
            touch.robot == robot && touch.side == side && self.objects[touch.object].name == object
        };
        self.touches.iter().find(of_hand).map(|touch| touch.contacts).unwrap_or_default()
    }
}

impl World {
    /// Returns the present world: the result of the last [`World::control_step`], also after a restore.
    pub fn present(&self) -> Step {
        let object =
            |object: &Object| ObjectStep { name: object.name.clone(), state: object.state(&self.dynamics) };
        Step {
            control_step: self.control_steps,
            time_s: self.control_steps as f64 / CONTROL_HZ,
            robots: (0..self.robots.len()).map(|robot| self.robot_step(robot)).collect(),
            objects: self.objects.iter().map(object).collect(),
            touches: self.touches(),
            body_touches: self.body_touches(),
        }
    }

    fn robot_step(&self, index: usize) -> RobotStep {
        let robot = &self.robots[index];
        let command = match self.control_steps {
            0 => robot.rest_command(),
            _ => robot.last_command(),
        };
        RobotStep {
            sensed: robot.sensed(),
            estimate: robot.estimate(),
            truth: RobotTruth {
                world_from_camera_before: self.cameras_before.get(index).copied(),
                ..robot.truth(&self.dynamics)
            },
            command,
        }
    }
}
