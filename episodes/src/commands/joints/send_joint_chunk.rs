//! `send_joint_chunk`: one row of joint targets and base command for each control step.

use tandem_sim::{BaseCommand, UPPER_JOINTS};
use tandem_tools_spec::JointChunk;

use crate::commands::columns::{self, Clamped};
use crate::commands::motion::{Compliance, Motion};

/// Trajectory with one row for each control step.
pub struct JointTrajectory {
    rows: Vec<JointRow>,
}

/// Joint targets and base command of one control step.
struct JointRow {
    upper_rad: [f64; UPPER_JOINTS],
    base: BaseCommand,
}

impl JointTrajectory {
    /// Starts the rows of `chunk` on `motion`.
    pub fn begin(chunk: &JointChunk, motion: &mut Motion, clamped: &mut Clamped) -> JointTrajectory {
        let row = |row: &Vec<f64>| {
            let upper_rad =
                std::array::from_fn(|column| clamped.joint(&motion.robot.model, column, row[column]));
            let asked = columns::base_command(std::array::from_fn(|i| row[UPPER_JOINTS + i] as f32));
            JointRow { upper_rad, base: clamped.base(&motion.robot.base_limits, asked) }
        };
        let rows = chunk.rows.iter().map(row).collect();
        motion.keep_joints();
        JointTrajectory { rows }
    }

    /// Makes control step `step`, counted from 1.
    pub fn advance(&self, step: u32, motion: &mut Motion) {
        let row = &self.rows[step as usize - 1];
        motion.advance_yielding(Compliance::NONE);
        motion.walk(row.base);
        motion.set_joints(row.upper_rad);
    }
}
