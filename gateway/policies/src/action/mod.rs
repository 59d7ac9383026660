//! Conversion of a policy's reply to commands. The reply is checked against the map before any robot moves.

mod executor;
mod spans;
mod table;
mod wrists;

pub use executor::{Executor, executed_rows};
pub use wrists::WristTarget;

use tandem_tools_spec::ACTION_ROW_LEN;

use crate::{
    columns::{ACTION_LEN, action_name, held_row, motors, sensed_pelvis, sensed_wrist},
    error::RemoteError,
    map::{AnswerScope, PolicyMap, ROBOT},
    named_columns,
    poses::pose_of,
    request::{PolicyObservation, TaskInstructions},
    values::ReplyValue,
};

/// Actions of one robot: rows at the map's rate.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotRows {
    pub robot: String,
    pub rows: Vec<ActionRow>,
}

/// Action of one robot at one time step, independent of its state.
#[derive(Clone, Debug, PartialEq)]
pub struct ActionRow {
    /// Row of `send_joint_chunk`. Arms and waist are ignored if the robot follows wrist poses.
    pub row: Vec<f64>,
    /// Targets of the left and the right wrist.
    pub wrists: [WristTarget; 2],
    /// Row of `send_joint_drives` if the policy drives motors; empty otherwise.
    pub motor_row: Vec<f64>,
}

/// Values of some action columns of one robot, for all rows of a reply.
struct ColumnBlock<'a> {
    key: String,
    columns: Vec<usize>,
    /// Values of all rows, row by row. In each row, this robot's values begin at the index `from`.
    values: &'a [f64],
    from: usize,
    width: usize,
}

/// Parses the reply `answer` into the rows of the robots with the indices `robots`.
///
/// Columns that the policy does not command are taken from `held_rows`, and differences are added to the
/// `observed` state.
pub fn chunks(
    map: &PolicyMap,
    instructions: &TaskInstructions,
    answer: &ReplyValue,
    robots: &[usize],
    held_rows: &[Vec<f64>],
    observed: &PolicyObservation,
) -> Result<Vec<RobotRows>, RemoteError> {
    let mut found = Vec::with_capacity(robots.len());
    for (place, robot) in robots.iter().enumerate() {
        let name = &instructions.robots[*robot];
        let parts = parts(map, answer, name, place, robots.len())?;
        let state_values = &observed.robots[*robot].state_values;
        let told = joined(map, &parts, &held_rows[*robot])?;
        let rows = told.iter().enumerate().map(|(row, told)| action_row(map, told, row, state_values));
        found.push(RobotRows { robot: name.clone(), rows: rows.collect::<Result<_, _>>()? });
    }
    Ok(found)
}

/// Returns the columns for the robot called `name`, which has the index `place` among the `robots` that the
/// answer moves.
fn parts<'a>(
    map: &PolicyMap,
    answer: &'a ReplyValue,
    name: &str,
    place: usize,
    robots: usize,
) -> Result<Vec<ColumnBlock<'a>>, RemoteError> {
    let mut parts = Vec::with_capacity(map.action.len());
    for (key, names) in &map.action {
        let columns = named_columns::joined(names);
        // Without a robot's name in the key, the columns of all robots are side by side.
        let apart = key.contains(ROBOT) || map.answer == AnswerScope::One;
        let (width, from) = match apart {
            true => (columns.len(), 0),
            false => (columns.len() * robots, columns.len() * place),
        };
        let key = key.replace(ROBOT, name);
        let values = table::find(answer, &key, width, map.chunk.rows)?;
        parts.push(ColumnBlock { key, columns, values, from, width });
    }
    Ok(parts)
}

/// Joins the blocks to rows with all columns that a policy may command, for the rows that are executed.
fn joined(map: &PolicyMap, parts: &[ColumnBlock], held_row: &[f64]) -> Result<Vec<Vec<f64>>, RemoteError> {
    let Some(first) = parts.first() else { return Ok(Vec::new()) };
    let rows = first.values.len() / first.width;
    if let Some(other) = parts.iter().find(|part| part.values.len() / part.width != rows) {
        let have = other.values.len() / other.width;
        let text = format!(
            "{rows} rows under the key {:?} and {have} under {:?}; expected as many",
            first.key, other.key
        );
        return Err(RemoteError::Misfit(text));
    }
    let executed = map.chunk.execute.unwrap_or(rows);
    if executed > rows {
        let text = format!("{rows} rows, of which {executed} are to be executed; expected at least as many");
        return Err(RemoteError::Misfit(text));
    }
    let row = |row: usize| {
        let mut whole = held_row.to_vec();
        whole.resize(ACTION_LEN, 0.0);
        for part in parts {
            let numbers = &part.values[row * part.width + part.from..];
            for (column, value) in part.columns.iter().zip(numbers) {
                whole[*column] = *value;
            }
        }
        whole
    };
    Ok((0..executed).map(row).collect())
}

/// Converts `told_values`, the values of row number `row`, to an action for a robot in the state
/// `state_values`.
fn action_row(
    map: &PolicyMap,
    told_values: &[f64],
    row: usize,
    state_values: &[f64],
) -> Result<ActionRow, RemoteError> {
    let delta = map.delta();
    let (mut whole, sensed_row) = (told_values[..ACTION_ROW_LEN].to_vec(), held_row(state_values));
    for column in &delta.row_columns {
        whole[*column] += sensed_row[*column];
    }
    let told_columns = map.told_columns();
    let pelvis_in_start = pose_of(sensed_pelvis(state_values));
    let mut wrists = [WristTarget::default(); 2];
    for (side, wrist) in wrists.iter_mut().enumerate() {
        let given = WristTarget::read(told_values, &told_columns, side)
            .map_err(|reason| RemoteError::Misfit(format!("in row {row}, {reason}")))?;
        let pelvis_from_wrist = pose_of(sensed_wrist(state_values, side));
        *wrist =
            given.resolved(map.chunk.wrist_frame, delta.wrists[side], &pelvis_from_wrist, &pelvis_in_start);
    }
    let positions_m = wrists.iter().filter_map(|wrist| wrist.position_m);
    if positions_m.flat_map(<[f64; 3]>::from).any(|value| value.abs() > LARGEST_VALUE) {
        return Err(RemoteError::Misfit(format!("a wrist is sent beyond {LARGEST_VALUE} m; expected m")));
    }
    let motor_row = match map.drives_motors() {
        true => read_motors(told_values, row)?,
        false => Vec::new(),
    };
    match whole.iter().position(|value| value.abs() > LARGEST_VALUE) {
        None => Ok(ActionRow { row: whole, wrists, motor_row }),
        Some(column) => {
            let name = action_name(column);
            Err(RemoteError::Misfit(format!(
                "{name} is beyond {LARGEST_VALUE} in size; expected rad, m and m/s"
            )))
        }
    }
}

/// Returns the motor setpoints in row number `row`.
fn read_motors(told_values: &[f64], row: usize) -> Result<Vec<f64>, RemoteError> {
    let setpoints = told_values[motors()].to_vec();
    let gains = setpoints.len() * 2 / 5..setpoints.len() * 4 / 5;
    let wrong = |(index, value): (usize, &f64)| {
        value.abs() > LARGEST_SETPOINT || (*value < 0.0 && gains.contains(&index))
    };
    match setpoints.iter().enumerate().position(wrong) {
        None => Ok(setpoints),
        Some(index) => Err(RemoteError::Misfit(format!(
            "in row {row}, a number of {} is {}; expected at most {LARGEST_SETPOINT} in size, and gains of at least 0",
            action_name(motors().start + index),
            setpoints[index]
        ))),
    }
}

/// Limit on the magnitude of motor setpoints, above any gain of a G1's motors.
const LARGEST_SETPOINT: f64 = 10_000.0;

/// Limit on the magnitude of values. Larger ones mean that the policy uses other units or has diverged.
const LARGEST_VALUE: f64 = 1000.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn instructions() -> TaskInstructions {
        let names = ["A", "B"].map(String::from).to_vec();
        TaskInstructions {
            task: String::new(),
            per_robot: names.clone(),
            joint: String::new(),
            robots: names,
        }
    }

    fn map(text: &str) -> PolicyMap {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), format!("preset = \"openpi\"\n{text}")).unwrap();
        PolicyMap::find(&file.path().display().to_string()).unwrap()
    }

    fn array(shape: &[usize]) -> ReplyValue {
        let values = (0..shape.iter().product::<usize>()).map(|index| index as f64 / 100.0).collect();
        ReplyValue::Array { shape: shape.into(), values }
    }

    fn keyed(entries: &[(&str, ReplyValue)]) -> ReplyValue {
        ReplyValue::Map(entries.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect())
    }

    fn read_at(
        map: &PolicyMap,
        answer: &ReplyValue,
        robots: &[usize],
        observed: &PolicyObservation,
    ) -> Result<Vec<RobotRows>, String> {
        let held_rows = [vec![9.0; 35], vec![8.0; 35]];
        chunks(map, &instructions(), answer, robots, &held_rows, observed).map_err(|error| error.to_string())
    }

    fn read(map: &PolicyMap, answer: &ReplyValue, robots: &[usize]) -> Result<Vec<RobotRows>, String> {
        read_at(map, answer, robots, &PolicyObservation::blank(2))
    }

    #[test]
    fn rows_are_executed_whole_or_the_first_of_them() {
        let answer = keyed(&[("actions", array(&[50, 35]))]);
        let whole = read(&map(""), &answer, &[1]).unwrap();
        assert_eq!((whole.len(), &*whole[0].robot, whole[0].rows.len()), (1, "B", 50));
        assert_eq!((whole[0].rows[0].row[1], whole[0].rows[1].row[0]), (0.01, 0.35));
        let first = read(&map("[chunk]\nrows = 50\nexecute = 20"), &answer, &[1]).unwrap();
        assert_eq!(first[0].rows, whole[0].rows[..20]);
        // Both a batch of one and a single row are accepted.
        assert_eq!(read(&map(""), &keyed(&[("actions", array(&[1, 50, 35]))]), &[1]).unwrap(), whole);
        assert_eq!(read(&map(""), &keyed(&[("actions", array(&[35]))]), &[0]).unwrap()[0].rows.len(), 1);
    }

    #[test]
    fn columns_come_in_any_order_and_the_rest_is_held() {
        let own = map("[action]\n\"h\" = [\"pelvis_height_m\"]\n\"a\" = [\"waist\", \"left_arm\"]");
        let answer = keyed(&[("a", array(&[2, 10])), ("h", array(&[2]))]);
        let rows = &read(&own, &answer, &[0]).unwrap()[0].rows;
        assert_eq!(
            (rows[1].row[28], rows[1].row[0], rows[1].row[34], rows[1].row[7]),
            (0.1, 0.13, 0.01, 9.0)
        );
        let uneven = keyed(&[("a", array(&[2, 10])), ("h", array(&[3, 1]))]);
        let text = read(&own, &uneven, &[0]).unwrap_err();
        assert!(text.contains("2 rows under the key \"a\" and 3 under \"h\""), "{text}");
    }

    #[test]
    fn one_answer_may_move_all() {
        let all =
            "answer = \"all\"\nscope = \"global\"\n[images]\n[state]\n\"{robot}\" = [\"waist\"]\n[action]\n";
        let beside = map(&format!("{all}\"actions\" = [\"waist\"]"));
        let answer = keyed(&[("actions", array(&[4, 6]))]);
        let chunks = read(&beside, &answer, &[0, 1]).unwrap();
        let waists: Vec<_> =
            chunks.iter().map(|chunk| (&*chunk.robot, chunk.rows[1].row[28], chunk.rows[1].row[0])).collect();
        assert_eq!(waists, [("A", 0.06, 9.0), ("B", 0.09, 8.0)]);
        let apart = map(&format!("{all}\"{{robot}} > actions\" = [\"waist\"]"));
        let of = |shape| keyed(&[("actions", array(shape))]);
        let chunks = read(&apart, &keyed(&[("A", of(&[4, 3])), ("B", of(&[4, 3]))]), &[0, 1]).unwrap();
        assert_eq!(chunks.iter().map(|chunk| chunk.rows[1].row[28]).collect::<Vec<_>>(), [0.03, 0.03]);
    }

    #[test]
    fn what_came_and_what_was_expected_is_said() {
        let check = |map: &PolicyMap, answer: &ReplyValue, says: &str| {
            let text = read(map, answer, &[0]).unwrap_err();
            assert!(text.contains(says), "{text}");
        };
        let any = map("");
        let fixed = map("[chunk]\nrows = 50");
        let expected = "expected an array of shape [rows, 35] under the key \"actions\"; came ";
        check(
            &any,
            &keyed(&[("actions", array(&[50, 32]))]),
            &format!("{expected}an array of shape [50, 32]"),
        );
        check(
            &any,
            &keyed(&[("action", array(&[50, 35]))]),
            &format!("{expected}\"action\": an array of shape [50, 35]"),
        );
        check(&any, &keyed(&[("actions", array(&[2, 50, 35]))]), "came an array of shape [2, 50, 35]");
        check(&any, &keyed(&[("actions", array(&[0, 35]))]), "came an array of shape [0, 35]");
        check(&any, &keyed(&[("actions", ReplyValue::number(1.0))]), "came a number");
        check(&any, &ReplyValue::Text("error".into()), "came the text \"error\"");
        check(
            &fixed,
            &keyed(&[("actions", array(&[20, 35]))]),
            "[50, 35] under the key \"actions\"; came an array of shape [20, 35]",
        );
        check(
            &map("[chunk]\nexecute = 60"),
            &keyed(&[("actions", array(&[50, 35]))]),
            "50 rows, of which 60 are to be executed",
        );
        let bare = "came an array of shape [50, 35] without a key: answer with a map that has the key \"actions\", or make \"\" the key in [action]";
        check(&any, &array(&[50, 35]), bare);
        let mut values = vec![0.0; 70];
        values[37] = f64::NAN;
        let broken = keyed(&[("actions", ReplyValue::Array { shape: vec![2, 35], values })]);
        check(&any, &broken, "row 1, column 2 under the key \"actions\" is NaN");
        let far = keyed(&[("actions", ReplyValue::Array { shape: vec![35], values: vec![4e6; 35] })]);
        check(&any, &far, "left_shoulder_pitch_joint is beyond 1000");
    }

    #[test]
    fn differences_are_added_to_what_was_observed() {
        let own = map(
            "[action]\n\"a\" = [\"left_arm\", \"waist\", \"pelvis_height_m\"]\n[chunk]\ndelta = [\"left_arm\", \"pelvis_height_m\"]",
        );
        let mut observed = PolicyObservation::blank(2);
        observed.robots[1].state_values[15] = 0.5;
        *observed.robots[1].state_values.last_mut().unwrap() = 0.7;
        let rows = &read_at(&own, &keyed(&[("a", array(&[2, 11]))]), &[1], &observed).unwrap()[0].rows;
        // First arm joint, waist as commanded, height, and a held joint.
        let row = &rows[1].row;
        assert_eq!((row[0], row[28], row[7]), (0.5 + 0.11, 0.18, 8.0));
        assert!((row[34] - (0.7 + 0.21)).abs() < 1e-12, "{row:?}");
    }

    #[test]
    fn motors_are_driven_by_rows_of_all_joints() {
        let own = map("[action]\n\"m\" = [\"motors\"]\n[chunk]\nrate_hz = 25.0");
        let answer = keyed(&[("m", array(&[2, 215]))]);
        let chunks = read(&own, &answer, &[1]).unwrap();
        assert_eq!((chunks[0].rows[1].motor_row.len(), chunks[0].rows[1].motor_row[0]), (215, 2.15));
        let executor = Executor::new(&own, 3, &PolicyObservation::blank(2));
        let commands = executor.commands(&chunks, 0..2).into_iter();
        let calls: Vec<_> = commands.map(|command| executor.call(command, &chunks)).collect();
        assert_eq!(
            calls.iter().map(|call| (call.name(), call.steps())).collect::<Vec<_>>(),
            [("send_joint_drives", 3), ("send_joint_drives", 1)]
        );
        let negative = ReplyValue::Array { shape: vec![1, 215], values: vec![-1.0; 215] };
        let text = read(&own, &keyed(&[("m", negative)]), &[0]).unwrap_err();
        assert!(text.contains("in row 0, a number of motor_kp is -1"), "{text}");
        let refused = |action: &str| {
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), format!("preset = \"openpi\"\n[action]\n\"m\" = [{action}]"))
                .unwrap();
            PolicyMap::find(&file.path().display().to_string()).unwrap_err().to_string()
        };
        assert!(refused("\"motor_position\", \"motor_kp\"").contains("does not tell \"motor_kd\""));
        assert!(refused("\"motors\", \"waist\"").contains("give one or the other"));
    }

    #[test]
    fn poses_without_a_direction_are_refused() {
        let own = map("[action]\n\"a\" = [\"left_wrist\"]");
        let answer = |values: Vec<f64>| keyed(&[("a", ReplyValue::Array { shape: vec![1, 7], values })]);
        let text = read(&own, &answer(vec![0.0; 7]), &[0]).unwrap_err();
        assert!(text.contains("in row 0, the rotation of left_wrist has no direction"), "{text}");
        let text = read(&own, &answer(vec![4e6, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), &[0]).unwrap_err();
        assert!(text.contains("a wrist is sent beyond 1000 m"), "{text}");
        let rows = &read(&own, &answer(vec![0.3, 0.2, 0.1, 2.0, 0.0, 0.0, 0.0]), &[0]).unwrap()[0].rows;
        assert_eq!(rows[0].wrists[0].position_m.unwrap().x, 0.3);
        assert_eq!((rows[0].wrists[1], rows[0].row[0]), (WristTarget::default(), 9.0));
    }
}
