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
    /// Setpoints at which every motor's effort is 0.
    pub const LIMP: MotorSetpoints = MotorSetpoints {
        q_rad: [0.0; JOINTS],
        qd_rad_s: [0.0; JOINTS],
        kp_n_m_rad: [0.0; JOINTS],
        kd_n_m_s_rad: [0.0; JOINTS],
        torque_n_m: [0.0; JOINTS],
    };

    /// Returns the drives for physics steps of `dt_s`.
    ///
    /// A drive's spring is implicit in the step, which adds damping equal to `dt kp`. For a knee with 300 N
    /// m/rad and 4 N m s/rad, this is 40 % of `kd`. A policy tuned on other gains would notice, so this
    /// damping is subtracted from `kd`, which makes the spring explicit. An explicit spring is stable for
    /// `dt^2 kp < 4 I`, and a joint's inertia I is at least its armature. So at most `armature / dt` is
    /// subtracted. Springs stiffer than `armature / dt^2` keep the rest.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PHYSICS_DT_S;
    use crate::body::posed::model;

    /// Returns the amplitude ratio of successive swings of  I q'' + kd q' + kp q = 0  with `drive` in the
    /// simulator's step.
    fn decay(drive: &JointDrive, inertia_kg_m2: f32, swings: u32) -> f32 {
        let (mut q_rad, mut v_rad_s, mut turned, mut peak_rad) = (0.1f32, 0.0f32, 0, 0.1f32);
        while turned < 2 * swings {
            let before_rad_s = v_rad_s;
            let implicit = PHYSICS_DT_S * (drive.kd_n_m_s_rad + PHYSICS_DT_S * drive.kp_n_m_rad);
            v_rad_s = (inertia_kg_m2 * v_rad_s - PHYSICS_DT_S * drive.kp_n_m_rad * q_rad)
                / (inertia_kg_m2 + implicit);
            q_rad += PHYSICS_DT_S * v_rad_s;
            if before_rad_s * v_rad_s < 0.0 {
                (turned, peak_rad) = (turned + 1, q_rad.abs());
            }
        }
        (peak_rad / 0.1).powf(1.0 / swings as f32)
    }

    /// Gains that LeRobot sends to a knee: the exact ratio is  exp(-2 pi zeta / sqrt(1 - zeta^2)).
    #[test]
    fn a_knee_is_damped_as_its_gains_say() {
        let (kp, kd, inertia_kg_m2) = (300.0f32, 4.0f32, 0.5f32);
        let knee = model().joints.iter().position(|joint| joint.name == "left_knee_joint").unwrap();
        let mut setpoints = MotorSetpoints::LIMP;
        (setpoints.kp_n_m_rad[knee], setpoints.kd_n_m_s_rad[knee]) = (kp, kd);
        let ours = setpoints.drives(&model().joints, PHYSICS_DT_S)[knee];
        let implicit = JointDrive { kd_n_m_s_rad: kd, ..ours };
        let zeta = kd / (2.0 * (kp * inertia_kg_m2).sqrt());
        let exact = (-std::f32::consts::TAU * zeta / (1.0 - zeta * zeta).sqrt()).exp();
        let off = |drive: &JointDrive| (decay(drive, inertia_kg_m2, 2).ln() / exact.ln() - 1.0).abs();
        assert!(off(&ours) < 0.05, "{} of {exact}", decay(&ours, inertia_kg_m2, 2));
        assert!(off(&implicit) > 0.25, "an implicit spring damps more");
    }

    /// Springs too stiff for the explicit form stay stable.
    #[test]
    fn a_stiff_spring_of_a_light_finger_does_not_oscillate() {
        let finger = model().joints.iter().position(|joint| joint.name == "left_hand_index_1_joint").unwrap();
        let joint = &model().joints[finger];
        let mut setpoints = MotorSetpoints::LIMP;
        setpoints.kp_n_m_rad[finger] = 500.0;
        let drive = setpoints.drives(&model().joints, PHYSICS_DT_S)[finger];
        let (mut q_rad, mut v_rad_s) = (0.1f32, 0.0f32);
        for _ in 0..200 {
            let implicit = PHYSICS_DT_S * (drive.kd_n_m_s_rad + PHYSICS_DT_S * drive.kp_n_m_rad);
            v_rad_s = (joint.armature_kg_m2 * v_rad_s - PHYSICS_DT_S * drive.kp_n_m_rad * q_rad)
                / (joint.armature_kg_m2 + implicit);
            q_rad += PHYSICS_DT_S * v_rad_s;
            assert!(q_rad.abs() <= 0.1, "{q_rad}");
        }
        assert!(q_rad.abs() < 0.01, "it comes to rest: {q_rad}");
    }
}
