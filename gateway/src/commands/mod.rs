//! What `tandem` can do: one file per subcommand, each with its flags and its `run`.

pub mod bench;
pub mod collect;
pub mod demo;
pub mod doctor;
pub mod evaluate;
mod flags;
pub mod locomotion;
mod log;
mod played;
pub mod recover;
pub mod replay;
pub mod report;
pub mod serve;
pub mod tasks;

use std::{error::Error, process::ExitCode};

pub use flags::Seeds;

/// What the program ends with: an error is printed and is a failure, too.
pub type Outcome = Result<ExitCode, Box<dyn Error>>;
