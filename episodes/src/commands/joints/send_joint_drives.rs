//! `send_joint_drives`: setpoints of every motor for each control step. They replace the base controller and
//! the simulator's drives.

use tandem_sim::{JOINTS, MotorSetpoints};
use tandem_tools_spec::{DRIVE_ROW_LEN, JointDrives};

use crate::commands::motion::Motion;

/// Trajectory with the setpoints of each control step: one, or one for each physics step.
pub struct DriveTrajectory {
    steps: Vec<Vec<MotorSetpoints>>,
}

impl DriveTrajectory {
    /// Starts the rows of `drives`.
    pub fn begin(drives: &JointDrives) -> DriveTrajectory {
        let of_step = |row: &Vec<f64>| row.chunks_exact(DRIVE_ROW_LEN).map(setpoints).collect();
        DriveTrajectory { steps: drives.rows.iter().map(of_step).collect() }
    }

    /// Makes control step `step`, counted from 1.
    pub fn advance(&self, step: u32, motion: &mut Motion) {
        motion.drive(&self.steps[step as usize - 1]);
    }
}

/// Reads a row of setpoints.
fn setpoints(row: &[f64]) -> MotorSetpoints {
    let block = |index: usize| std::array::from_fn(|joint| row[index * JOINTS + joint] as f32);
    MotorSetpoints {
        q_rad: block(0),
        qd_rad_s: block(1),
        kp_n_m_rad: block(2),
        kd_n_m_s_rad: block(3),
        torque_n_m: block(4),
    }
}

/// Returns setpoints as a row, which [`setpoints`] reads.
pub fn drive_row(setpoints: &MotorSetpoints) -> impl Iterator<Item = f32> {
    let MotorSetpoints { q_rad, qd_rad_s, kp_n_m_rad, kd_n_m_s_rad, torque_n_m } = setpoints;
    [q_rad, qd_rad_s, kp_n_m_rad, kd_n_m_s_rad, torque_n_m].into_iter().flatten().copied()
}
