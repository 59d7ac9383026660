//! The subcommands of `tandem`: one file or folder for each, with its flags and its `run`. Shared flags
//! are in `flags`.

pub mod about;
pub mod agent;
pub mod bench;
pub mod collect;
pub mod demo;
pub mod doctor;
pub mod evaluate;
pub mod export;
mod flags;
pub mod import;
pub mod leaderboard;
pub mod locomotion;
mod logging;
pub mod policy_map;
pub mod recover;
pub mod replay;
pub mod report;
pub mod serve;

use std::{
    error::Error,
    io::{self, Write},
    process::ExitCode,
};

use tandem_episodes::{printable, shell_word};

pub use flags::{Seeds, read_seed_key};

/// Result of a subcommand. An error is printed and makes the program fail.
pub type CommandResult = Result<ExitCode, Box<dyn Error>>;

/// Returns the command that continues this process's run. If the process was not started as `evaluate` or
/// `collect`, returns advice to repeat the command.
fn command_to_go_on() -> String {
    let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
    let words: Vec<String> = words.skip_while(|word| word != "evaluate" && word != "collect").collect();
    match words.is_empty() {
        true => "run the same command again".into(),
        false => going_on(&words),
    }
}

/// Returns the command that continues the run of these `words`, without the flag that deletes results.
fn going_on(words: &[String]) -> String {
    let kept = words.iter().filter(|word| *word != "--overwrite").map(|word| shell_word(word));
    std::iter::once("tandem".into()).chain(kept).collect::<Vec<_>>().join(" ")
}

/// Prints a text that other programs may read, without terminal control characters. A reader that has closed
/// the pipe is not an error.
fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(printable(text).as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::going_on;

    #[test]
    fn what_was_begun_is_not_deleted_by_going_on() {
        let words = ["collect", "--overwrite", "--out", "my runs"].map(String::from);
        assert_eq!(going_on(&words), "tandem collect --out 'my runs'");
    }
}
