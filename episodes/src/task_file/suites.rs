//! Suites of our own beside the benchmark: tasks' files that the binary carries, reported apart from the ten tasks.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use super::task_of;
use crate::tasks::{Task, TaskSet, TaskSource};

/// Tasks in which one robot has to tell the others something.
pub const TANDEM_PLUS: &str = "tandem+";

/// File names and texts, in the order in which they are listed.
const FILES: &[(&str, &str)] = &[
    ("which_one.toml", include_str!("../../tasks/which_one.toml")),
    ("blind_carry.toml", include_str!("../../tasks/blind_carry.toml")),
    ("relay.toml", include_str!("../../tasks/relay.toml")),
    ("set_the_table.toml", include_str!("../../tasks/set_the_table.toml")),
    ("swap.toml", include_str!("../../tasks/swap.toml")),
];

static TASKS: LazyLock<Vec<&'static Task>> = LazyLock::new(|| {
    let task = |(name, text): &(&str, &str)| {
        let source = TaskSource { name: (*name).into(), text: (*text).into(), beside: BTreeMap::new() };
        task_of(source).unwrap_or_else(|error| panic!("a task of {TANDEM_PLUS}: {error}"))
    };
    FILES.iter().map(task).collect()
});

/// The tasks of the suite.
pub fn tandem_plus() -> &'static [&'static Task] {
    &TASKS
}

/// The benchmark's tasks, the suite's, and those of files.
pub fn task_set(of_files: Vec<&'static Task>) -> TaskSet {
    TaskSet::with(tandem_plus().to_vec(), of_files)
}

/// The suite of which a source is a file, word for word.
pub(super) fn suite_of(source: &TaskSource) -> Option<&'static str> {
    let same = |(name, text): &(&str, &str)| *name == source.name && *text == source.text;
    FILES.iter().any(same).then_some(TANDEM_PLUS)
}
