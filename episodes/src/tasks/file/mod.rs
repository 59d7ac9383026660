//! A task's file: TOML with its room, robots, objects, randomisation, instructions, budget and phases,
//! whose conditions are expressions ([`crate::conditions`]).
//!
//! A task is made of its texts alone, which recordings and results hold; so whoever has one of those has the task.

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

/// Tasks live as long as the program, and a server or a report may read the same one thousands of times: each is made once.
static MADE: Mutex<Vec<&'static Task>> = Mutex::new(Vec::new());

/// Reads a task's file, and the MJCF files that it names.
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

/// The task that these texts are.
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
    // Nothing panics while it holds the lock.
    MADE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn fingerprint(source: &TaskSource) -> String {
    let TaskSource { name: _, text, beside } = source;
    format!("{:016x}", xxh3_64(format!("{:?}", (text, beside)).as_bytes()))
}

/// A task in JSON: the id of one of the benchmark's, or all of the file of another. For `#[serde(with)]`.
pub mod by_id_or_file {
    use super::*;

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum NamedTask {
        Id(String),
        File(RecordedTask),
    }

    /// Readers that know no such files find the id beside the text.
    #[derive(Serialize, Deserialize)]
    struct RecordedTask {
        id: String,
        xxh3: String,
        /// What the seed has chosen in it.
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
