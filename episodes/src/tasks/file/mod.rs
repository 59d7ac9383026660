//! A task's file: TOML with its scene, robots, objects, randomisation, instructions, budget and phases.
//! The conditions of its phases are expressions ([`crate::conditions`]).
//!
//! A task is built from its texts alone. Recordings and results include these texts, so each of them is
//! enough to restore the task.

mod build;
mod choices;
mod error;
mod filling;
mod phases;
mod reading;
mod rewordings;
mod table;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use tandem_sim::{MAX_TEXT_BYTES, read_text, with_own_separators};
use xxhash_rust::xxh3::xxh3_64;

pub use error::TaskFileError;

use crate::tasks::{self, Task, TaskSource};

/// Cache of all tasks. Tasks live as long as the program, and a server or a report may read the same task
/// thousands of times.
static MADE: Mutex<Vec<&'static Task>> = Mutex::new(Vec::new());

/// Reads a task file and the MJCF files that it names.
///
/// # Errors
///
/// An unreadable file, or the mistakes in the task file.
pub fn read_task(path: &Path) -> Result<&'static Task, TaskFileError> {
    let read = |path: &Path| {
        read_text(path, MAX_TEXT_BYTES).map_err(|source| TaskFileError::Read { path: path.into(), source })
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut source = TaskSource { name, text: read(path)?, beside: BTreeMap::new() };
    let folder = path.parent().unwrap_or(Path::new("."));
    for file in build::files_beside(&source)? {
        source.beside.insert(file.clone(), read(&with_own_separators(folder.join(&file)))?);
    }
    task_of(source)
}

/// Returns the task that a source describes; equal sources share one task.
///
/// # Errors
///
/// The mistakes in the task file.
pub fn task_of(source: TaskSource) -> Result<&'static Task, TaskFileError> {
    let known = |made: &[&'static Task]| {
        let same = |task: &&&'static Task| task.source == source;
        made.iter().find(same).copied()
    };
    if let Some(task) = known(&made()) {
        return Ok(task);
    }
    let xxh3 = fingerprint(&source);
    let task = build::task(&source, &xxh3)?;
    made().push(task);
    Ok(task)
}

fn made() -> std::sync::MutexGuard<'static, Vec<&'static Task>> {
    // No code panics while it holds the lock.
    MADE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn fingerprint(source: &TaskSource) -> String {
    let TaskSource { name: _, text, beside } = source;
    format!("{:016x}", xxh3_64(format!("{:?}", (text, beside)).as_bytes()))
}

/// JSON form of a task for `#[serde(with)]`: the id of a benchmark task, or the whole file of any other.
pub mod by_id_or_file {
    use super::*;

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum NamedTask {
        Id(String),
        File(RecordedTask),
    }

    /// A recorded task file. The id is stored for readers that do not support task files.
    #[derive(Serialize, Deserialize)]
    struct RecordedTask {
        id: String,
        xxh3: String,
        /// Options chosen by the seed, by the name of the choice.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        chosen: BTreeMap<String, String>,
        #[serde(flatten)]
        source: TaskSource,
    }

    pub fn serialize<S: Serializer>(task: &Task, serializer: S) -> Result<S::Ok, S::Error> {
        let id = task.id.to_owned();
        let named = match task.is_benchmark() {
            true => NamedTask::Id(id),
            false => {
                let chosen = task.chosen.iter().map(|chosen| (chosen.name.clone(), chosen.option.clone()));
                let (xxh3, chosen) = (task.xxh3.clone(), chosen.collect());
                NamedTask::File(RecordedTask { id, xxh3, chosen, source: task.source.clone() })
            }
        };
        named.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static Task, D::Error> {
        let RecordedTask { id: _, xxh3, chosen, source } = match NamedTask::deserialize(deserializer)? {
            NamedTask::Id(id) => return tasks::find(&id).map_err(de::Error::custom),
            NamedTask::File(recorded) => recorded,
        };
        let now = fingerprint(&source);
        if now != xxh3 {
            let changed = TaskFileError::Changed { name: source.name, was: xxh3, now };
            return Err(de::Error::custom(changed));
        }
        let task = task_of(source).map_err(de::Error::custom)?;
        let variants = task.variants.get();
        let is_chosen = |task: &&&'static Task| {
            chosen.iter().all(|(name, option)| task.chosen(name) == Some(option.as_str()))
        };
        Ok(variants.and_then(|variants| variants.iter().find(is_chosen)).copied().unwrap_or(task))
    }
}
