//! How one joint is driven.

/// Spring, damper and feedforward of one joint for one physics step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointDrive {
    pub target_rad: f32,
    pub kp_n_m_rad: f32,
    pub kd_n_m_s_rad: f32,
    pub feedforward_n_m: f32,
}
