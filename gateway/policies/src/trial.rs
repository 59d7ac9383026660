//! Trial of a map with a synthetic observation and answer. It reports the request that a policy would get and
//! the effect of its answer.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use tandem_episodes::{
    CONTROL_HZ, rules,
    tasks::{self, Task, TaskWords},
};
use tandem_tools_spec::Protocol;

use crate::{
    action::{Executor, RobotRows, chunks, executed_rows},
    columns::{action_name, is_of_arm_or_waist, row_blocks, wrist_named},
    error::RemoteError,
    map::{AnswerScope, Between, CameraName, PolicyMap, ROBOT, WristFrame},
    named_columns::{CommandRow, NamedColumns, joined},
    request::{PolicyObservation, TaskInstructions, request},
    values::{ReplyValue, RequestValue},
};

/// Number of rows of a synthetic answer if the map does not specify it.
const ROWS: usize = 10;
/// Maximum number of rows of a synthetic answer if the map does not specify it. Policies answer with 8 to 100
/// rows.
const MAX_TRIAL_ROWS: usize = 100;

/// Tries `map` with each number of robots that tasks have, and returns the report.
pub fn try_map(map: &PolicyMap) -> Result<String, RemoteError> {
    check_execute(map)?;
    let by_robots: BTreeMap<usize, &Task> =
        tasks::cohub().iter().rev().map(|task| (task.robots.len(), task)).collect();
    let trials = by_robots.values().map(|task| Ok(MapTrial::new(map, task)?.text()));
    Ok(trials.collect::<Result<Vec<_>, RemoteError>>()?.join("\n"))
}

/// The trial of a map for the robots of one task.
struct MapTrial<'a> {
    map: &'a PolicyMap,
    task: &'a Task,
    instructions: TaskInstructions,
    observation: PolicyObservation,
    /// Indices of the robots in the first request.
    asked: Vec<usize>,
    chunks: Vec<RobotRows>,
}

/// A key with the type and meaning of its value.
struct KeyLine {
    key: String,
    kind: String,
    content: String,
}

impl<'a> MapTrial<'a> {
    /// Creates a synthetic answer to every request and parses it like a policy's answer.
    fn new(map: &'a PolicyMap, task: &'a Task) -> Result<MapTrial<'a>, RemoteError> {
        let (instructions, robots) = (TaskInstructions::of(task, TaskWords::of(task)), task.robots.len());
        let observation = PolicyObservation::blank(robots);
        let held_rows = observation.held_rows();
        let queries = map.queries(robots);
        let mut told = Vec::with_capacity(robots);
        for asked in &queries {
            let answer = made_up_answer(map, &instructions, asked);
            told.extend(chunks(map, &instructions, &answer, asked, &held_rows, &observation)?);
        }
        let asked = queries.into_iter().next().unwrap_or_default();
        Ok(MapTrial { map, task, instructions, observation, asked, chunks: told })
    }

    fn text(&self) -> String {
        let (robots, names) = (self.chunks.len(), self.instructions.robots.join(", "));
        let asked = match self.map.answer {
            AnswerScope::One => format!("a request for each of {names}; the one for A:"),
            AnswerScope::All => format!("one request for {names} together:"),
        };
        let sent = self.request_lines();
        let answered: Vec<KeyLine> =
            self.map.action.iter().flat_map(|(key, names)| self.answer_lines(key, names)).collect();
        let widest =
            |width: fn(&KeyLine) -> usize| sent.iter().chain(&answered).map(width).max().unwrap_or(0);
        let (key_width, kind_width) = (widest(|line| line.key.len()), widest(|line| line.kind.len()));
        let lines = |lines: &[KeyLine]| -> String {
            let line = |KeyLine { key, kind, content }: &KeyLine| {
                format!("  {key:key_width$}  {kind:kind_width$}  {content}").trim_end().to_owned() + "\n"
            };
            lines.iter().map(line).collect()
        };
        format!(
            "{robots} robots: {asked}\n{}its answer, columns counted from 0:\n{}{}",
            lines(&sent),
            lines(&answered),
            self.execution()
        )
    }

    /// Lists the keys of the first request with their values.
    fn request_lines(&self) -> Vec<KeyLine> {
        let robot = match self.map.answer {
            AnswerScope::One => self.asked.first().copied(),
            AnswerScope::All => None,
        };
        let moments = self.map.history.map_or(1, |history| history.length);
        let sent = request(self.map, &self.instructions, &vec![&self.observation; moments], robot);
        let RequestValue::Map(entries) = sent else { return Vec::new() };
        let mut lines = Vec::new();
        flatten("", &entries, &mut lines);
        let line = |(key, value): (String, &RequestValue)| KeyLine {
            content: self.sent_under(&key, value),
            kind: kind(value),
            key,
        };
        lines.into_iter().map(line).collect()
    }

    /// Describes the value sent under `key`.
    fn sent_under(&self, key: &str, value: &RequestValue) -> String {
        let is_it = |known: &str| {
            let named = |name: &String| parts(&known.replace(ROBOT, name)) == key;
            parts(known) == key || self.instructions.robots.iter().any(named)
        };
        let image = self.map.images.iter().find(|(known, _)| is_it(known));
        let state = self.map.state.iter().find(|(known, _)| is_it(known));
        match (image, state, value) {
            (Some((_, image)), _, _) => match image.camera {
                CameraName::Egocentric => "the camera in the robot's head".into(),
                CameraName::ThirdPerson => "the room, which results note as extra information".into(),
            },
            (_, Some((_, names)), _) => {
                let widths = names.iter().map(|named| format!("{} {}", named.name, named.columns.len()));
                widths.collect::<Vec<_>>().join(", ")
            }
            (None, None, RequestValue::Text(text)) => format!("{text:?}"),
            (None, None, RequestValue::List(texts)) => {
                texts.iter().map(|text| self.sent_under(key, text)).collect()
            }
            (None, None, RequestValue::Map(_) | RequestValue::Array(_)) => String::new(),
        }
    }

    /// Describes the columns under `key` in an answer and the joints that they command.
    fn answer_lines(&self, key: &str, names: &[NamedColumns<CommandRow>]) -> Vec<KeyLine> {
        let robots: Vec<&String> = self.asked.iter().map(|robot| &self.instructions.robots[*robot]).collect();
        let rows = self.map.chunk.rows.map_or("rows".to_owned(), |rows| rows.to_string());
        let line = |key: String, robots: &[&String]| {
            let mut from = 0;
            let mut content = Vec::new();
            for robot in robots {
                for named in names {
                    let (name, width) = (&named.name, named.columns.len());
                    let range =
                        if width == 1 { from.to_string() } else { format!("{from}-{}", from + width - 1) };
                    content.push(format!(
                        "{range} {name}{}{}",
                        self.understood(named),
                        of_robot(robot, robots)
                    ));
                    from += width;
                }
            }
            let key = if parts(&key).is_empty() { "(the answer itself)".into() } else { key };
            KeyLine { key, kind: format!("[{rows}, {from}]"), content: content.join(", ") }
        };
        match key.contains(ROBOT) {
            true => robots.iter().map(|robot| line(key.replace(ROBOT, robot), &[robot])).collect(),
            false => vec![line(key.to_owned(), &robots)],
        }
    }

    /// Describes the interpretation of a column that is not an absolute target.
    fn understood(&self, named: &NamedColumns<CommandRow>) -> String {
        let columns = named.columns.clone();
        let delta = self.map.delta();
        let Some(side) = wrist_named(&named.name) else {
            let added: Vec<usize> =
                columns.clone().filter(|column| delta.row_columns.contains(column)).collect();
            return match added.len() {
                0 => String::new(),
                all if all == columns.len() => " (added to what was observed)".into(),
                _ => {
                    let names: Vec<String> = added.into_iter().map(action_name).collect();
                    format!(" ({} added to what was observed)", names.join(", "))
                }
            };
        };
        let told = match (delta.wrists[side], self.map.chunk.wrist_frame) {
            (false, WristFrame::Pelvis) => " (pelvis frame)",
            (false, WristFrame::Start) => " (start frame)",
            (true, WristFrame::Pelvis) => " (from where it was observed, along the pelvis' axes)",
            (true, WristFrame::Start) => " (from where it was observed, along the start frame's axes)",
            (_, WristFrame::Wrist) => " (from where it was observed, along its own axes)",
        };
        told.into()
    }

    /// Describes the calls that result from a synthetic answer.
    fn execution(&self) -> String {
        let rows = executed_rows(&self.chunks);
        let calls = |protocol: Protocol| {
            let most_steps = rules(protocol, self.task).steps_per_command as usize;
            let executor = Executor::new(self.map, most_steps, &self.observation);
            let commands = executor.commands(&self.chunks, 0..rows);
            commands.into_iter().map(|command| executor.call(command, &self.chunks)).collect::<Vec<_>>()
        };
        let (agentic, benchmark) = (calls(Protocol::Agentic), calls(Protocol::Benchmark));
        let steps: u32 = benchmark.iter().map(|call| call.steps()).sum();
        let Some(first) = benchmark.first() else { return String::new() };
        let between = match self.map.chunk.between {
            _ if self.map.rate_hz() == CONTROL_HZ => "",
            Between::Interpolate => ", with even steps from row to row",
            Between::Hold => ", each row held until the next",
        };
        let count = |calls: usize| if calls == 1 { "1 call".to_owned() } else { format!("{calls} calls") };
        format!(
            "{}{}{rows} rows at {} a second make {steps} control steps of 20 ms{between}: {} of {} in the agentic protocol, {} in the \
             benchmark's\nan answer whose columns are 0.01, 0.02, ... begins with {} for A: {}\n",
            self.held(),
            self.made_up_rows(),
            self.map.rate_hz(),
            count(agentic.len()),
            first.name(),
            count(benchmark.len()),
            first.name(),
            told_first(&json!(first))
        )
    }

    /// Describes a requirement on the number of rows that the map does not state explicitly.
    fn made_up_rows(&self) -> String {
        match (self.map.chunk.rows, self.map.chunk.execute) {
            (None, Some(execute)) => {
                format!(
                    "[chunk] leaves rows open: an answer of fewer than {execute} rows is refused when it comes\n"
                )
            }
            _ => String::new(),
        }
    }

    /// Describes the columns that no key commands.
    fn held(&self) -> String {
        if self.map.drives_motors() {
            return "motors are driven without the robot's own controller: the policy balances the robot\n"
                .into();
        }
        let told = self.map.told_columns();
        let mut held = Vec::new();
        for (block, columns) in row_blocks() {
            let follows = self.map.moves_wrists() && columns.clone().all(is_of_arm_or_waist);
            let open: Vec<usize> = columns.clone().filter(|column| !told.contains(column)).collect();
            match (follows, open.len()) {
                (true, _) | (_, 0) => {}
                (false, all) if all == columns.len() => held.push(block.to_owned()),
                (false, _) => held.extend(open.into_iter().map(action_name)),
            }
        }
        let follows = match self.map.moves_wrists() {
            true => "arms and waist follow the wrists by inverse kinematics, as for move_wrists\n",
            false => "",
        };
        match held.is_empty() {
            true => follows.into(),
            false => format!("{follows}no key tells {}: held as at the start\n", held.join(", ")),
        }
    }
}

/// Checks that a synthetic answer can have as many rows as the map executes.
fn check_execute(map: &PolicyMap) -> Result<(), RemoteError> {
    match (map.chunk.rows, map.chunk.execute) {
        (None, Some(execute)) if execute > MAX_TRIAL_ROWS => Err(RemoteError::Misfit(format!(
            "a made-up answer has at most {MAX_TRIAL_ROWS} rows, of which [chunk] execute = {execute} are to be executed; give \
             execute at most as many rows as the policy answers with, and where these are more than {MAX_TRIAL_ROWS}, rows = \
             how many as well"
        ))),
        _ => Ok(()),
    }
}

/// Creates an answer of the expected shape with distinguishable columns: 0.01, 0.02 and so on.
fn made_up_answer(map: &PolicyMap, instructions: &TaskInstructions, asked: &[usize]) -> ReplyValue {
    let rows = map.chunk.rows.or(map.chunk.execute).unwrap_or(ROWS);
    let mut answer = ReplyValue::Map(Vec::new());
    for (key, names) in &map.action {
        let width = joined(names).len();
        let table = |width: usize| ReplyValue::Array {
            shape: vec![rows, width],
            values: (0..rows * width).map(|index| (index % width + 1) as f64 / 100.0).collect(),
        };
        match (key.contains(ROBOT), map.answer) {
            (true, _) => asked.iter().for_each(|robot| {
                answer.put(&key.replace(ROBOT, &instructions.robots[*robot]), table(width));
            }),
            (false, AnswerScope::One) => answer.put(key, table(width)),
            (false, AnswerScope::All) => answer.put(key, table(width * asked.len())),
        }
    }
    answer
}

/// Lists keys with their values. Keys in nested maps include their path.
fn flatten<'a>(
    before: &str,
    entries: &'a [(String, RequestValue)],
    found: &mut Vec<(String, &'a RequestValue)>,
) {
    for (key, value) in entries {
        let key = if before.is_empty() { key.clone() } else { format!("{before} > {key}") };
        match value {
            RequestValue::Map(inner) => flatten(&key, inner, found),
            RequestValue::Array(_) | RequestValue::Text(_) | RequestValue::List(_) => {
                found.push((key, value))
            }
        }
    }
}

/// Formats a key in the same way as [`flatten`].
fn parts(key: &str) -> String {
    crate::values::path(key).collect::<Vec<_>>().join(" > ")
}

fn kind(value: &RequestValue) -> String {
    match value {
        RequestValue::Array(array) => {
            let of = match array.dtype() {
                "|u1" => "uint8",
                _ => "float32",
            };
            format!("{of} {:?}", array.shape)
        }
        RequestValue::Text(_) => "text".into(),
        RequestValue::List(items) => {
            format!("list of {}, each {}", items.len(), items.first().map_or(String::new(), kind))
        }
        RequestValue::Map(_) => "map".into(),
    }
}

fn of_robot(robot: &str, robots: &[&String]) -> String {
    match robots.len() {
        1 => String::new(),
        _ => format!(" of {robot}"),
    }
}

/// Returns the first robot's command without empty fields and with only the first row.
fn told_first(call: &Value) -> Value {
    let mut entry = call["robots"][0].clone();
    if let Some(fields) = entry.as_object_mut() {
        fields.retain(|name, value| !value.is_null() && name != "robot");
        if let Some(rows) = fields.get_mut("rows").and_then(Value::as_array_mut) {
            rows.truncate(1);
        }
        if let Some(steps) = call.get("steps") {
            fields.insert("steps".into(), steps.clone());
        }
    }
    entry
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(text: &str) -> PolicyMap {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), format!("preset = \"openpi\"\n{text}")).unwrap();
        PolicyMap::find(&file.path().display().to_string()).unwrap()
    }

    fn tried(text: &str) -> String {
        try_map(&map(text)).unwrap()
    }

    fn check(text: &str, says: &[&str]) {
        let told = tried(text);
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        for line in says {
            assert!(words(&told).contains(&words(line)), "{line:?} in\n{told}");
        }
    }

    #[test]
    fn presets_are_told_for_two_and_three_robots() {
        check(
            "",
            &[
                "2 robots: a request for each of A, B; the one for A:",
                "3 robots: a request for each of A, B, C; the one for A:",
                "observation/image uint8 [224, 224, 3] the camera in the robot's head",
                "observation/state float32 [43] left_leg 6, right_leg 6, waist 3",
                "prompt text \"",
                "actions [rows, 35] 0-6 left_arm, 7-13 right_arm",
                "31-34 base_command",
                "10 rows at 50 a second make 10 control steps of 20 ms: 1 call of send_joint_chunk in the agentic protocol, 1 call in",
                "begins with send_joint_chunk for A: {\"rows\":[[0.01,0.02,0.03,",
            ],
        );
        for (name, _) in crate::PRESETS {
            let told = try_map(&PolicyMap::find(name).unwrap()).unwrap();
            assert!(told.contains("3 robots: "), "{name}: {told}");
            // XPolicyLab has no keys for waist and base.
            let held = told.contains("no key tells waist, base_command: held as at the start");
            assert_eq!(held, name == "xpolicylab", "{name}: {told}");
        }
    }

    #[test]
    fn no_more_rows_are_executed_than_an_answer_has() {
        let refused = |chunk: &str| try_map(&map(chunk)).unwrap_err().to_string();
        let text = refused("[chunk]\nexecute = 9999");
        assert!(
            text.contains("at most 100 rows, of which [chunk] execute = 9999 are to be executed"),
            "{text}"
        );
        assert!(refused("[chunk]\nexecute = 101").contains("execute = 101 are to be executed"));
        check(
            "[chunk]\nexecute = 100",
            &["leaves rows open: an answer of fewer than 100 rows is refused", "100 rows at 50 a second"],
        );
        check("[chunk]\nrows = 9999\nexecute = 9999", &["actions [9999, 35]", "9999 rows at 50 a second"]);
        assert!(!tried("[chunk]\nrows = 50\nexecute = 20").contains("leaves rows open"));
    }

    #[test]
    fn what_goes_where_is_told() {
        check(
            "scope = \"global\"\nanswer = \"all\"\n[images]\n\"eyes > {robot}\" = { camera = \"egocentric\" }\n\
             \"room\" = { camera = \"third_person\", size = [8, 6] }\n[state]\n\"{robot}\" = [\"waist\"]\n[action]\n\
             \"\" = [\"left_arm\", \"vx_m_s\"]\n[history]\nlength = 2\nform = \"list\"\n",
            &[
                "3 robots: one request for A, B, C together:",
                "eyes > C list of 2, each uint8 [240, 320, 3] the camera in the robot's head",
                "room list of 2, each uint8 [6, 8, 3] the room, which results note",
                "(the answer itself) [rows, 24] 0-6 left_arm of A, 7 vx_m_s of A, 8-14 left_arm of B",
                "no key tells right_arm, left_hand, right_hand, waist, vy_m_s, yaw_rate_rad_s, pelvis_height_m: held",
            ],
        );
        check(
            "[action]\n\"a\" = [\"left_wrist_yaw_joint\", \"waist\"]\n[chunk]\ndelta = [\"left_wrist_yaw_joint\"]",
            &["a [rows, 4] 0 left_wrist_yaw_joint (added to what was observed), 1-3 waist"],
        );
        check(
            "[action]\n\"a\" = [\"left_arm\", \"waist\"]\n[chunk]\ndelta = [\"left_elbow_joint\"]",
            &["a [rows, 10] 0-6 left_arm (left_elbow_joint added to what was observed), 7-9 waist"],
        );
        check(
            "[action]\n\"a\" = [\"left_wrist_position\", \"left_wrist_rows_6d\"]\n\"h\" = [\"left_hand\", \"pelvis_height_m\"]\n\
             [chunk]\nrows = 30\nexecute = 15\nrate_hz = 15\nwrist_frame = \"wrist\"\ndelta = [\"left_wrist\", \"left_hand\"]",
            &[
                "a [30, 9] 0-2 left_wrist_position (from where it was observed, along its own axes), 3-8 left_wrist_rows_6d",
                "h [30, 8] 0-6 left_hand (added to what was observed), 7 pelvis_height_m",
                "arms and waist follow the wrists by inverse kinematics",
                "no key tells right_hand, vx_m_s, vy_m_s, yaw_rate_rad_s: held",
                "15 rows at 15 a second make 50 control steps of 20 ms, with even steps from row to row: 15 calls of move_wrists",
                "\"left_position_m\":[0.01,0.02,0.03]",
                "\"steps\":3",
            ],
        );
    }
}
