//! One robot in a world: creation, sensing and driving.

mod arm_momentum;
mod hand_loads;
mod joints;
mod knowledge;
mod sensors;
mod spawn;
mod state;

use std::sync::Arc;

use rapier3d::math::Pose;
use serde::{Deserialize, Serialize};

pub use knowledge::{Sensing, StateSource};
pub use sensors::SensorModel;
pub use spawn::RobotPlacement;
pub use state::{RobotEstimate, RobotSensed, RobotTruth};

use crate::body::{
    BodyEstimate, JOINTS, JointDrive, LEG_JOINTS, LEGS, MotorSetpoints, RobotModel, UPPER, UPPER_JOINTS,
    WAIST, WAIST_COLUMN, WAIST_JOINTS,
};
use crate::dynamics::{DVec3, Dynamics, TreeId};
use crate::estimate::SensorReadings;
use crate::locomotion::{BaseCommand, BaseLimits, LegCommand, Locomotion};
use crate::{CONTROL_DT_S, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL, SimError};
use hand_loads::HandLoads;
use knowledge::SelfKnowledge;

/// Command for one robot in one control step.
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
    /// Tree of the robot; its links are the model's.
    pub(crate) tree: TreeId,
    locomotion: Box<dyn Locomotion>,
    memory: RobotMemory,
    /// The robot's estimate of its body since the last [`Robot::sense`].
    body: BodyEstimate,
    /// Motor setpoints for the next control step, in place of its command; empty if the command applies.
    setpoints: Vec<MotorSetpoints>,
    /// Sensor readings of the last control step, one for each physics step.
    readings: Vec<SensorReadings>,
}

/// All state of a robot outside dynamics that outlasts a step.
#[derive(Clone, Serialize, Deserialize)]
struct RobotMemory {
    /// Upper-body targets at the last control step; within a step they move linearly to the new command.
    last_upper_rad: Vec<f32>,
    hand_loads: HandLoads,
    knowledge: SelfKnowledge,
    base: BaseCommand,
    fallen: bool,
}

/// Rate of change of a target up to which an arm or finger counts as commanded to be still.
const STILL_TOLD_RAD_S: f32 = 0.2;
const FALLEN_HEIGHT_M: f64 = 0.4;
const FALLEN_TILT_COSINE: f64 = 0.5;

impl Robot {
    /// Returns the base commands that this robot can follow.
    pub fn base_limits(&self) -> BaseLimits {
        self.locomotion.limits(&self.model.scale)
    }

    /// Returns the robot's estimate of its own body.
    pub fn body(&self) -> &BodyEstimate {
        &self.body
    }

    pub(crate) fn set_locomotion(&mut self, locomotion: Box<dyn Locomotion>) {
        self.locomotion = locomotion;
    }

    /// Replaces the sensors and the state estimate. The robot is assumed to have stood still until now, at
    /// the pelvis pose `told`.
    pub(crate) fn set_sensing(&mut self, dynamics: &Dynamics, told: &Pose, sensing: Sensing, seed: u64) {
        let tree = dynamics.tree(self.tree);
        self.memory.knowledge = SelfKnowledge::new(&self.model, tree, told, sensing, seed);
        self.readings.clear();
        self.recollect(dynamics);
    }

    /// Replaces drives and base controller by motor setpoints for the next control step: one for each physics
    /// step, or one for all of them.
    pub(crate) fn set_motors(&mut self, setpoints: &[MotorSetpoints]) {
        let valid = [1, PHYSICS_STEPS_PER_CONTROL as usize].contains(&setpoints.len());
        assert!(valid, "one setpoint for a control step, or one for each physics step");
        self.setpoints = setpoints.to_vec();
    }

    /// Ends a control step and discards its setpoints.
    pub(crate) fn end_step(&mut self) {
        self.setpoints.clear();
    }

    /// Returns the sensor readings of the last control step in order of time, one for each physics step. At
    /// the start and after a restore it returns only the last reading.
    pub fn readings(&self) -> &[SensorReadings] {
        match self.readings.is_empty() {
            true => std::slice::from_ref(self.memory.knowledge.readings()),
            false => &self.readings,
        }
    }

    /// Reads the sensors, once after every physics step.
    pub(crate) fn sense(&mut self, dynamics: &Dynamics) {
        let tree = dynamics.tree(self.tree);
        let body = self.memory.knowledge.update(&self.model, tree);
        self.readings.push(self.memory.knowledge.readings().clone());
        self.take(body);
        // Falls are detected from the simulator's state rather than the robot's estimate: they are scored,
        // and switch off the legs.
        let pelvis = tree.world_from_link(0);
        let upright = (pelvis.rotation * DVec3::Z).z;
        self.memory.fallen |= pelvis.translation.z < self.model.scale.precise_height_m(FALLEN_HEIGHT_M)
            || upright < FALLEN_TILT_COSINE;
    }

    /// Restores the body estimate that belongs to the robot's restored memory.
    fn recollect(&mut self, dynamics: &Dynamics) {
        let body = self.memory.knowledge.body(&self.model, dynamics.tree(self.tree));
        self.take(body);
    }

    fn take(&mut self, body: BodyEstimate) {
        let hand_reaction_n = self.memory.hand_loads.reaction_n();
        let hand_holds = self.memory.hand_loads.holds();
        let hand_presses = self.memory.hand_loads.presses();
        let waist_target_rad = self.waist_target_rad();
        self.body = BodyEstimate { hand_reaction_n, hand_holds, hand_presses, waist_target_rad, ..body };
    }

    /// Sets this robot's joint drives for one physics step, `substep` counting from 0 within the control
    /// step.
    pub(crate) fn drive(&mut self, dynamics: &mut Dynamics, command: &RobotCommand, substep: u32) {
        if substep == 0 {
            self.readings.clear();
        }
        self.body.arms_told = self.arms_told(command);
        let torque_n_m = &self.memory.knowledge.readings().joints.torque_n_m;
        let load_n_m = self.memory.hand_loads.update(&self.body, torque_n_m, PHYSICS_DT_S);
        let drives = match self.setpoints.get(substep as usize).or(self.setpoints.last()) {
            Some(setpoints) => {
                self.locomotion.let_go();
                setpoints.drives(&self.model.joints, PHYSICS_DT_S)
            }
            None => self.commanded_drives(&load_n_m, command, substep),
        };
        joints::drive(dynamics.tree_mut(self.tree), &self.model, &drives);
        self.remember(command, substep);
    }

    /// Returns the drives of a robot that follows its command, with the base controller's legs.
    fn commanded_drives(
        &mut self,
        load_n_m: &[f32; JOINTS],
        command: &RobotCommand,
        substep: u32,
    ) -> [JointDrive; JOINTS] {
        let legs = match self.memory.fallen {
            true => limp_legs(&self.model),
            false => self.locomotion.tick(&self.body, &command.base, PHYSICS_DT_S),
        };
        let mut drives = [JointDrive::default(); JOINTS];
        self.set_upper_body(&mut drives, load_n_m, command, substep);
        set_legs(&mut drives, &legs);
        drives
    }

    /// Returns true if the command moves an arm or a finger.
    fn arms_told(&self, command: &RobotCommand) -> bool {
        let columns = self.memory.last_upper_rad.iter().zip(&command.upper_rad).take(WAIST_COLUMN);
        columns.into_iter().any(|(from, to)| (to - from).abs() > STILL_TOLD_RAD_S * CONTROL_DT_S)
    }

    /// Sets the drives of the upper body, whose targets move linearly from the last command to this one.
    /// A controller that balances with the waist adds to the waist's targets.
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

    /// Returns the waist targets of the last control step's command.
    fn waist_target_rad(&self) -> [f32; WAIST_JOINTS] {
        std::array::from_fn(|i| self.memory.last_upper_rad[WAIST_COLUMN + i])
    }

    /// Serialises all state of the robot outside dynamics.
    pub(crate) fn save(&self) -> Result<Vec<u8>, SimError> {
        Ok(postcard::to_stdvec(&(&self.memory, self.locomotion.save()?))?)
    }

    /// Restores saved state. `dynamics` must be those of the moment at which it was saved.
    pub(crate) fn load(&mut self, dynamics: &Dynamics, bytes: &[u8]) -> Result<(), SimError> {
        let (memory, locomotion): (RobotMemory, Vec<u8>) = postcard::from_bytes(bytes)?;
        self.locomotion.load(&locomotion)?;
        self.memory = memory;
        self.readings.clear();
        self.recollect(dynamics);
        Ok(())
    }
}

/// Returns the leg drives of a robot that has fallen. No controller here gets up, and a controller that
/// continues to balance a robot on its back makes it thrash with kilowatts. The dampers of the drives let the
/// robot sink. Waist, arms and hands still follow their commands.
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
