//! What `tandem` can do: one file or folder per subcommand, each with its flags and its `run`; what several share is in `flags`.

pub mod bench;
pub mod collect;
pub mod demo;
pub mod doctor;
pub mod evaluate;
mod flags;
pub mod locomotion;
mod logging;
pub mod recover;
pub mod replay;
pub mod report;
pub mod serve;
pub mod tasks;

use std::{error::Error, process::ExitCode};

pub use flags::Seeds;

/// What a subcommand ends with: an error is printed and is a failure, too.
pub type CommandResult = Result<ExitCode, Box<dyn Error>>;
