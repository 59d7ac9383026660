//! Instructions from a file that replace the tasks' wording: other languages, other styles, a benchmark's
//! exact wording.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use tandem_sim::{BaseLimits, MAX_TEXT_BYTES, read_text};
use tandem_tools_spec::{Instruction, TaskList};

use crate::describe::task_list;
use crate::stress::Stress;
use crate::tasks::TaskSet;
use crate::words::OwnWords;

/// Instructions by task id, as JSON:
///
/// ```json
/// {"handover": {"joint": "what all robots do", "robots": {"A": "what A does", "B": "what B does"}}}
/// ```
///
/// A text that is missing in the file leaves the task's own wording in place.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct Instructions(BTreeMap<String, TaskInstructions>);

#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct TaskInstructions {
    joint: Option<String>,
    #[serde(default)]
    robots: BTreeMap<String, String>,
}

/// Reason why a file of instructions cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum InstructionsError {
    #[error("cannot read the instructions {path}: {source}")]
    Read { path: PathBuf, source: std::io::Error },
    #[error(
        "{path}: {source}; a file that works: {{\"handover\": {{\"joint\": \"...\", \"robots\": {{\"A\": \
         \"...\", \"B\": \"...\"}}}}}}"
    )]
    Parse { path: PathBuf, source: serde_json::Error },
    #[error("{path}: {reason}")]
    Unknown { path: PathBuf, reason: String },
    #[error(
        "{path}: {place} is empty, and nobody would know what to do; write there what is to be done, or \
         leave it out for the task's own words"
    )]
    Empty { path: PathBuf, place: String },
}

impl Instructions {
    /// Reads a file of instructions and checks that its tasks are in `tasks` and its robots are in their
    /// tasks.
    ///
    /// # Errors
    ///
    /// If the file cannot be read or parsed, has an empty text, or names an unknown task or robot.
    pub fn read(path: &Path, tasks: &TaskSet) -> Result<Instructions, InstructionsError> {
        let text = read_text(path, MAX_TEXT_BYTES)
            .map_err(|source| InstructionsError::Read { path: path.into(), source })?;
        let instructions: Instructions = serde_json::from_str(&text)
            .map_err(|source| InstructionsError::Parse { path: path.into(), source })?;
        let unknown = |reason: String| InstructionsError::Unknown { path: path.into(), reason };
        if let Some(place) = instructions.empty_place() {
            return Err(InstructionsError::Empty { path: path.into(), place });
        }
        for (id, own) in &instructions.0 {
            let task = tasks.find(id).map_err(|error| unknown(error.to_string()))?;
            let names: Vec<&str> = task.robots.iter().map(|robot| robot.name).collect();
            if let Some(robot) = own.robots.keys().find(|robot| !names.contains(&robot.as_str())) {
                return Err(unknown(format!("{id} has no robot {robot:?}; have: {}", names.join(", "))));
            }
        }
        Ok(instructions)
    }

    /// Returns the place of the first empty text, task or file; `None` if there is none.
    fn empty_place(&self) -> Option<String> {
        if self.0.is_empty() {
            return Some("the file".into());
        }
        self.0.iter().find_map(|(id, own)| {
            let robots = own.robots.iter().map(|(robot, text)| (format!("{id}.robots.{robot}"), text));
            let mut texts =
                own.joint.iter().map(|text| (format!("{id}.joint"), text)).chain(robots).peekable();
            match texts.peek() {
                None => Some(id.clone()),
                Some(_) => texts.find(|(_, text)| text.trim().is_empty()).map(|(place, _)| place),
            }
        })
    }

    /// Returns the file's wording of `task`; `None` if the file does not name it.
    pub fn own_words(&self, task: &str) -> Option<OwnWords> {
        let TaskInstructions { joint, robots } = self.0.get(task)?.clone();
        Some(OwnWords::of(joint, robots))
    }

    /// Returns `true` if the file names no task.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the reply to `list_tasks` for these tasks in this file's wording, under `stress`. `limits`
    /// are those of the robots' base commands.
    pub fn task_list(&self, tasks: &TaskSet, stress: Option<Stress>, limits: &BaseLimits) -> TaskList {
        let mut list = task_list(tasks, stress, limits);
        for task in &mut list.tasks {
            self.rephrase(&task.id, &mut task.instruction, &mut task.robots);
        }
        list
    }

    fn rephrase(&self, task: &str, joint: &mut String, robots: &mut [Instruction]) {
        let Some(own) = self.0.get(task) else { return };
        if let Some(text) = &own.joint {
            joint.clone_from(text);
        }
        for robot in robots {
            if let Some(text) = own.robots.get(&robot.robot) {
                robot.instruction.clone_from(text);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tandem_sim::body::BodyScale;

    use crate::LocomotionChoice;

    fn read(text: &str) -> Result<Instructions, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("instructions.json");
        std::fs::write(&path, text).unwrap();
        Instructions::read(&path, &TaskSet::default()).map_err(|error| error.to_string())
    }

    #[test]
    fn only_what_the_file_says_changes() {
        let list =
            read(r#"{"handover": {"joint": "Reicht die Flasche weiter.", "robots": {"B": "Nimm sie."}}}"#);
        let limits = LocomotionChoice::default().limits(&BodyScale::G1);
        let list = list.unwrap().task_list(&TaskSet::default(), None, &limits);
        let (own, handover) = (task_list(&TaskSet::default(), None, &limits), &list.tasks[0]);
        assert_eq!(handover.instruction, "Reicht die Flasche weiter.");
        assert_eq!(handover.robots[0], own.tasks[0].robots[0]);
        assert_eq!(handover.robots[1].instruction, "Nimm sie.");
        assert_eq!(list.tasks[1..], own.tasks[1..]);
    }

    #[test]
    fn hashes_tell_words_apart() {
        let hash = |text: &str, task: &str| read(text).unwrap().own_words(task).map(|words| words.xxh3);
        let (one, other) = (r#"{"handover": {"joint": "x"}}"#, r#"{"handover": {"joint": "y"}}"#);
        assert_eq!(hash(one, "handover"), hash(one, "handover"));
        assert_ne!(hash(one, "handover"), hash(other, "handover"));
        assert_eq!((hash(one, "handover").map(|hash| hash.len()), hash(one, "pouring")), (Some(16), None));
    }

    #[test]
    fn mistakes_are_named_with_what_would_work() {
        for (text, expected) in [
            (r#"{"handove": {"joint": "x"}}"#, "no task \"handove\"; have: handover"),
            (r#"{"handover": {"robots": {"C": "x"}}}"#, "handover has no robot \"C\"; have: A, B"),
            (r#"{"handover": {"both": "x"}}"#, "a file that works"),
            ("not JSON", "a file that works"),
            ("{}", "the file is empty"),
            (r#"{"handover": {}}"#, "handover is empty"),
            (r#"{"handover": {"joint": ""}}"#, "handover.joint is empty"),
            (r#"{"handover": {"joint": "x", "robots": {"A": "x", "B": " "}}}"#, "handover.robots.B is empty"),
        ] {
            let message = read(text).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
