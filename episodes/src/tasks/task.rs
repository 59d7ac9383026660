//! A task as sessions, plans and reports keep it: the definitions of one file, shared.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use tandem_sim::SplitMix64;

use super::TaskDefinition;

/// Separates the random stream of choices from the stream of offsets.
const CHOICES_STREAM: u64 = 0x6368_6f69_6365_7331;

/// A task. It dereferences to its [`TaskDefinition`], and clones share one file.
#[derive(Clone)]
pub struct Task {
    file: Arc<TaskFile>,
    /// Index among [`TaskFile::variants`]; `None` while no seed is set, and for a file without choices.
    variant: Option<usize>,
}

/// The definitions that a task file contains.
pub(super) struct TaskFile {
    /// Definition while no seed is set; the only one of a file without choices.
    pub undecided: TaskDefinition,
    /// Definitions for each combination of options; empty for a file without choices.
    pub variants: Vec<TaskDefinition>,
}

impl Task {
    /// Returns the task of a file, while no seed is set.
    pub(super) fn undecided(file: Arc<TaskFile>) -> Task {
        Task { file, variant: None }
    }

    /// Returns this task with the options that the seed chooses. A task without choices returns itself.
    pub fn under(&self, seed: u32) -> Task {
        if !self.has_choices() {
            return self.clone();
        }
        // The draw is below its upper end.
        let ends = [0.0, self.file.variants.len() as f32];
        let drawn = SplitMix64(u64::from(seed) ^ CHOICES_STREAM).uniform(ends) as usize;
        Task { file: self.file.clone(), variant: Some(drawn) }
    }

    /// Returns the first variant that `is_chosen` accepts, or else the task while no seed is set.
    pub(super) fn variant(&self, is_chosen: impl FnMut(&TaskDefinition) -> bool) -> Task {
        Task { file: self.file.clone(), variant: self.file.variants.iter().position(is_chosen) }
    }

    /// Returns the definitions for all combinations of options; empty for a file without choices.
    pub fn variants(&self) -> &[TaskDefinition] {
        &self.file.variants
    }

    /// Returns true if the file has choices.
    pub fn has_choices(&self) -> bool {
        !self.file.variants.is_empty()
    }
}

impl Deref for Task {
    type Target = TaskDefinition;

    fn deref(&self) -> &TaskDefinition {
        self.variant.map_or(&self.file.undecided, |index| &self.file.variants[index])
    }
}

impl fmt::Debug for Task {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        fmt::Debug::fmt(&**self, f)
    }
}

/// Tasks are equal if both id and file are. The benchmark has one task for each id; a file may define
/// another with the same id.
impl PartialEq for Task {
    fn eq(&self, other: &Task) -> bool {
        self.id == other.id && self.file_xxh3() == other.file_xxh3()
    }
}
