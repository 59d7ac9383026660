//! One robot in a world: measured state, joint drives, payload estimate.

mod dynamics;
mod hand_force;
mod layout;
mod model;
mod payload;
mod per_joint;
mod spawn;
mod whole_body;

use std::sync::Arc;

use rapier3d::math::{Pose, Vector};
use rapier3d::prelude::{ColliderHandle, MultibodyJointHandle, PhysicsWorld, RigidBodyHandle};
use serde::{Deserialize, Serialize};

pub use dynamics::{Acceleration, Effort};
pub use layout::{
    ARM_COLUMNS, ARM_JOINTS, HAND_COLUMNS, HAND_JOINTS, JOINTS, UPPER, UPPER_JOINTS, WAIST_COLUMN,
    joint_names,
};
pub use model::{HandLinks, JointModel, Link, RobotModel, SiteModel};
pub use whole_body::WholeBody;

pub(crate) use layout::{ARMS, LEG_JOINTS, LEGS, WAIST};

use crate::locomotion::{BaseCommand, Drive, Locomotion};
use crate::{CONTROL_DT_S, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL, Side, Sides, SimError};
use hand_force::HandForce;
use payload::Payload;

/// What one robot is told for one control step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotCommand {
    /// Absolute joint targets in action order (see [`UPPER`]).
    pub upper_rad: [f32; UPPER_JOINTS],
    pub base: BaseCommand,
}

/// What a robot can measure of itself; poses as named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotState {
    /// Published order, as the velocities and torques.
    #[serde(with = "per_joint")]
    pub q_rad: [f32; JOINTS],
    #[serde(with = "per_joint")]
    pub qd_rad_s: [f32; JOINTS],
    #[serde(with = "per_joint")]
    pub torque_n_m: [f32; JOINTS],
    pub world_from_pelvis: Pose,
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

/// A robot that exists in a physics world.
pub struct Robot {
    pub name: String,
    pub model: Arc<RobotModel>,
    pub(crate) bodies: Vec<RigidBodyHandle>,
    joints: Vec<MultibodyJointHandle>,
    /// Multibody link index and degree of freedom of each joint.
    slots: Vec<(usize, usize)>,
    pub(crate) colliders: Vec<(ColliderHandle, usize)>,
    locomotion: Box<dyn Locomotion>,
    memory: Memory,
}

/// Everything of a robot that lives outside Rapier and outlasts a step.
#[derive(Clone, Serialize, Deserialize)]
struct Memory {
    /// Upper-body targets at the last control step; within a step they move linearly to the new command.
    last_upper_rad: Vec<f32>,
    torque_n_m: Vec<f32>,
    payload: Payload,
    hand_force: HandForce,
    base: BaseCommand,
    fallen: bool,
}

const FALLEN_HEIGHT_M: f32 = 0.4;
const FALLEN_TILT_COSINE: f32 = 0.5;

impl Robot {
    /// Base commands that this robot can follow.
    pub fn base_limits(&self) -> crate::BaseLimits {
        self.locomotion.limits()
    }

    pub(crate) fn set_locomotion(&mut self, locomotion: Box<dyn Locomotion>) {
        self.locomotion = locomotion;
    }

    /// The command under which the robot stays as it is.
    pub(crate) fn rest_command(&self, physics: &PhysicsWorld) -> RobotCommand {
        let (q_rad, _) = self.read_joints(physics);
        let pelvis_height_m = physics.bodies[self.bodies[0]].translation().z;
        let base = BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m };
        RobotCommand { upper_rad: UPPER.map(|joint| q_rad[joint]), base: self.base_limits().clamp(base) }
    }

    /// The command of the last control step.
    pub(crate) fn last_command(&self) -> RobotCommand {
        let upper_rad = std::array::from_fn(|i| self.memory.last_upper_rad[i]);
        RobotCommand { upper_rad, base: self.memory.base }
    }

    /// The base command of the last step.
    pub fn base_command(&self) -> BaseCommand {
        self.memory.base
    }

    fn read_joints(&self, physics: &PhysicsWorld) -> ([f32; JOINTS], [f32; JOINTS]) {
        let mut q_rad = [0.0; JOINTS];
        let mut qd_rad_s = [0.0; JOINTS];
        if let Some((multibody, _)) = physics.multibody_joints.get(self.joints[0]) {
            let velocity = multibody.generalized_velocity();
            for (joint, (link, dof)) in self.slots.iter().enumerate() {
                q_rad[joint] = multibody.link(*link).map_or(0.0, |link| link.joint().coords()[3]);
                qd_rad_s[joint] = velocity[*dof];
            }
        }
        (q_rad, qd_rad_s)
    }

    pub(crate) fn measure(&self, physics: &PhysicsWorld) -> WholeBody<'_> {
        let (q_rad, qd_rad_s) = self.read_joints(physics);
        WholeBody::measure(
            &self.model,
            &physics.bodies,
            &self.bodies,
            q_rad,
            qd_rad_s,
            self.memory.hand_force.force_n(),
            self.waist_target_rad(),
        )
    }

    /// Where the last control step's command took the waist.
    fn waist_target_rad(&self) -> [f32; 3] {
        std::array::from_fn(|i| self.memory.last_upper_rad[UPPER_JOINTS - 3 + i])
    }

    /// What the robot reports when its body is measured as `body`.
    pub(crate) fn state(&self, body: &WholeBody) -> RobotState {
        let pelvis_from_world = body.world_from_pelvis().inverse();
        let wrist = |side: Side| {
            let site = format!("{}_wrist", side.name());
            body.world_from_site(&site).map_or(Pose::IDENTITY, |world| pelvis_from_world * world)
        };
        RobotState {
            q_rad: body.q_rad,
            qd_rad_s: body.qd_rad_s,
            torque_n_m: std::array::from_fn(|joint| self.memory.torque_n_m[joint]),
            world_from_pelvis: body.world_from_pelvis(),
            pelvis_from_wrist: Sides::from_fn(wrist),
            pelvis_from_camera: pelvis_from_world
                * body.world_from_link[self.model.egocentric_link]
                * self.model.egocentric.body_from_camera,
            payload_n: self.memory.payload.weight_n(),
            hand_force_n: self.memory.hand_force.force_n(),
            fallen: self.memory.fallen,
        }
    }

    /// Sets this robot's joint drives for one physics step, `substep` counting from 0 within the control step.
    pub(crate) fn drive(&mut self, physics: &mut PhysicsWorld, command: &RobotCommand, substep: u32) {
        let (q_rad, qd_rad_s) = self.read_joints(physics);
        let body = WholeBody::measure(
            &self.model,
            &physics.bodies,
            &self.bodies,
            q_rad,
            qd_rad_s,
            self.memory.hand_force.force_n(),
            self.waist_target_rad(),
        );
        let legs = self.locomotion.tick(&body, &command.base, PHYSICS_DT_S);
        let waist_offset_rad = self.locomotion.waist_offset_rad();
        let gravity_n_m = body.gravity_torques_n_m();
        self.memory.hand_force.update(&body, &self.memory.torque_n_m, &gravity_n_m, PHYSICS_DT_S);
        self.memory.payload.update(&body, &self.memory.torque_n_m, &gravity_n_m, PHYSICS_DT_S);
        let payload_n_m = self.memory.payload.torques_n_m(&body);

        let mut drives = [Drive::default(); JOINTS];
        let part = (substep + 1) as f32 / PHYSICS_STEPS_PER_CONTROL as f32;
        for (i, joint) in UPPER.into_iter().enumerate() {
            let model = &self.model.joints[joint];
            let (from, to) = (self.memory.last_upper_rad[i], command.upper_rad[i]);
            drives[joint] = Drive {
                target_rad: from + (to - from) * part,
                kp_n_m_rad: model.kp_n_m_rad,
                kd_n_m_s_rad: model.kd_n_m_s_rad,
                // The damper acts on the absolute velocity, so the wanted velocity is fed forward.
                feedforward_n_m: gravity_n_m[joint]
                    + payload_n_m[joint]
                    + model.kd_n_m_s_rad * (to - from) / CONTROL_DT_S,
            };
        }
        for (drive, offset_rad) in drives[WAIST..].iter_mut().zip(waist_offset_rad) {
            drive.target_rad += offset_rad;
        }
        for (first, legs) in LEGS.into_iter().zip(legs) {
            drives[first..first + LEG_JOINTS].copy_from_slice(&legs);
        }
        let pelvis = body.world_from_pelvis();
        let upright = (pelvis.rotation * Vector::Z).z;
        self.memory.fallen |= pelvis.translation.z < FALLEN_HEIGHT_M || upright < FALLEN_TILT_COSINE;
        self.apply(physics, &drives, &q_rad, &qd_rad_s);
        self.memory.base = command.base;
        if substep + 1 == PHYSICS_STEPS_PER_CONTROL {
            self.memory.last_upper_rad.copy_from_slice(&command.upper_rad);
        }
    }

    /// PD by the joint's own spring and damper, which the mass matrix contains, so that both are implicit:
    ///   tau = kp (rest - q) - kd qd,   rest = target + feedforward / kp,   with rest clamped so that |tau| <= effort.
    fn apply(
        &mut self,
        physics: &mut PhysicsWorld,
        drives: &[Drive; JOINTS],
        q_rad: &[f32; JOINTS],
        qd_rad_s: &[f32; JOINTS],
    ) {
        let Some((multibody, _)) = physics.multibody_joints.get_mut(self.joints[0]) else { return };
        for (joint, drive) in drives.iter().enumerate() {
            let effort = self.model.joints[joint].effort_n_m;
            let (link, dof) = self.slots[joint];
            let damping = drive.kd_n_m_s_rad * qd_rad_s[joint];
            let spring = drive.kp_n_m_rad * (drive.target_rad - q_rad[joint]) + drive.feedforward_n_m;
            let torque = (spring - damping).clamp(-effort, effort);
            self.memory.torque_n_m[joint] = torque;
            multibody.damping_mut()[dof] = drive.kd_n_m_s_rad;
            if let Some(link) = multibody.link_mut(link) {
                let rest_rad = q_rad[joint] + (torque + damping) / drive.kp_n_m_rad;
                link.joint.set_spring(3, drive.kp_n_m_rad, rest_rad);
            }
        }
    }

    /// Bytes of everything outside Rapier.
    pub(crate) fn save(&self) -> Result<Vec<u8>, SimError> {
        Ok(postcard::to_stdvec(&(&self.memory, self.locomotion.save()?))?)
    }

    pub(crate) fn load(&mut self, bytes: &[u8]) -> Result<(), SimError> {
        let (memory, locomotion): (Memory, Vec<u8>) = postcard::from_bytes(bytes)?;
        self.locomotion.load(&locomotion)?;
        self.memory = memory;
        Ok(())
    }
}
