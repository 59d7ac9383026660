//! Setpoints of a robot's motors, for controllers that drive every joint themselves.

use serde::{Deserialize, Serialize};

use super::{JOINTS, JointDrive, JointModel, joint_array};

/// Setpoints of all motors, in published order, as a G1's motor controllers take them. Within its limits of
/// effort and speed, each motor exerts
///   tau + kp (q* - q) + kd (q'* - q').
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotorSetpoints {
    #[serde(with = "joint_array")]
    pub q_rad: [f32; JOINTS],
    #[serde(with = "joint_array")]
    pub qd_rad_s: [f32; JOINTS],
    #[serde(with = "joint_array")]
    pub kp_n_m_rad: [f32; JOINTS],
    #[serde(with = "joint_array")]
    pub kd_n_m_s_rad: [f32; JOINTS],
    #[serde(with = "joint_array")]
    pub torque_n_m: [f32; JOINTS],
}

impl MotorSetpoints {
    /// Setpoints under which no motor exerts anything.
    pub const LIMP: MotorSetpoints = MotorSetpoints {
        q_rad: [0.0; JOINTS],
        qd_rad_s: [0.0; JOINTS],
        kp_n_m_rad: [0.0; JOINTS],
        kd_n_m_s_rad: [0.0; JOINTS],
        torque_n_m: [0.0; JOINTS],
    };

    /// Returns the drives for physics steps of `dt_s`.
    ///
    /// A drive's spring is implicit in the step, which damps as `dt kp` more of `kd` would: 40 % more at a
    /// knee of 300 N m/rad and 4 N m s/rad. A policy tuned on other gains feels that, so this damping is
    /// taken off `kd`, which makes the spring explicit. An explicit spring is stable for `dt^2 kp < 4 I`,
    /// and a joint's inertia I is at least its armature. So at most `armature / dt` is taken off, and
    /// springs that are stiffer than `armature / dt^2` keep the rest.
    pub(crate) fn drives(&self, joints: &[JointModel], dt_s: f32) -> [JointDrive; JOINTS] {
        std::array::from_fn(|joint| {
            let (kp_n_m_rad, kd_n_m_s_rad) = (self.kp_n_m_rad[joint], self.kd_n_m_s_rad[joint]);
            let added_n_m_s_rad = (dt_s * kp_n_m_rad).min(joints[joint].armature_kg_m2 / dt_s);
            JointDrive {
                target_rad: self.q_rad[joint],
                kp_n_m_rad,
                kd_n_m_s_rad: kd_n_m_s_rad - added_n_m_s_rad,
                feedforward_n_m: self.torque_n_m[joint] + kd_n_m_s_rad * self.qd_rad_s[joint],
            }
        })
    }
}
