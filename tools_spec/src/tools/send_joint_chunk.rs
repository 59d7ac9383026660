//! `send_joint_chunk`: the command of learned policies, one row of joint targets per control step.
//! `episodes/src/commands/joints/send_joint_chunk.rs` carries it out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::parts::{BASE_COLUMNS, CommandReply};
use crate::tool::Tool;

/// Number of values in a row: 31 joint targets and the base command.
pub const ACTION_ROW_LEN: usize = 35;

/// The blocks of joints at the beginning of a row, in order, with their numbers of columns. Within a hand:
/// thumb_0, thumb_1, thumb_2, middle_0, middle_1, index_0, index_1.
const JOINT_BLOCKS: [(&str, usize); 5] =
    [("left_arm", 7), ("right_arm", 7), ("left_hand", 7), ("right_hand", 7), ("waist", 3)];

/// Returns the layout of a row in one line, for example `left_arm 7, right_arm 7, ...`.
pub fn action_row_layout() -> String {
    let blocks = JOINT_BLOCKS.into_iter().chain(BASE_COLUMNS.map(|column| (column, 1)));
    blocks.map(|(block, columns)| format!("{block} {columns}")).collect::<Vec<_>>().join(", ")
}

/// Send joint targets, one row per control step of 20 ms. Rows of all named robots run side by side, so
/// each needs the same number: 1 up to the budget's steps_per_command. Other robots hold still. Targets
/// beyond joint limits are clamped and reported.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SendJointChunk {
    /// One entry per robot that moves.
    #[schemars(
        length(min = 1, max = limits::ROBOT_NAMES.len()),
        extend("not" = limits::a_robot_twice(), "most_steps" = "equal_rows")
    )]
    pub robots: Vec<JointChunk>,
}

/// One robot's rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointChunk {
    /// The robot, for example "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Rows of 35 numbers: joint targets in radians for left_arm 7, right_arm 7, left_hand 7, right_hand 7,
    /// waist 3, then vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m.
    #[schemars(length(min = 1), inner(length(equal = ACTION_ROW_LEN)), extend("most_steps" = "maxItems"))]
    pub rows: Vec<Vec<f64>>,
}

impl JointChunk {
    fn validate(&self) -> Result<(), String> {
        for (index, row) in self.rows.iter().enumerate() {
            if row.len() != ACTION_ROW_LEN {
                return Err(format!(
                    "row {index} holds {} numbers; give {ACTION_ROW_LEN}: {}",
                    row.len(),
                    action_row_layout()
                ));
            }
            checks::finite(&format!("row {index}"), row)?;
        }
        Ok(())
    }
}

impl Tool for SendJointChunk {
    type Reply = CommandReply;
    const NAME: &'static str = "send_joint_chunk";
    const READ_ONLY: bool = false;

    fn example() -> Self {
        let mut row = vec![0.0; ACTION_ROW_LEN];
        row[ACTION_ROW_LEN - 1] = 0.75;
        SendJointChunk { robots: vec![JointChunk { robot: "A".into(), rows: vec![row] }] }
    }

    fn robots(&self) -> Vec<&str> {
        self.robots.iter().map(|entry| entry.robot.as_str()).collect()
    }

    /// Returns one step per row. All robots have the same number of rows.
    fn steps(&self) -> u32 {
        checks::row_steps(self.robots.first().map(|entry| &entry.rows))
    }

    fn validate(&self) -> Result<(), String> {
        checks::robots(&self.robots())?;
        checks::each(&self.robots, |entry| &entry.robot, JointChunk::validate)?;
        checks::equal_rows(self.robots.iter().map(|entry| (entry.robot.as_str(), &entry.rows)))
    }
}
