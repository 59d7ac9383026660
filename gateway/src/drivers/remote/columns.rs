//! Names of columns: of the numbers that a robot senses, and of those that command it.

use std::ops::Range;

use tandem_episodes::joint_names;
use tandem_tools_spec::{ACTION_ROW_LEN, BASE_COLUMNS, RobotState};

/// Some columns by one name.
type Block = (&'static str, Range<usize>);

/// Blocks of a robot's numbers, in the order of [`state_values`].
const STATE: [Block; 12] = [
    ("left_leg", 0..6),
    ("right_leg", 6..12),
    ("waist", 12..15),
    ("left_arm", 15..22),
    ("left_hand", 22..29),
    ("right_arm", 29..36),
    ("right_hand", 36..43),
    ("joints", 0..JOINTS),
    ("left_wrist", 43..50),
    ("right_wrist", 50..57),
    ("gravity", 57..60),
    ("base_command", STATE_BASE..STATE_LEN),
];
const JOINTS: usize = 43;
/// The base command comes last.
const STATE_BASE: usize = 60;
const STATE_LEN: usize = 64;

/// Blocks of an action row, in the order of `send_joint_chunk`.
const ACTION: [Block; 7] = [
    ("left_arm", 0..7),
    ("right_arm", 7..14),
    ("left_hand", 14..21),
    ("right_hand", 21..28),
    ("waist", 28..31),
    ("base_command", ACTION_BASE..ACTION_ROW_LEN),
    ("row", 0..ACTION_ROW_LEN),
];
const ACTION_BASE: usize = 31;

/// All that a robot senses: joints in rad; of each wrist x, y, z in m and w, x, y, z in the pelvis frame; which way is down; the
/// base command in force, as [`BASE_COLUMNS`] has it.
pub fn state_values(state: &RobotState) -> Vec<f64> {
    let joints = state.joint_positions_rad.0.iter().map(|(_, angle_rad)| *angle_rad);
    let wrists = [&state.left_wrist, &state.right_wrist];
    let wrists = wrists.into_iter().flat_map(|pose| pose.position_m.into_iter().chain(pose.quaternion_wxyz));
    let base = &state.base_command;
    let base = [base.vx_m_s, base.vy_m_s, base.yaw_rate_rad_s, base.pelvis_height_m];
    joints.chain(wrists).chain(state.gravity_in_pelvis).chain(base).collect()
}

/// Numbers of the right length for [`state_values`], of a robot of which nothing is known.
pub fn blank_state_values() -> Vec<f64> {
    vec![0.0; STATE_LEN]
}

/// The row that keeps a robot as it senses that it is: arms, hands, waist and height where they are, no walking.
pub fn held_row(state_values: &[f64]) -> Vec<f64> {
    let mut row = vec![0.0; ACTION_ROW_LEN];
    for (name, columns) in &ACTION {
        if let Some((_, sensed)) = STATE.iter().find(|(known, _)| known == name) {
            row[columns.clone()].copy_from_slice(&state_values[sensed.clone()]);
        }
    }
    // The height is all that persists of a base command.
    row[ACTION_BASE..ACTION_ROW_LEN - 1].fill(0.0);
    row
}

/// Which of [`state_values`] the `names` mean, in their order.
pub fn state_columns(names: &[String]) -> Result<Vec<usize>, String> {
    columns(names, &STATE, &state_singles())
}

/// Which columns of an action row the `names` mean, in their order.
pub fn action_columns(names: &[String]) -> Result<Vec<usize>, String> {
    let columns = columns(names, &ACTION, &action_singles())?;
    match (0..columns.len()).find(|index| columns[..*index].contains(&columns[*index])) {
        None => Ok(columns),
        Some(index) => Err(format!("{:?} is told twice", action_name(columns[index]))),
    }
}

/// What column number `column` of an action row is called.
pub fn action_name(column: usize) -> String {
    let singles = action_singles();
    singles.into_iter().find(|(_, at)| *at == column).map(|(name, _)| name).unwrap_or_default()
}

fn columns(names: &[String], blocks: &[Block], singles: &[(String, usize)]) -> Result<Vec<usize>, String> {
    let mut found = Vec::new();
    for name in names {
        let block = blocks.iter().find(|(known, _)| known == name).map(|(_, columns)| columns.clone());
        let single = singles.iter().find(|(known, _)| known == name).map(|(_, column)| *column..*column + 1);
        found.extend(block.or(single).ok_or_else(|| {
            let have: Vec<&str> = blocks.iter().map(|(name, _)| *name).collect();
            format!("no column {name:?}; have: {}, and joints and base columns by name", have.join(", "))
        })?);
    }
    Ok(found)
}

fn state_singles() -> Vec<(String, usize)> {
    let base = BASE_COLUMNS.map(String::from).into_iter().zip(STATE_BASE..);
    joint_names().into_iter().zip(0..).chain(base).collect()
}

fn action_singles() -> Vec<(String, usize)> {
    let base = BASE_COLUMNS.map(String::from).into_iter().zip(ACTION_BASE..);
    let joints = joint_names().into_iter().enumerate();
    let upper = joints.filter_map(|(joint, name)| {
        let (block, sensed) = STATE.iter().find(|(_, columns)| columns.contains(&joint))?;
        let (_, columns) = ACTION.iter().find(|(name, _)| name == block)?;
        Some((name, columns.start + joint - sensed.start))
    });
    upper.chain(base).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(String::from).collect()
    }

    #[test]
    fn names_are_blocks_or_single_columns() {
        assert_eq!(state_columns(&names("waist left_knee_joint vx_m_s")), Ok(vec![12, 13, 14, 3, 60]));
        assert_eq!(action_columns(&names("pelvis_height_m waist_roll_joint")), Ok(vec![34, 29]));
        assert_eq!(action_columns(&names("row")).map(|columns| columns.len()), Ok(35));
        let text = action_columns(&names("left_leg")).unwrap_err();
        assert!(text.starts_with("no column \"left_leg\"; have: left_arm, "), "{text}");
        let text = action_columns(&names("left_arm left_elbow_joint")).unwrap_err();
        assert_eq!(text, "\"left_elbow_joint\" is told twice");
    }

    #[test]
    fn columns_are_those_of_the_contract() {
        // Blocks of arms, hands and waist follow the one order in a state and the other in a row, with equal joints.
        let action: Vec<String> = (0..ACTION_ROW_LEN).map(action_name).collect();
        assert!(action.iter().all(|name| !name.is_empty()), "{action:?}");
        assert_eq!(
            (&*action[3], &*action[21], &*action[28]),
            ("left_elbow_joint", "right_hand_thumb_0_joint", "waist_yaw_joint")
        );
        assert_eq!(action[31..], BASE_COLUMNS);
        let state_values: Vec<f64> = (0..STATE_LEN as u32).map(f64::from).collect();
        let row = held_row(&state_values);
        assert_eq!((row[0], row[7], row[14], row[28], row[31], row[34]), (15.0, 29.0, 22.0, 12.0, 0.0, 63.0));
    }
}
