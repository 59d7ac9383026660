//! A base controller trained elsewhere: a velocity policy as an ONNX file, of the kind that AGILE
//! exports for the G1.
//!
//! The policy normally receives the commands unchanged. With the position loop (`place`) it instead receives
//! the velocity that keeps the robot at the place to which the commands would have moved it. The loop uses
//! the robot's own estimate of its pose.
//!
//! The policy runs once per control step and drives the legs by PD targets with its own gains. It also
//! balances with the roll and pitch of the waist, which belong to the task here. Therefore the policy
//! observes these joints minus the task's targets, as if the task had commanded an upright waist. Its targets
//! for them are added to the task's targets.

mod joints;
mod motors;
mod network;
mod place;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

pub(super) use motors::MotorPolicy;
pub use network::Network;

use super::{BaseCommand, BaseLimits, LegCommand, Locomotion};
use crate::PHYSICS_STEPS_PER_CONTROL;
use crate::body::{BodyEstimate, BodyScale, JOINTS, JointDrive, LEGS, RobotModel, WAIST};
use joints::JointMap;
use network::{Action, NetworkInputs, RecurrentState};
use place::ReferencePlace;

const LIMITS: BaseLimits = BaseLimits {
    vx_m_s: [-0.3, 0.4],
    vy_m_s: [-0.3, 0.3],
    yaw_rate_rad_s: [-0.5, 0.5],
    // The policy has no height command; it stands and walks here.
    pelvis_height_m: [0.73, 0.73],
};
/// Total downward pull on the hands (N) that suspends the position loop. A robot with such a load leans, and
/// would walk forever towards its reference place.
const HEAVY_N: f32 = 50.0;

/// The controller of one robot under a policy.
pub struct Agile {
    network: Arc<Network>,
    joints: JointMap,
    looped: bool,
    state: Option<AgileState>,
}

#[derive(Clone, Serialize, Deserialize)]
struct AgileState {
    memory: RecurrentState,
    action: Action,
    place: ReferencePlace,
    /// Number of physics steps so far.
    ticks: u32,
}

impl Agile {
    /// Creates a controller; `looped` adds the position loop.
    pub fn new(network: Arc<Network>, looped: bool) -> Agile {
        Agile { network, joints: JointMap::new(), looped, state: None }
    }

    /// Checks that a robot has all joints that the policy observes.
    pub(super) fn check_robot(model: &RobotModel) -> Result<(), String> {
        let joints = JointMap::new().observed.map(|joint| &model.joints[joint]);
        let lacking: Vec<&str> =
            joints.iter().filter(|joint| !joint.exists()).map(|joint| joint.name.as_str()).collect();
        match lacking.is_empty() {
            true => Ok(()),
            false => Err(format!(
                "a velocity policy for the G1 is told of joints that this robot lacks: {}; leave out --locomotion, and our own controller moves it",
                lacking.join(", ")
            )),
        }
    }

    fn observe(&self, body: &BodyEstimate, velocity_command: [f32; 3]) -> NetworkInputs {
        observe(body, &less_waist_targets(body), velocity_command, &self.joints)
    }

    /// Creates a state that holds the present posture until the policy has run.
    fn begin(&self, body: &BodyEstimate) -> AgileState {
        let q_rad = less_waist_targets(body);
        let joints = &body.model.joints;
        let observation = self.observe(body, [0.0; 3]);
        AgileState {
            memory: self.network.remember(&observation).unwrap_or_else(|_| self.network.blank()),
            action: Action {
                target_rad: self.joints.controlled.map(|joint| q_rad[joint]),
                kp_n_m_rad: self.joints.controlled.map(|joint| joints[joint].kp_n_m_rad),
                kd_n_m_s_rad: self.joints.controlled.map(|joint| joints[joint].kd_n_m_s_rad),
            },
            place: ReferencePlace::of(body.world_from_pelvis()),
            ticks: 0,
        }
    }

    fn legs(&self, action: &Action) -> LegCommand {
        let mut drives = [JointDrive::default(); JOINTS];
        for (i, joint) in self.joints.controlled.into_iter().enumerate() {
            drives[joint] = JointDrive {
                target_rad: action.target_rad[i],
                kp_n_m_rad: action.kp_n_m_rad[i],
                kd_n_m_s_rad: action.kd_n_m_s_rad[i],
                feedforward_n_m: 0.0,
            };
        }
        LEGS.map(|first| std::array::from_fn(|i| drives[first + i]))
    }
}

impl Locomotion for Agile {
    fn limits(&self, _scale: &BodyScale) -> BaseLimits {
        LIMITS
    }

    fn tick(&mut self, body: &BodyEstimate, command: &BaseCommand, dt_s: f32) -> LegCommand {
        let mut state = self.state.take().unwrap_or_else(|| self.begin(body));
        if state.ticks.is_multiple_of(PHYSICS_STEPS_PER_CONTROL) {
            let command = LIMITS.clamp(*command);
            let mut velocity = [command.vx_m_s, command.vy_m_s, command.yaw_rate_rad_s];
            if self.looped {
                velocity =
                    keep_place(&mut state.place, body, velocity, dt_s * PHYSICS_STEPS_PER_CONTROL as f32);
            }
            // A network that ran when it was loaded will run again. If it ever fails, the last targets
            // hold the robot.
            if let Ok((action, memory)) = self.network.run(&self.observe(body, velocity), &state.memory)
                && action.usable()
            {
                (state.action, state.memory) = (action, memory);
            }
        }
        state.ticks += 1;
        let legs = self.legs(&state.action);
        self.state = Some(state);
        legs
    }

    fn waist_offset_rad(&self) -> [f32; 3] {
        let mut offset_rad = [0.0; 3];
        if let Some(state) = &self.state {
            for (joint, target_rad) in self.joints.controlled.into_iter().zip(state.action.target_rad) {
                if let Some(offset_rad) = joint.checked_sub(WAIST).and_then(|i| offset_rad.get_mut(i)) {
                    *offset_rad = target_rad;
                }
            }
        }
        offset_rad
    }

    fn let_go(&mut self) {
        self.state = None;
    }

    fn save(&self) -> Result<Vec<u8>, postcard::Error> {
        postcard::to_stdvec(&self.state)
    }

    fn load(&mut self, state: &[u8]) -> Result<(), postcard::Error> {
        self.state = postcard::from_bytes(state)?;
        Ok(())
    }
}

/// Returns the network's observation of a robot whose joints are at `q_rad`.
fn observe(
    body: &BodyEstimate,
    q_rad: &[f32; JOINTS],
    velocity_command: [f32; 3],
    joints: &JointMap,
) -> NetworkInputs {
    let pelvis = body.world_from_pelvis().rotation;
    let turning = pelvis.inverse() * body.pelvis_angular_velocity_rad_s;
    NetworkInputs {
        quaternion_wxyz: [pelvis.w, pelvis.x, pelvis.y, pelvis.z],
        angular_velocity_rad_s: turning.to_array(),
        velocity_command,
        q_rad: joints.observed.map(|joint| q_rad[joint]),
        qd_rad_s: joints.observed.map(|joint| body.qd_rad_s[joint]),
    }
}

/// Returns the velocity command with which the policy keeps up with the commands.
fn keep_place(place: &mut ReferencePlace, body: &BodyEstimate, command: [f32; 3], dt_s: f32) -> [f32; 3] {
    let pelvis = body.world_from_pelvis();
    let pulled_down_n: f32 = body.hand_reaction_n.into_iter().map(|force| -force.z).sum();
    if pulled_down_n > HEAVY_N {
        *place = ReferencePlace::of(pelvis);
        return command;
    }
    place.follow(pelvis, command, dt_s)
}

/// Returns the joint angles minus the task's waist targets, as if the task had commanded an upright waist.
fn less_waist_targets(body: &BodyEstimate) -> [f32; JOINTS] {
    let mut q_rad = body.q_rad;
    for (i, target_rad) in body.waist_target_rad.into_iter().enumerate() {
        q_rad[WAIST + i] -= target_rad;
    }
    q_rad
}
