//! What `tandem` can do: one file per subcommand, each with its flags and its `run`.

pub mod bench;
mod bench_tools;
pub mod collect;
pub mod demo;
pub mod doctor;
mod episode_flags;
pub mod evaluate;
pub mod locomotion;
mod log;
mod machine;
mod played;
mod policy_flags;
pub mod recover;
pub mod replay;
pub mod report;
mod seeds;
pub mod serve;
pub mod tasks;

use std::{error::Error, process::ExitCode};

pub use seeds::Seeds;

/// What the program ends with: an error is printed and is a failure, too.
pub type Outcome = Result<ExitCode, Box<dyn Error>>;
