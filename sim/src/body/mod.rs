//! Data of a robot that a controller may use: its model, the order of its joints, kinematics and inverse
//! dynamics. This module has no physics world. The code that senses a robot creates a [`BodyEstimate`].

mod estimate;
mod inverse_dynamics;
pub(crate) mod joint_array;
mod layout;
mod model;
mod motors;
#[cfg(test)]
pub(crate) mod posed;
#[cfg(test)]
mod tests;

pub use estimate::BodyEstimate;
pub use inverse_dynamics::{Acceleration, Effort};
pub use layout::{
    ARM_COLUMNS, ARM_JOINTS, ARMS, HAND_COLUMNS, HAND_JOINTS, JOINTS, LEGS, MIRRORED_ARM, UPPER,
    UPPER_JOINTS, WAIST_COLUMN, WAIST_JOINTS, joint_names,
};
pub use model::{
    BodyScale, HandLinks, JointModel, LinkModel, RobotDraft, RobotModel, RobotSource, SiteModel,
};
pub use motors::MotorSetpoints;

pub(crate) use estimate::{KnownOfBody, LinkMotion, PelvisMotion};
pub(crate) use layout::{HANDS, LEG_JOINTS, WAIST};

/// Spring, damper and feedforward of one joint for one physics step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointDrive {
    pub target_rad: f32,
    pub kp_n_m_rad: f32,
    pub kd_n_m_s_rad: f32,
    pub feedforward_n_m: f32,
}
