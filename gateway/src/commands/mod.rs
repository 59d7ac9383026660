//! What `tandem` can do: one file or folder per subcommand, each with its flags and its `run`; what several share is in `flags`.

pub mod about;
pub mod agent;
pub mod bench;
pub mod collect;
pub mod demo;
pub mod doctor;
pub mod evaluate;
pub mod export;
mod flags;
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

/// What a subcommand ends with: an error is printed and is a failure, too.
pub type CommandResult = Result<ExitCode, Box<dyn Error>>;

/// The command line of this process for a shell, without what starts the program.
fn command_to_go_on() -> String {
    let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
    let words: Vec<String> = words.skip_while(|word| word != "evaluate" && word != "collect").collect();
    match words.is_empty() {
        true => "run the same command again".into(),
        false => going_on(&words),
    }
}

/// The command that goes on with what this one has begun, of which nothing is to be deleted.
fn going_on(words: &[String]) -> String {
    let kept = words.iter().filter(|word| *word != "--overwrite").map(|word| shell_word(word));
    std::iter::once("tandem".into()).chain(kept).collect::<Vec<_>>().join(" ")
}

/// Prints a text that other programs may read, without what a terminal would obey. One that has read enough and has gone is no error.
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
