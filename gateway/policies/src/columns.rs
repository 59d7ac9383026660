//! Names of the columns of a robot's state and of its actions.

use std::ops::Range;

use tandem_episodes::{
    joint_names,
    rows::velocities,
    tasks::{self, Task},
};
use tandem_tools_spec::{
    ACTION_ROW_LEN, BASE_COLUMNS, DRIVE_ROW_LEN, ExtraInformation, Pose, RobotState, SensorSamples,
};

use crate::poses::{POSE_LEN, RotationForm, pose_values};

/// A range of columns, with its name.
type Block = (String, Range<usize>);

/// Blocks of a robot's state except the wrists, in the order of [`state_values`].
const STATE: [(&str, Range<usize>); 17] = [
    ("left_leg", 0..6),
    ("right_leg", 6..12),
    ("waist", 12..15),
    ("left_arm", 15..22),
    ("left_hand", 22..29),
    ("right_arm", 29..36),
    ("right_hand", 36..43),
    ("joints", 0..JOINTS),
    ("gravity", STATE_GRAVITY..STATE_PELVIS),
    ("pelvis_in_start", STATE_PELVIS..STATE_MOMENT),
    ("episode", STATE_MOMENT..STATE_MOMENT + 1),
    ("step", STATE_MOMENT + 1..STATE_MOMENT + 2),
    ("reset", STATE_MOMENT + 2..STATE_RATES),
    ("joint_velocities", STATE_RATES..STATE_GYRO),
    ("gyro", STATE_GYRO..STATE_GYRO + 3),
    ("specific_force", STATE_GYRO + 3..STATE_BASE),
    ("base_command", STATE_BASE..STATE_LEN),
];
const JOINTS: usize = 43;
const STATE_WRISTS: [usize; 2] = [JOINTS, JOINTS + POSE_LEN];
const STATE_GRAVITY: usize = JOINTS + 2 * POSE_LEN;
const STATE_PELVIS: usize = STATE_GRAVITY + 3;
const STATE_MOMENT: usize = STATE_PELVIS + 7;
const STATE_RATES: usize = STATE_MOMENT + 3;
const STATE_GYRO: usize = STATE_RATES + JOINTS;
/// The last columns are the base command.
const STATE_BASE: usize = STATE_GYRO + 6;
const STATE_LEN: usize = STATE_BASE + 4;

/// Blocks of an action row, in the order of `send_joint_chunk`.
const ACTION: [(&str, Range<usize>); 7] = [
    ("left_arm", 0..7),
    ("right_arm", 7..14),
    ("left_hand", 14..21),
    ("right_hand", 21..28),
    ("waist", 28..31),
    ("base_command", ACTION_BASE..ACTION_ROW_LEN),
    ("row", 0..ACTION_ROW_LEN),
];
const ACTION_BASE: usize = 31;
/// After the columns of an action row, a policy may command wrist poses.
const ACTION_WRISTS: [usize; 2] = [ACTION_ROW_LEN, ACTION_ROW_LEN + POSE_LEN];
/// After the wrist poses, it may command the setpoints of all motors, in the order of `send_joint_drives`.
const ACTION_MOTORS: usize = ACTION_ROW_LEN + 2 * POSE_LEN;
/// Number of columns that a policy may command.
pub const ACTION_LEN: usize = ACTION_MOTORS + DRIVE_ROW_LEN;
/// Names of the blocks of motor setpoints. Each block has 43 columns, one for each joint.
const MOTORS: [&str; 5] = ["motor_position", "motor_velocity", "motor_kp", "motor_kd", "motor_torque"];

/// Names of the wrists, left before right throughout.
pub const WRISTS: [&str; 2] = ["left_wrist", "right_wrist"];
/// Suffixes of a wrist's name for parts of the wrist's pose, with the ranges of these parts in the pose.
const WRIST_PARTS: [(&str, Range<usize>); 6] = [
    ("", 0..7),
    ("_position", 0..3),
    ("_quaternion", 3..7),
    ("_quaternion_xyzw", 7..11),
    ("_columns_6d", 11..17),
    ("_rows_6d", 17..POSE_LEN),
];

/// Returns the full state of a robot, or `None` if a part of the state is withheld.
///
/// The order is: joints in rad; the pose of each wrist in the pelvis frame; the direction of gravity in the
/// pelvis frame; the pose of the pelvis by the robot's odometry (x, y, z in m and w, x, y, z); the moment of
/// the episode; joint velocities, gyro and specific force, or zeros if they were not requested; the present
/// base command in the order of [`BASE_COLUMNS`].
pub fn state_values(state: &RobotState, moment: &EpisodeMoment) -> Option<Vec<f64>> {
    let joints = state.joint_positions_rad.0.iter().map(|(_, angle_rad)| *angle_rad);
    let wrists = [&state.left_wrist, &state.right_wrist].into_iter();
    let wrists = wrists.flat_map(|pose| pose_values(pose.position_m, pose.quaternion_wxyz));
    let Pose { position_m, quaternion_wxyz } = state.pelvis_in_start?;
    let pelvis = position_m.into_iter().chain(quaternion_wxyz);
    let base = state.base_command.as_ref()?;
    let base = [base.vx_m_s, base.vy_m_s, base.yaw_rate_rad_s, base.pelvis_height_m];
    let EpisodeMoment { episode, done_steps, is_first } = *moment;
    let moment = [episode.into(), done_steps, f64::from(is_first)];
    let sensed = joints.chain(wrists).chain(state.gravity_in_pelvis?).chain(pelvis);
    Some(sensed.chain(moment).chain(rates(state.samples.as_ref())).chain(base).collect())
}

/// Returns the latest joint velocities, gyro and specific force; zeros without samples.
fn rates(samples: Option<&SensorSamples>) -> Vec<f64> {
    let latest = samples.and_then(|samples| {
        let rates = samples.joint_velocities_rad_s.last()?.iter().copied();
        Some(rates.chain(*samples.gyro_rad_s.last()?).chain(*samples.specific_force_m_s2.last()?).collect())
    });
    latest.unwrap_or_else(|| vec![0.0; STATE_BASE - STATE_RATES])
}

/// Time in an episode, for policies with memory on servers that may play several episodes in parallel.
#[derive(Clone, Copy, Debug, Default)]
pub struct EpisodeMoment {
    /// Number of the episode, at least 1, which a 32-bit float represents exactly.
    pub episode: u32,
    /// Number of control steps since the episode began.
    pub done_steps: f64,
    /// True for the first request of the episode.
    pub is_first: bool,
}

impl EpisodeMoment {
    /// Returns the number of an episode. Its millions are the number of a built-in task, from 1, and the rest
    /// is the seed. Tasks from users' files have higher numbers, which are derived from hashes.
    pub fn number_of(task: &Task, seed: u32) -> u32 {
        const SEEDS: u32 = 1_000_000;
        /// First integer that a 32-bit float does not distinguish from the next one.
        const END: u32 = 1 << 24;
        let built_in = tasks::built_in();
        let own_file = task.file_xxh3().filter(|_| task.suite().is_none());
        match (own_file, built_in.clone().position(|known| known.id == task.id)) {
            (None, Some(index)) => (index as u32 + 1) * SEEDS + seed % SEEDS,
            (file, _) => {
                let first = (built_in.count() as u32 + 1) * SEEDS;
                let hash = file.and_then(|xxh3| u64::from_str_radix(xxh3, 16).ok()).unwrap_or_default();
                // The golden ratio spreads consecutive seeds.
                let spread = hash.wrapping_add(u64::from(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15)) >> 20;
                first + (spread % u64::from(END - first)) as u32
            }
        }
    }
}

/// Returns zeros, as many as [`state_values`] has values.
pub fn blank_state_values() -> Vec<f64> {
    vec![0.0; STATE_LEN]
}

/// Returns the sensed pose of a wrist in the pelvis frame: position x, y, z and quaternion w, x, y, z.
pub fn sensed_wrist(state_values: &[f64], side: usize) -> &[f64] {
    &state_values[STATE_WRISTS[side]..][..7]
}

/// Returns the pose of the pelvis in the start frame by the robot's odometry: position x, y, z and quaternion
/// w, x, y, z.
pub fn sensed_pelvis(state_values: &[f64]) -> &[f64] {
    &state_values[STATE_PELVIS..STATE_MOMENT]
}

/// Returns the row that holds a robot in its sensed state. Arms, hands, waist and height remain unchanged,
/// and the base does not walk.
pub fn held_row(state_values: &[f64]) -> Vec<f64> {
    let mut row = vec![0.0; ACTION_ROW_LEN];
    for (name, columns) in &ACTION {
        if let Some((_, sensed)) = STATE.iter().find(|(known, _)| known == name) {
            row[columns.clone()].copy_from_slice(&state_values[sensed.clone()]);
        }
    }
    // The height is the only persistent part of a base command.
    row[velocities()].fill(0.0);
    row
}

/// Returns true for a column of arms or waist. Inverse kinematics controls these joints if wrist poses are
/// commanded.
pub fn is_of_arm_or_waist(column: usize) -> bool {
    let blocks = ["left_arm", "right_arm", "waist"];
    ACTION.iter().any(|(name, columns)| blocks.contains(name) && columns.contains(&column))
}

/// Returns the columns of a hand's joints in an action row.
pub fn hand(side: usize) -> Range<usize> {
    ACTION[2 + side].1.clone()
}

/// Returns the columns of all motor setpoints among those that a policy may command.
pub fn motors() -> Range<usize> {
    ACTION_MOTORS..ACTION_LEN
}

/// Returns the columns of both wrist poses among those that a policy may command.
pub fn wrists() -> Range<usize> {
    ACTION_ROW_LEN..ACTION_MOTORS
}

/// Returns the columns of a wrist's position among those that a policy may command.
pub fn wrist_position(side: usize) -> Range<usize> {
    ACTION_WRISTS[side]..ACTION_WRISTS[side] + 3
}

/// Returns the columns of a wrist's rotation in this form, among those that a policy may command.
pub fn wrist_rotation(side: usize, form: RotationForm) -> Range<usize> {
    let before = RotationForm::ALL.into_iter().take_while(|known| *known != form);
    let from = ACTION_WRISTS[side] + 3 + before.map(RotationForm::len).sum::<usize>();
    from..from + form.len()
}

/// Returns the index of the wrist whose pose, or a part of it, is called `name`. Wrist joints are not
/// included.
pub fn wrist_named(name: &str) -> Option<usize> {
    let is_of = |wrist: &str| WRIST_PARTS.iter().any(|(part, _)| name.strip_prefix(wrist) == Some(*part));
    WRISTS.iter().position(|wrist| is_of(wrist))
}

/// Returns the indices in [`state_values`] of the columns called `name`.
pub fn state_range(name: &str) -> Result<Range<usize>, String> {
    range(name, &state_blocks(), &state_singles())
}

/// Returns the extra information in the state columns `columns`, which the benchmark withholds from its own
/// policies.
pub fn extra_columns(columns: &[usize]) -> Vec<ExtraInformation> {
    let extra = [
        (ExtraInformation::Gravity, STATE_GRAVITY..STATE_PELVIS),
        (ExtraInformation::Odometry, STATE_PELVIS..STATE_MOMENT),
        (ExtraInformation::JointVelocities, STATE_RATES..STATE_GYRO),
        (ExtraInformation::InertialReadings, STATE_GYRO..STATE_BASE),
    ];
    let named = |of: &Range<usize>| columns.iter().any(|column| of.contains(column));
    extra.into_iter().filter(|(_, of)| named(of)).map(|(what, _)| what).collect()
}

/// Returns the indices of the columns called `name` among those that a policy may command.
pub fn action_range(name: &str) -> Result<Range<usize>, String> {
    range(name, &action_blocks(), &action_singles())
}

/// Yields the blocks of an action row with their names. Each column is in exactly one block.
pub fn row_blocks() -> impl Iterator<Item = (&'static str, Range<usize>)> {
    ACTION.into_iter().filter(|(_, columns)| *columns != (0..ACTION_ROW_LEN))
}

/// Returns the name of the command column with the index `column`. For a wrist, it is the name of the part of
/// the pose; for a motor, the name of the block.
pub fn action_name(column: usize) -> String {
    let single = action_singles().into_iter().find(|(_, at)| *at == column).map(|(name, _)| name);
    let parts = || wrist_blocks(ACTION_WRISTS).into_iter().filter(|(name, _)| !WRISTS.contains(&&**name));
    let part = || parts().find(|(_, columns)| columns.contains(&column)).map(|(name, _)| name);
    let motor = || motor_blocks().find(|(_, columns)| columns.contains(&column)).map(|(name, _)| name);
    single.or_else(part).or_else(motor).unwrap_or_default()
}

fn state_blocks() -> Vec<Block> {
    let own = STATE.iter().map(|(name, columns)| ((*name).to_owned(), columns.clone()));
    own.chain(wrist_blocks(STATE_WRISTS)).collect()
}

fn action_blocks() -> Vec<Block> {
    let own = ACTION.iter().map(|(name, columns)| ((*name).to_owned(), columns.clone()));
    let all_motors = ("motors".to_owned(), motors());
    own.chain(wrist_blocks(ACTION_WRISTS)).chain(motor_blocks()).chain([all_motors]).collect()
}

/// Yields the blocks of motor setpoints in the order: positions, velocities, kp, kd, torques.
pub fn motor_blocks() -> impl Iterator<Item = Block> {
    let first = |index: usize| ACTION_MOTORS + index * JOINTS;
    MOTORS
        .iter()
        .enumerate()
        .map(move |(index, name)| ((*name).to_owned(), first(index)..first(index) + JOINTS))
}

/// Returns the blocks of both wrists. The columns of each wrist begin at its entry in `starts`.
fn wrist_blocks(starts: [usize; 2]) -> Vec<Block> {
    let of_wrist = |(wrist, start): (&str, usize)| {
        let block = |(part, columns): &(&str, Range<usize>)| {
            (format!("{wrist}{part}"), start + columns.start..start + columns.end)
        };
        WRIST_PARTS.iter().map(block).collect::<Vec<_>>()
    };
    WRISTS.into_iter().zip(starts).flat_map(of_wrist).collect()
}

fn range(name: &str, blocks: &[Block], singles: &[(String, usize)]) -> Result<Range<usize>, String> {
    let block = blocks.iter().find(|(known, _)| known == name).map(|(_, columns)| columns.clone());
    let single = || singles.iter().find(|(known, _)| known == name).map(|(_, column)| *column..*column + 1);
    block.or_else(single).ok_or_else(|| {
        let have: Vec<&str> = blocks.iter().map(|(name, _)| &**name).collect();
        format!("no column {name:?}; have: {}, and joints and base columns by name", have.join(", "))
    })
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
    use tandem_episodes::{
        EpisodeSpec, read_task,
        rows::{ActionKind, RowColumn, RowContract},
    };
    use tandem_tools_spec::Protocol;

    fn state_columns(names: &str) -> Vec<usize> {
        names.split(' ').flat_map(|name| state_range(name).unwrap()).collect()
    }

    fn action_columns(names: &str) -> Vec<usize> {
        names.split(' ').flat_map(|name| action_range(name).unwrap()).collect()
    }

    #[test]
    fn names_are_blocks_or_single_columns() {
        assert_eq!(state_columns("waist left_knee_joint vx_m_s"), [12, 13, 14, 3, STATE_BASE]);
        assert_eq!(action_columns("pelvis_height_m waist_roll_joint"), [34, 29]);
        assert_eq!(action_columns("row").len(), 35);
        let text = action_range("left_leg").unwrap_err();
        assert!(text.starts_with("no column \"left_leg\"; have: left_arm, "), "{text}");
    }

    #[test]
    fn blocks_have_the_order_of_rows_in_data_sets() {
        let spec = EpisodeSpec::new(&tasks::find("handover").unwrap(), 0, Protocol::Benchmark);
        let contract = RowContract::of(&spec, ActionKind::Joints).unwrap();
        let check = |expected: &[RowColumn], found: Vec<usize>, singles: Vec<(String, usize)>| {
            let name = |at: &usize| singles.iter().find(|(_, single)| single == at).unwrap().0.clone();
            let expected = expected.iter().map(|column| column.name.replace("_joint_rad", "_joint"));
            assert_eq!(found.iter().map(name).collect::<Vec<_>>(), expected.collect::<Vec<_>>());
        };
        check(&contract.state, state_columns("joints base_command"), state_singles());
        check(&contract.action, action_columns("row"), action_singles());
    }

    #[test]
    fn every_episode_has_a_number_that_a_float_holds() {
        let number = |task: &Task, seed: u32| EpisodeMoment::number_of(task, seed);
        let mut numbers = std::collections::BTreeSet::new();
        let folder = tempfile::tempdir().unwrap();
        let text = include_str!("../../examples/tasks/pass_the_parcel.toml");
        let own = [text.to_owned(), text.replace("parcel", "packet")].map(|text| {
            let path = folder.path().join("task.toml");
            std::fs::write(&path, text).unwrap();
            read_task(&path).unwrap()
        });
        for task in tasks::cohub().iter().chain(tasks::tandem_plus()).chain(&own) {
            for seed in [0, 1, 2000, 999_999] {
                let own = number(task, seed);
                assert!(own > 0 && (own as f32) as u32 == own && numbers.insert(own), "{own}");
            }
        }
        assert_eq!(number(&tasks::cohub()[1], 42), 2_000_042);
        let columns = state_columns("episode step reset");
        assert_eq!(columns, [STATE_MOMENT, STATE_MOMENT + 1, STATE_MOMENT + 2]);
        assert_eq!(extra_columns(&columns), [], "no sensor of the robot's tells it");
    }

    #[test]
    fn wrists_are_named_by_part() {
        let pose = action_columns("left_wrist");
        let parts = action_columns("left_wrist_position left_wrist_quaternion");
        assert_eq!((pose.len(), &pose), (7, &parts));
        for (form, part) in RotationForm::ALL.into_iter().zip(&WRIST_PARTS[2..]) {
            let named = action_columns(&format!("right_wrist{}", part.0));
            assert_eq!(named, wrist_rotation(1, form).collect::<Vec<_>>());
        }
        assert_eq!(action_columns("right_wrist_rows_6d").last(), Some(&(ACTION_MOTORS - 1)));
        let named =
            ["left_wrist", "right_wrist_rows_6d", "left_wrist_yaw_joint", "left_arm"].map(wrist_named);
        assert_eq!(named, [Some(0), Some(1), None, None]);
        assert_eq!(state_columns("pelvis_in_start gravity").len(), 10);
    }

    #[test]
    fn motors_are_named_by_block() {
        let all = action_columns("motors");
        assert_eq!(all, action_columns(&MOTORS.join(" ")));
        assert_eq!((all.len(), &*action_name(all[86])), (215, "motor_kp"));
        let rates = state_columns("joint_velocities gyro specific_force");
        assert_eq!((rates.len(), *rates.last().unwrap()), (49, STATE_BASE - 1));
        assert_eq!(
            extra_columns(&rates),
            [ExtraInformation::JointVelocities, ExtraInformation::InertialReadings]
        );
    }

    #[test]
    fn columns_are_those_of_the_contract() {
        // The blocks of arms, hands and waist are in different orders in states and rows, but contain the
        // same joints.
        let action: Vec<String> = (0..ACTION_LEN).map(action_name).collect();
        assert!(action.iter().all(|name| !name.is_empty()), "{action:?}");
        assert_eq!(
            (&*action[3], &*action[21], &*action[28]),
            ("left_elbow_joint", "right_hand_thumb_0_joint", "waist_yaw_joint")
        );
        assert_eq!(action[31..35], BASE_COLUMNS);
        assert_eq!((&*action[hand(0).start], hand(1)), ("left_hand_thumb_0_joint", 21..28));
        let state_values: Vec<f64> = (0..STATE_LEN as u32).map(f64::from).collect();
        let row = held_row(&state_values);
        assert_eq!((row[0], row[7], row[14], row[28], row[31]), (15.0, 29.0, 22.0, 12.0, 0.0));
        assert_eq!(row[34], (STATE_LEN - 1) as f64);
    }
}
