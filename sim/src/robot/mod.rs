//! One robot in a world: put there, sensed, driven.

mod estimate;
mod hand_loads;
mod joints;
mod odometry;
mod spawn;
mod state;

use std::sync::Arc;

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

pub use spawn::RobotPlacement;
pub use state::{RobotEstimate, RobotSensed, RobotTruth};

use crate::body::{
    BodyEstimate, JOINTS, JointDrive, LEG_JOINTS, LEGS, RobotModel, UPPER, UPPER_JOINTS, WAIST, WAIST_COLUMN,
    WAIST_JOINTS,
};
use crate::dynamics::{Dynamics, TreeId};
use crate::locomotion::{BaseCommand, BaseLimits, LegCommand, Locomotion};
use crate::{CONTROL_DT_S, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL, SimError};
use hand_loads::HandLoads;
use odometry::Odometry;

/// What one robot is told for one control step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotCommand {
    /// Absolute joint targets in action order (see [`UPPER`]).
    pub upper_rad: [f32; UPPER_JOINTS],
    pub base: BaseCommand,
}

/// A robot that exists in a world.
pub struct Robot {
    pub name: String,
    pub model: Arc<RobotModel>,
    /// Its links are the model's.
    pub(crate) tree: TreeId,
    locomotion: Box<dyn Locomotion>,
    memory: RobotMemory,
}

/// Everything of a robot that lives outside dynamics and outlasts a step.
#[derive(Clone, Serialize, Deserialize)]
struct RobotMemory {
    /// Upper-body targets at the last control step; within a step they move linearly to the new command.
    last_upper_rad: Vec<f32>,
    hand_loads: HandLoads,
    odometry: Odometry,
    base: BaseCommand,
    fallen: bool,
}

const FALLEN_HEIGHT_M: f32 = 0.4;
const FALLEN_TILT_COSINE: f32 = 0.5;

impl Robot {
    /// Base commands that this robot can follow.
    pub fn base_limits(&self) -> BaseLimits {
        self.locomotion.limits()
    }

    pub(crate) fn set_locomotion(&mut self, locomotion: Box<dyn Locomotion>) {
        self.locomotion = locomotion;
    }

    /// Sets this robot's joint drives for one physics step, `substep` counting from 0 within the control step.
    pub(crate) fn drive(&mut self, dynamics: &mut Dynamics, command: &RobotCommand, substep: u32) {
        // The estimate borrows from this model, so that the robot may change meanwhile.
        let model = Arc::clone(&self.model);
        let tree = dynamics.tree_mut(self.tree);
        let hand_force_n = self.memory.hand_loads.force_n();
        let body = estimate::from_truth(&model, tree, hand_force_n, self.waist_target_rad());
        let load_n_m = self.feel(&body, &joints::torques_n_m(tree, &model));
        self.memory.odometry.update(&body, PHYSICS_DT_S);
        let legs = match self.memory.fallen {
            true => limp_legs(&model),
            false => self.locomotion.tick(&body, &command.base, PHYSICS_DT_S),
        };
        let mut drives = [JointDrive::default(); JOINTS];
        self.set_upper_body(&mut drives, &load_n_m, command, substep);
        set_legs(&mut drives, &legs);
        joints::drive(tree, &model, &drives);
        self.remember(command, substep);
    }

    /// Torques of the upper body's joints against gravity and what the hands carry, as far as it is known by now.
    /// `torque_n_m` are the drives' torques of the last step.
    fn feel(&mut self, body: &BodyEstimate, torque_n_m: &[f32; JOINTS]) -> [f32; JOINTS] {
        let pelvis = body.world_from_pelvis();
        let upright = (pelvis.rotation * Vector::Z).z;
        self.memory.fallen |= pelvis.translation.z < FALLEN_HEIGHT_M || upright < FALLEN_TILT_COSINE;
        self.memory.hand_loads.update(body, torque_n_m, PHYSICS_DT_S)
    }

    /// The upper body goes linearly from the last command to this one. A controller that balances with the waist adds to
    /// the waist's targets.
    fn set_upper_body(
        &self,
        drives: &mut [JointDrive; JOINTS],
        load_n_m: &[f32; JOINTS],
        command: &RobotCommand,
        substep: u32,
    ) {
        let part = (substep + 1) as f32 / PHYSICS_STEPS_PER_CONTROL as f32;
        for (i, joint) in UPPER.into_iter().enumerate() {
            let model = &self.model.joints[joint];
            let (from, to) = (self.memory.last_upper_rad[i], command.upper_rad[i]);
            drives[joint] = JointDrive {
                target_rad: from + (to - from) * part,
                kp_n_m_rad: model.kp_n_m_rad,
                kd_n_m_s_rad: model.kd_n_m_s_rad,
                // The damper acts on the absolute velocity, so the wanted velocity is fed forward.
                feedforward_n_m: load_n_m[joint] + model.kd_n_m_s_rad * (to - from) / CONTROL_DT_S,
            };
        }
        if !self.memory.fallen {
            for (drive, offset_rad) in drives[WAIST..].iter_mut().zip(self.locomotion.waist_offset_rad()) {
                drive.target_rad += offset_rad;
            }
        }
    }

    fn remember(&mut self, command: &RobotCommand, substep: u32) {
        self.memory.base = command.base;
        if substep + 1 == PHYSICS_STEPS_PER_CONTROL {
            self.memory.last_upper_rad.copy_from_slice(&command.upper_rad);
        }
    }

    /// Where the last control step's command took the waist.
    fn waist_target_rad(&self) -> [f32; WAIST_JOINTS] {
        std::array::from_fn(|i| self.memory.last_upper_rad[WAIST_COLUMN + i])
    }

    /// Serialises everything of the robot that lives outside dynamics.
    pub(crate) fn save(&self) -> Result<Vec<u8>, SimError> {
        Ok(postcard::to_stdvec(&(&self.memory, self.locomotion.save()?))?)
    }

    pub(crate) fn load(&mut self, bytes: &[u8]) -> Result<(), SimError> {
        let (memory, locomotion): (RobotMemory, Vec<u8>) = postcard::from_bytes(bytes)?;
        self.locomotion.load(&locomotion)?;
        self.memory = memory;
        Ok(())
    }
}

/// Legs of a robot that has fallen: no controller here gets up, and one that goes on balancing on its back thrashes about with
/// kilowatts. The dampers of the drives let it sink. Waist, arms and hands go on doing what they are told.
fn limp_legs(model: &RobotModel) -> LegCommand {
    LEGS.map(|first| {
        std::array::from_fn(|i| JointDrive {
            kd_n_m_s_rad: model.joints[first + i].kd_n_m_s_rad,
            ..JointDrive::default()
        })
    })
}

fn set_legs(drives: &mut [JointDrive; JOINTS], legs: &LegCommand) {
    for (first, leg) in LEGS.into_iter().zip(legs.iter()) {
        drives[first..first + LEG_JOINTS].copy_from_slice(leg);
    }
}
