//! The command line.

use std::path::PathBuf;

use clap::{Parser, Subcommand};

use crate::{seeds::Seeds, settings::Layer};

/// Physics of humanoids that must work together, behind an HTTP API.
#[derive(Debug, Parser)]
#[command(name = "tandem", version)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What `tandem` can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Serve episodes over HTTP until SIGINT or SIGTERM.
    Serve {
        /// TOML file with any of the settings below; flags and environment come first.
        #[arg(long, env = "TANDEM_CONFIG", value_name = "FILE")]
        config: Option<PathBuf>,
        /// Settings given as flags or environment.
        #[command(flatten)]
        flags: Layer,
    },
    /// Play the Handover task by a scripted expert over real HTTP, and write what happened.
    Demo {
        /// One seed, or a range of seeds as 0..9, both ends included.
        #[arg(long = "seed", default_value = "0", value_name = "SEED")]
        seeds: Seeds,
        /// Folder that the results are written to, one folder per episode.
        #[arg(long, env = "TANDEM_RUNS", default_value = "runs", value_name = "DIR")]
        runs: PathBuf,
    },
    /// List the tasks and their phases.
    Tasks,
}

/// Prints the tasks as `list_tasks` has them.
pub fn print_tasks() {
    for task in tandem_episodes::task_list().tasks {
        println!("{}: {}", task.id, task.instruction);
        for phase in task.phases {
            let who = if phase.collaborative { "together" } else { "alone" };
            println!("  {} {} ({who}): {}", phase.id, phase.name, phase.description);
        }
    }
}
