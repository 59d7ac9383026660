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
    /// Measure a part of Tandem on this machine.
    Bench {
        /// Which part.
        #[command(subcommand)]
        part: BenchPart,
    },
}

/// What can be measured on its own.
#[derive(Debug, Subcommand)]
pub enum BenchPart {
    /// Inverse kinematics of both wrists: share of targets reached, iterations, time.
    Ik {
        /// JSON file with targets; without it, 200 are drawn from the robot's joint ranges.
        #[arg(long, value_name = "FILE")]
        targets: Option<PathBuf>,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
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
