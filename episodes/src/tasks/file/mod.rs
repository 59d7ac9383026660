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
mod things;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use tandem_sim::mjcf::Document;
use tandem_sim::{MAX_TEXT_BYTES, read_text, with_own_separators};
use xxhash_rust::xxh3::xxh3_64;

pub use error::TaskFileError;

use crate::tasks::task::TaskFile;
use crate::tasks::{self, SceneFile, Task, TaskDefinition, TaskSource};

/// The files in use. Reading one takes about 5 ms for each of its variants, and the results of a run may
/// refer to the same file thousands of times.
static IN_USE: Mutex<Vec<Weak<TaskFile>>> = Mutex::new(Vec::new());

/// Reads a task file and the MJCF files that it names.
///
/// # Errors
///
/// If a file cannot be read, or the task file has mistakes.
pub fn read_task(path: &Path) -> Result<Task, TaskFileError> {
    let read = |path: &Path| {
        read_text(path, MAX_TEXT_BYTES).map_err(|source| TaskFileError::Read { path: path.into(), source })
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut source = TaskSource { name, text: read(path)?, ..TaskSource::default() };
    let folder = path.parent().unwrap_or(Path::new("."));
    for file in build::files_beside(&source)? {
        let path = with_own_separators(folder.join(&file));
        let text = read(&path)?;
        match Document::names_files(&text) {
            true => drop(source.by_hash.insert(file, SceneFile::of(&path)?)),
            false => drop(source.beside.insert(file, text)),
        }
    }
    task_of(source)
}

/// Returns the task that a source describes; equal sources share one file while it is in use.
///
/// # Errors
///
/// If the task file has mistakes.
pub fn task_of(source: TaskSource) -> Result<Task, TaskFileError> {
    if let Some(file) = in_use(|file| file.undecided.source == source) {
        return Ok(Task::undecided(file));
    }
    let file = Arc::new(build::file(&source, &fingerprint(&source))?);
    files_in_use().push(Arc::downgrade(&file));
    Ok(Task::undecided(file))
}

/// Returns the file in use that `is_wanted` accepts, and forgets those no longer in use.
fn in_use(is_wanted: impl Fn(&TaskFile) -> bool) -> Option<Arc<TaskFile>> {
    let mut files = files_in_use();
    files.retain(|file| file.strong_count() > 0);
    files.iter().filter_map(Weak::upgrade).find(|file| is_wanted(file))
}

fn files_in_use() -> MutexGuard<'static, Vec<Weak<TaskFile>>> {
    // No code panics while it holds the lock.
    IN_USE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn fingerprint(source: &TaskSource) -> String {
    let TaskSource { name: _, text, beside, by_hash } = source;
    let hashes: BTreeMap<&String, &String> = by_hash.iter().map(|(name, file)| (name, &file.xxh3)).collect();
    let content = match hashes.is_empty() {
        true => format!("{:?}", (text, beside)),
        false => format!("{:?}", (text, beside, hashes)),
    };
    format!("{:016x}", xxh3_64(content.as_bytes()))
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
        let id = task.id.clone();
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

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Task, D::Error> {
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
        let is_chosen = |variant: &TaskDefinition| {
            chosen.iter().all(|(name, option)| variant.chosen(name) == Some(option.as_str()))
        };
        Ok(task.variant(is_chosen))
    }
}
