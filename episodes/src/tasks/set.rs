//! The available tasks: the benchmark's, those of our own suite, and those of files.

use std::sync::LazyLock;

use super::embedded::{COHUB_FILES, Embedded, TANDEM_PLUS_FILES};
use super::file::task_of;
use super::{Task, TaskSource};
use crate::EpisodeError;

static COHUB: LazyLock<Vec<Task>> = LazyLock::new(|| read(COHUB_FILES));
static TANDEM_PLUS_TASKS: LazyLock<Vec<Task>> = LazyLock::new(|| read(TANDEM_PLUS_FILES));

fn read(files: &[Embedded]) -> Vec<Task> {
    files.iter().map(|(name, text)| embedded_task(name, text)).collect()
}

/// Returns the task of an embedded file.
///
/// # Panics
///
/// If the file has a mistake.
pub fn embedded_task(name: &str, text: &str) -> Task {
    let source = TaskSource { name: name.into(), text: text.into(), ..TaskSource::default() };
    task_of(source).unwrap_or_else(|error| panic!("a task of the program: {error}"))
}

/// Returns the benchmark's ten tasks, in its order.
pub fn cohub() -> &'static [Task] {
    &COHUB
}

/// Returns the tasks of the suite [`TANDEM_PLUS`](super::TANDEM_PLUS).
pub fn tandem_plus() -> &'static [Task] {
    &TANDEM_PLUS_TASKS
}

/// Returns every built-in task: the benchmark's, then those of our own suite.
pub fn built_in() -> impl Iterator<Item = &'static Task> + Clone {
    cohub().iter().chain(tandem_plus())
}

/// The available tasks: the built-in ones and those of files.
#[derive(Clone, Debug, Default)]
pub struct TaskSet {
    of_files: Vec<Task>,
}

impl TaskSet {
    /// Returns the built-in tasks and those of files. A task of a file replaces a built-in one with the
    /// same id.
    pub fn with_files(of_files: Vec<Task>) -> TaskSet {
        TaskSet { of_files }
    }

    /// Returns the task of the first file.
    pub fn first_of_files(&self) -> Option<&Task> {
        self.of_files.first()
    }

    /// Returns the benchmark's tasks, then those of suites, then those of files.
    pub fn all(&self) -> impl Iterator<Item = &Task> + Clone {
        let kept = |task: &&Task| self.of_files.iter().all(|other| other.id != task.id);
        cohub().iter().chain(tandem_plus()).filter(kept).chain(&self.of_files)
    }

    /// Returns the task with this id.
    ///
    /// # Errors
    ///
    /// [`EpisodeError::UnknownTask`], which lists the available ones.
    pub fn find(&self, id: &str) -> Result<&Task, EpisodeError> {
        find_in(self.all(), id)
    }
}

/// Returns the benchmark task with this id.
///
/// # Errors
///
/// [`EpisodeError::UnknownTask`], which lists the available ones.
pub fn find(id: &str) -> Result<Task, EpisodeError> {
    find_in(cohub().iter(), id).cloned()
}

fn find_in<'a>(
    mut tasks: impl Iterator<Item = &'a Task> + Clone,
    id: &str,
) -> Result<&'a Task, EpisodeError> {
    let have = tasks.clone();
    tasks.find(|task| task.id == id).ok_or_else(|| {
        let have = have.map(|task| task.id.clone()).collect();
        EpisodeError::UnknownTask { id: id.into(), have }
    })
}

/// Returns the distinct tasks among these: the benchmark's in its order, then those of files in the given
/// order.
pub fn in_order<'a>(played: impl Iterator<Item = &'a Task> + Clone) -> Vec<&'a Task> {
    let mut found: Vec<&Task> =
        cohub().iter().filter(|task| played.clone().any(|one| one == *task)).collect();
    for task in played {
        if !found.contains(&task) {
            found.push(task);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::embedded::TANDEM_PLUS;
    use super::*;

    #[test]
    fn every_task_is_complete() {
        for task in cohub() {
            assert!(find(&task.id).is_ok_and(|found| found.id == task.id));
            let names: Vec<&str> = task.robots.iter().map(|robot| robot.name).collect();
            assert_eq!(names, &["A", "B", "C"][..names.len()], "{}", task.id);
            assert_eq!(task.phases.len(), 3, "{}", task.id);
            assert!(task.is_benchmark() && task.needs_fingers(), "{}", task.id);
        }
        assert!(
            tandem_plus().iter().all(|task| task.suite() == Some(TANDEM_PLUS) && find(&task.id).is_err())
        );
    }

    #[test]
    fn an_unknown_task_lists_those_there_are() {
        let text = find("handove").unwrap_err().to_string();
        assert!(text.starts_with("no task \"handove\"; have: handover"), "{text}");
    }
}
