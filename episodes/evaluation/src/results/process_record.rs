//! Record of the processes that have played in a run's folder, for the header of reports.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use tandem_episodes::{OutputError, shell_word};

use super::machine::Machine;
use super::utc::utc_text;

/// Name of the file in a run's folder that contains a line for each process. Processes append their line in
/// one write, so several may start at once.
pub const PROCESSES_FILE: &str = "processes.jsonl";

/// A process that has played episodes of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProcessRecord {
    /// Its command line.
    pub command: String,
    /// Version and fingerprint of the program.
    pub build: String,
    pub machine: Machine,
    /// Time at which the process began, in UTC.
    pub begun_at: String,
}

impl ProcessRecord {
    /// Describes this process, which runs this build.
    pub fn here(build: &str) -> ProcessRecord {
        ProcessRecord {
            command: command_line(),
            build: build.into(),
            machine: Machine::here(),
            begun_at: utc_text(SystemTime::now()),
        }
    }

    /// Appends the record to the file in `folder`.
    ///
    /// # Errors
    ///
    /// If the file cannot be written.
    pub fn append(&self, folder: &Path) -> Result<(), OutputError> {
        let line = serde_json::to_string(self)? + "\n";
        let path = folder.join(PROCESSES_FILE);
        let file = OpenOptions::new().create(true).append(true).open(&path);
        file.and_then(|mut file| file.write_all(line.as_bytes()))
            .map_err(|source| OutputError::Io { path, source })
    }

    /// Reads the records in `folder`. An incomplete line is skipped; if there is no file, there are no
    /// records.
    pub fn read_all(folder: &Path) -> Vec<ProcessRecord> {
        let text = fs::read_to_string(folder.join(PROCESSES_FILE)).unwrap_or_default();
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    }
}

/// Returns the command line of this process, quoted for a shell, with the program's name in place of its
/// path.
pub fn command_line() -> String {
    in_shell(std::env::args_os().map(|word| word.to_string_lossy().into_owned()))
}

fn in_shell(words: impl Iterator<Item = String>) -> String {
    let name = |program: &str| {
        let name = PathBuf::from(program).file_name().map(|name| name.to_string_lossy().into_owned());
        name.unwrap_or_else(|| program.to_owned())
    };
    let words = words.enumerate().map(|(index, word)| if index == 0 { name(&word) } else { word });
    words.map(|word| shell_word(&word)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processes_are_added_and_torn_lines_left_out() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(ProcessRecord::read_all(folder.path()), []);
        let record = ProcessRecord::here("0.1.0+test");
        assert!(record.machine.cores > Some(0), "{record:?}");
        record.append(folder.path()).unwrap();
        fs::write(
            folder.path().join(PROCESSES_FILE),
            format!("{}\n{{\"command\"", serde_json::json!(record)),
        )
        .unwrap();
        assert_eq!(ProcessRecord::read_all(folder.path()), std::slice::from_ref(&record));
        let absent = record.append(&folder.path().join("none")).unwrap_err();
        assert!(absent.to_string().contains(PROCESSES_FILE), "{absent}");
    }

    #[test]
    fn a_command_line_can_be_run_again() {
        let line = |words: &[&str]| in_shell(words.iter().map(|word| (*word).to_owned()));
        let words = ["/opt/bin/tandem", "evaluate", "--policy", "exec:python a.py", "--out", "runs/a"];
        assert_eq!(line(&words), "tandem evaluate --policy 'exec:python a.py' --out runs/a");
    }
}
