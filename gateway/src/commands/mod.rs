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

use tandem_episodes::printable;

pub use flags::Seeds;

/// What a subcommand ends with: an error is printed and is a failure, too.
pub type CommandResult = Result<ExitCode, Box<dyn Error>>;

/// Prints a text that other programs may read, without what a terminal would obey. One that has read enough and has gone is no error.
fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(printable(text).as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}
