//! `send_joint_drives`: setpoints of every motor, for programs that balance the robot themselves.
//! `episodes/src/commands/joints/send_joint_drives.rs` carries it out.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::checks;
use crate::limits;
use crate::parts::CommandReply;
use crate::tool::Tool;

/// The blocks of a row of setpoints, in order. Each has one number for each joint.
pub const DRIVE_BLOCKS: [&str; 5] =
    ["position_rad", "velocity_rad_s", "kp_n_m_rad", "kd_n_m_s_rad", "torque_n_m"];
/// Number of values in a block: the 43 joints, in the order of `get_robot_state`.
const DRIVE_JOINTS: usize = 43;
/// Number of values in a row of setpoints.
pub const DRIVE_ROW_LEN: usize = DRIVE_BLOCKS.len() * DRIVE_JOINTS;
/// Physics steps of 5 ms in a control step.
const PHYSICS_STEPS: usize = 4;

/// Drive every joint yourself, legs included, one row per control step of 20 ms: a motor exerts
/// torque_n_m + kp (position - q) + kd (velocity - q'), within its limits. The robot's balance controller,
/// the compensation of gravity and the simulator's gains are off, and a robot that does not balance falls.
/// Afterwards the last row stays in force until the robot's next command; every other command but wait hands
/// the robot back to the balance controller, from the posture in which it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SendJointDrives {
    /// One entry per robot that is driven. Each needs the same number of rows; other robots hold still.
    #[schemars(
        length(min = 1, max = limits::ROBOT_NAMES.len()),
        extend("not" = limits::a_robot_twice(), "most_steps" = "equal_rows")
    )]
    pub robots: Vec<JointDrives>,
}

/// One robot's rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointDrives {
    /// The robot, for example "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Rows of 215 numbers: position_rad 43, velocity_rad_s 43, kp_n_m_rad 43, kd_n_m_s_rad 43, torque_n_m
    /// 43, each in the joints' order of get_robot_state. Or of 860: four of these, one after another, for
    /// the physics steps of 5 ms.
    #[schemars(schema_with = "rows_schema")]
    pub rows: Vec<Vec<f64>>,
}

fn rows_schema(_: &mut SchemaGenerator) -> Schema {
    let length = |count: usize| json!({ "minItems": count, "maxItems": count });
    let row = json!({
        "type": "array",
        "items": { "type": "number", "format": "double" },
        "anyOf": [length(DRIVE_ROW_LEN), length(PHYSICS_STEPS * DRIVE_ROW_LEN)],
    });
    let rows = json!({ "type": "array", "items": row, "minItems": 1, "most_steps": "maxItems" });
    rows.try_into().expect("an object is a schema")
}

impl JointDrives {
    fn validate(&self) -> Result<(), String> {
        for (index, row) in self.rows.iter().enumerate() {
            if ![DRIVE_ROW_LEN, PHYSICS_STEPS * DRIVE_ROW_LEN].contains(&row.len()) {
                return Err(format!(
                    "row {index} holds {} numbers; give {DRIVE_ROW_LEN}: {}, or {} for a row per physics step",
                    row.len(),
                    DRIVE_BLOCKS.map(|block| format!("{block} {DRIVE_JOINTS}")).join(", "),
                    PHYSICS_STEPS * DRIVE_ROW_LEN
                ));
            }
            checks::finite(&format!("row {index}"), row)?;
            let gains = row.chunks_exact(DRIVE_ROW_LEN).map(|row| &row[2 * DRIVE_JOINTS..4 * DRIVE_JOINTS]);
            if let Some(gain) = gains.flatten().find(|gain| **gain < 0.0) {
                return Err(format!("row {index} has the gain {gain}; kp and kd must not be negative"));
            }
        }
        Ok(())
    }
}

impl Tool for SendJointDrives {
    type Reply = CommandReply;
    const NAME: &'static str = "send_joint_drives";
    const READ_ONLY: bool = false;
    const FOR_PROGRAMS: bool = true;

    fn example() -> Self {
        let blocks = [0.0, 0.0, 40.0, 1.0, 0.0];
        let row = blocks.into_iter().flat_map(|value| [value; DRIVE_JOINTS]).collect();
        SendJointDrives { robots: vec![JointDrives { robot: "A".into(), rows: vec![row] }] }
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
        checks::each(&self.robots, |entry| &entry.robot, JointDrives::validate)?;
        checks::equal_rows(self.robots.iter().map(|entry| (entry.robot.as_str(), &entry.rows)))
    }
}
