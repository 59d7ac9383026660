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
use crate::body::{BodyEstimate, BodyScale, JointDrive, LEG_JOINTS, WAIST_JOINTS};

/// What a policy asks of the base, in the robot's own heading frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseCommand {
    pub vx_m_s: f32,
    pub vy_m_s: f32,
    pub yaw_rate_rad_s: f32,
    pub pelvis_height_m: f32,
}

/// How the base goes, in its own heading frame.
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
    /// Stays where it is, with the pelvis at this height.
    pub fn standing(pelvis_height_m: f32) -> BaseCommand {
        BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m }
    }

    pub fn velocity(&self) -> BaseVelocity {
        BaseVelocity { vx_m_s: self.vx_m_s, vy_m_s: self.vy_m_s, yaw_rate_rad_s: self.yaw_rate_rad_s }
    }
}

/// Smallest and largest value that a controller can follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseLimits {
    pub vx_m_s: [f32; 2],
    pub vy_m_s: [f32; 2],
    pub yaw_rate_rad_s: [f32; 2],
    pub pelvis_height_m: [f32; 2],
}

impl BaseLimits {
    /// The nearest command within the limits.
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

/// A base controller. It sees its own robot only, and acts through joint drives of legs and waist only.
pub trait Locomotion: Send {
    /// Of a robot of this size.
    fn limits(&self, scale: &BodyScale) -> BaseLimits;

    /// One physics step.
    fn tick(&mut self, body: &BodyEstimate, command: &BaseCommand, dt_s: f32) -> LegCommand;

    /// What is added to the task's waist targets (yaw, roll, pitch) until the next [`Locomotion::tick`], by a controller
    /// that balances with the waist.
    fn waist_offset_rad(&self) -> [f32; WAIST_JOINTS] {
        [0.0; WAIST_JOINTS]
    }

    /// Whether it is stepping rather than standing; `None` where it does not tell the two apart.
    fn is_stepping(&self) -> Option<bool> {
        None
    }

    /// Internal state, for snapshots and the state hash.
    fn save(&self) -> Result<Vec<u8>, postcard::Error>;

    /// Takes back what [`Locomotion::save`] gave.
    fn load(&mut self, state: &[u8]) -> Result<(), postcard::Error>;
}
