//! Base control: turns a base command into torques of the twelve leg joints, through ground contact alone.

#[cfg(feature = "onnx")]
mod agile;
mod balance;
mod choice;

#[cfg(feature = "onnx")]
pub use agile::{Agile, Network};
pub use balance::Balance;
pub use choice::LocomotionChoice;

use serde::{Deserialize, Serialize};

use crate::Sides;
use crate::body::{
    BodyEstimate, BodyScale, JointDrive, LEG_JOINTS, MotorSetpoints, UPPER_JOINTS, WAIST_JOINTS,
};

/// Setpoint of a policy for the base, in the robot's own heading frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseCommand {
    pub vx_m_s: f32,
    pub vy_m_s: f32,
    pub yaw_rate_rad_s: f32,
    pub pelvis_height_m: f32,
}

/// Velocity of the base, in its own heading frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BaseVelocity {
    pub vx_m_s: f32,
    pub vy_m_s: f32,
    pub yaw_rate_rad_s: f32,
}

impl BaseVelocity {
    pub const STILL: BaseVelocity = BaseVelocity { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0 };
}

impl BaseCommand {
    /// Creates a command to stay in place, with the pelvis at this height.
    pub fn standing(pelvis_height_m: f32) -> BaseCommand {
        BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m }
    }

    pub fn velocity(&self) -> BaseVelocity {
        BaseVelocity { vx_m_s: self.vx_m_s, vy_m_s: self.vy_m_s, yaw_rate_rad_s: self.yaw_rate_rad_s }
    }
}

/// Smallest and largest values that a controller can follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseLimits {
    pub vx_m_s: [f32; 2],
    pub vy_m_s: [f32; 2],
    pub yaw_rate_rad_s: [f32; 2],
    pub pelvis_height_m: [f32; 2],
}

impl BaseLimits {
    /// Returns the nearest command within the limits.
    pub fn clamp(&self, command: BaseCommand) -> BaseCommand {
        let within = |value: f32, [low, high]: [f32; 2]| value.clamp(low, high);
        BaseCommand {
            vx_m_s: within(command.vx_m_s, self.vx_m_s),
            vy_m_s: within(command.vy_m_s, self.vy_m_s),
            yaw_rate_rad_s: within(command.yaw_rate_rad_s, self.yaw_rate_rad_s),
            pelvis_height_m: within(command.pelvis_height_m, self.pelvis_height_m),
        }
    }
}

/// Drives of both legs, from the hip to the ankle.
pub type LegCommand = Sides<[JointDrive; LEG_JOINTS]>;

/// A controller of all motors of a robot, without a base controller; see [`crate::World::drive_motors`].
pub trait MotorController {
    /// Returns the setpoints of the next control step. `upper_rad` are the targets of the joints above the
    /// hips, in action order.
    fn act(
        &mut self,
        body: &BodyEstimate,
        upper_rad: &[f32; UPPER_JOINTS],
        base: &BaseCommand,
    ) -> MotorSetpoints;
}

/// A base controller. It observes only its own robot, and acts only through the joint drives of legs and
/// waist.
pub trait Locomotion: Send {
    /// Returns the limits for a robot of this size.
    fn limits(&self, scale: &BodyScale) -> BaseLimits;

    /// Runs one physics step.
    fn tick(&mut self, body: &BodyEstimate, command: &BaseCommand, dt_s: f32) -> LegCommand;

    /// Returns the offset on the task's waist targets (yaw, roll, pitch) until the next
    /// [`Locomotion::tick`], for a controller that balances with the waist.
    fn waist_offset_rad(&self) -> [f32; WAIST_JOINTS] {
        [0.0; WAIST_JOINTS]
    }

    /// Returns true if the robot is stepping rather than standing. Returns `None` if the controller does
    /// not distinguish the two.
    fn is_stepping(&self) -> Option<bool> {
        None
    }

    /// Resets all state, for a robot with joints that others drive. The next [`Locomotion::tick`] starts from
    /// the robot's posture at that time.
    fn let_go(&mut self);

    /// Serialises the internal state, for snapshots and the state hash.
    fn save(&self) -> Result<Vec<u8>, postcard::Error>;

    /// Restores a state from [`Locomotion::save`].
    fn load(&mut self, state: &[u8]) -> Result<(), postcard::Error>;
}
