//! From a policy's reply to rows of `send_joint_chunk`: checked against its map before a robot moves.

use tandem_tools_spec::JointChunk;

use super::{
    columns::{action_columns, action_name},
    error::RemoteError,
    map::{AnswerScope, PolicyMap, ROBOT},
    request::TaskInstructions,
    values::ReplyValue,
};

/// Some columns of every row of one robot, as they stand in a reply.
struct ColumnBlock<'a> {
    key: String,
    columns: Vec<usize>,
    /// Numbers by row; of each, those from `from` on are this robot's.
    values: &'a [f64],
    from: usize,
    width: usize,
}

/// The chunks of the robots with the indices `robots`, for which `answer` came; columns that their policy leaves out are taken
/// from `held_rows`.
pub fn chunks(
    map: &PolicyMap,
    instructions: &TaskInstructions,
    answer: &ReplyValue,
    robots: &[usize],
    held_rows: &[Vec<f64>],
) -> Result<Vec<JointChunk>, RemoteError> {
    let mut found = Vec::with_capacity(robots.len());
    for (place, robot) in robots.iter().enumerate() {
        let name = &instructions.robots[*robot];
        let parts = parts(map, answer, name, place, robots.len())?;
        found.push(JointChunk { robot: name.clone(), rows: joined(map, &parts, &held_rows[*robot])? });
    }
    Ok(found)
}

/// What the answer has for the robot called `name`, the one at `place` of the `robots` that it moves.
fn parts<'a>(
    map: &PolicyMap,
    answer: &'a ReplyValue,
    name: &str,
    place: usize,
    robots: usize,
) -> Result<Vec<ColumnBlock<'a>>, RemoteError> {
    let mut parts = Vec::with_capacity(map.action.len());
    for (key, names) in &map.action {
        // The map was checked when it was read.
        let columns = action_columns(names).unwrap_or_default();
        // Without a robot's name in the key, the columns of all robots stand side by side.
        let apart = key.contains(ROBOT) || map.answer == AnswerScope::One;
        let (width, from) = match apart {
            true => (columns.len(), 0),
            false => (columns.len() * robots, columns.len() * place),
        };
        let key = key.replace(ROBOT, name);
        let values = table(answer, &key, width, map.chunk.rows)?;
        parts.push(ColumnBlock { key, columns, values, from, width });
    }
    Ok(parts)
}

/// The numbers under `key`, which have to be rows of `width` numbers.
fn table<'a>(
    answer: &'a ReplyValue,
    key: &str,
    width: usize,
    rows: Option<usize>,
) -> Result<&'a [f64], RemoteError> {
    let expected = match rows {
        Some(rows) => format!("expected an array of shape [{rows}, {width}] under the key {key:?}"),
        None => format!("expected an array of shape [rows, {width}] under the key {key:?}"),
    };
    let misfit = |came: String| RemoteError::Misfit(format!("{expected}; came {came}"));
    let value = answer.at(key).ok_or_else(|| misfit(answer.describe()))?;
    let ReplyValue::Array { shape, values } = value else { return Err(misfit(value.describe())) };
    let (have_rows, have_width) = match shape[..] {
        // One column, or one row.
        [length] if width == 1 => (length, 1),
        [length] => (1, length),
        [.., rows, width] => (rows, width),
        [] => (0, 0),
    };
    let batches: usize = shape.iter().rev().skip(2).product();
    if (batches, have_width) != (1, width) || have_rows == 0 || rows.is_some_and(|rows| rows != have_rows) {
        return Err(misfit(value.describe()));
    }
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(values),
        Some(at) => Err(RemoteError::Misfit(format!(
            "the number in row {}, column {} under the key {key:?} is {}; expected finite numbers",
            at / width,
            at % width,
            values[at]
        ))),
    }
}

/// Whole rows, as many as are executed.
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
        for part in parts {
            let numbers = &part.values[row * part.width + part.from..];
            for (column, value) in part.columns.iter().zip(numbers) {
                whole[*column] = *value;
            }
        }
        whole
    };
    let rows: Vec<Vec<f64>> = (0..executed).map(row).collect();
    match rows.iter().flatten().position(|value| value.abs() > LARGEST_VALUE) {
        None => Ok(rows),
        Some(at) => {
            let name = action_name(at % held_row.len());
            Err(RemoteError::Misfit(format!(
                "{name} is beyond {LARGEST_VALUE} in size; expected rad, m and m/s"
            )))
        }
    }
}

/// No joint turns and no robot walks as far; a policy whose numbers are larger has other units or has lost its session.
const LARGEST_VALUE: f64 = 1000.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn instructions() -> TaskInstructions {
        let names = ["A", "B"].map(String::from).to_vec();
        TaskInstructions { per_robot: names.clone(), joint: String::new(), robots: names }
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

    fn read(map: &PolicyMap, answer: &ReplyValue, robots: &[usize]) -> Result<Vec<JointChunk>, String> {
        let held_rows = [vec![9.0; 35], vec![8.0; 35]];
        chunks(map, &instructions(), answer, robots, &held_rows).map_err(|error| error.to_string())
    }

    #[test]
    fn rows_are_executed_whole_or_the_first_of_them() {
        let answer = keyed(&[("actions", array(&[50, 35]))]);
        let whole = read(&map(""), &answer, &[1]).unwrap();
        assert_eq!((whole.len(), &*whole[0].robot, whole[0].rows.len()), (1, "B", 50));
        assert_eq!((whole[0].rows[0][1], whole[0].rows[1][0]), (0.01, 0.35));
        let first = read(&map("[chunk]\nrows = 50\nexecute = 20"), &answer, &[1]).unwrap();
        assert_eq!(first[0].rows, whole[0].rows[..20]);
        // A batch of one, and one row alone.
        assert_eq!(read(&map(""), &keyed(&[("actions", array(&[1, 50, 35]))]), &[1]).unwrap(), whole);
        assert_eq!(read(&map(""), &keyed(&[("actions", array(&[35]))]), &[0]).unwrap()[0].rows.len(), 1);
    }

    #[test]
    fn columns_come_in_any_order_and_the_rest_is_held() {
        let own = map("[action]\n\"h\" = [\"pelvis_height_m\"]\n\"a\" = [\"waist\", \"left_arm\"]");
        let answer = keyed(&[("a", array(&[2, 10])), ("h", array(&[2]))]);
        let rows = &read(&own, &answer, &[0]).unwrap()[0].rows;
        assert_eq!((rows[1][28], rows[1][0], rows[1][34], rows[1][7]), (0.1, 0.13, 0.01, 9.0));
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
            chunks.iter().map(|chunk| (&*chunk.robot, chunk.rows[1][28], chunk.rows[1][0])).collect();
        assert_eq!(waists, [("A", 0.06, 9.0), ("B", 0.09, 8.0)]);
        let apart = map(&format!("{all}\"{{robot}} > actions\" = [\"waist\"]"));
        let of = |shape| keyed(&[("actions", array(shape))]);
        let chunks = read(&apart, &keyed(&[("A", of(&[4, 3])), ("B", of(&[4, 3]))]), &[0, 1]).unwrap();
        assert_eq!(chunks.iter().map(|chunk| chunk.rows[1][28]).collect::<Vec<_>>(), [0.03, 0.03]);
    }

    #[test]
    fn what_came_and_what_was_expected_is_said() {
        let check = |map: &PolicyMap, answer: &ReplyValue, says: &str| {
            let text = read(map, answer, &[0]).unwrap_err();
            assert!(text.contains(says), "{text}");
        };
        let any = map("");
        let fixed = map("[chunk]\nrows = 50\nexecute = 60");
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
        check(&fixed, &keyed(&[("actions", array(&[50, 35]))]), "50 rows, of which 60 are to be executed");
        let mut values = vec![0.0; 70];
        values[37] = f64::NAN;
        let broken = keyed(&[("actions", ReplyValue::Array { shape: vec![2, 35], values })]);
        check(&any, &broken, "row 1, column 2 under the key \"actions\" is NaN");
        let far = keyed(&[("actions", ReplyValue::Array { shape: vec![35], values: vec![4e6; 35] })]);
        check(&any, &far, "left_shoulder_pitch_joint is beyond 1000");
    }
}
