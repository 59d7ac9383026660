//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use tandem_episodes::{
    LocomotionChoice, SimError,
    evaluation::{Plan, Policy},
    tasks::Task,
};
use tandem_tools_spec::Protocol;

use crate::{evaluate, seeds::Seeds, settings::Layer};

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
        #[command(flatten)]
        locomotion: LocomotionFlag,
    },
    /// Play tasks over seeds in parallel worlds and count the phases reached. Goes on where an interrupted run stopped.
    Evaluate {
        /// Who plays.
        #[arg(long, value_enum, default_value = "expert")]
        policy: PolicyChoice,
        #[command(flatten)]
        episodes: EpisodeChoice,
        /// Folder for `results.json` and one file per episode.
        #[arg(long, value_name = "DIR", default_value = "runs/evaluation")]
        out: PathBuf,
    },
    /// Record demonstrations of the experts as MCAP, one folder per episode.
    Collect {
        #[command(flatten)]
        episodes: EpisodeChoice,
        /// Folder for the recordings.
        #[arg(long, value_name = "DIR", default_value = "runs/demonstrations")]
        out: PathBuf,
    },
    /// The base controller.
    Locomotion {
        /// What to do with it.
        #[command(subcommand)]
        part: LocomotionPart,
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

/// Which episodes to play.
#[derive(Debug, Args)]
pub struct EpisodeChoice {
    /// Task ids separated by commas, or `all`.
    #[arg(long, default_value = "all", value_name = "TASKS", value_parser = TaskList::parse)]
    pub tasks: TaskList,
    /// One seed, or a range of seeds as 0-9, both ends included.
    #[arg(long, default_value = "0-9", value_name = "SEEDS")]
    pub seeds: Seeds,
    /// The rules.
    #[arg(long, value_enum, default_value = "agentic")]
    pub protocol: ProtocolChoice,
    /// Worlds that run side by side.
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub jobs: usize,
    #[command(flatten)]
    pub locomotion: LocomotionFlag,
}

/// The base controller on the command line.
#[derive(Debug, Args)]
pub struct LocomotionFlag {
    /// ONNX file with a velocity policy for the G1 in place of our own base controller.
    #[arg(long = "locomotion", env = "TANDEM_LOCOMOTION", value_name = "FILE")]
    pub file: Option<PathBuf>,
}

impl LocomotionFlag {
    /// Reads and checks the file.
    pub fn load(&self) -> Result<LocomotionChoice, SimError> {
        LocomotionChoice::from_file(self.file.as_deref())
    }
}

/// Tasks named on the command line.
#[derive(Debug, Clone)]
pub struct TaskList(pub Vec<&'static Task>);

impl TaskList {
    fn parse(text: &str) -> Result<TaskList, String> {
        evaluate::parse_tasks(text).map(TaskList)
    }
}

/// Who plays an evaluation.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PolicyChoice {
    /// The scripted experts.
    Expert,
    /// Nobody: robots hold still.
    Idle,
}

/// The rules on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum ProtocolChoice {
    Agentic,
    Benchmark,
}

impl EpisodeChoice {
    /// The plan to play these episodes by `policy`.
    pub fn plan(self, policy: PolicyChoice, record: bool) -> Result<Plan, SimError> {
        Ok(Plan {
            policy: match policy {
                PolicyChoice::Expert => Policy::Expert,
                PolicyChoice::Idle => Policy::Idle,
            },
            protocol: match self.protocol {
                ProtocolChoice::Agentic => Protocol::Agentic,
                ProtocolChoice::Benchmark => Protocol::Benchmark,
            },
            locomotion: self.locomotion.load()?,
            tasks: self.tasks.0,
            seeds: self.seeds.0.collect(),
            jobs: self.jobs,
            record,
        })
    }
}

/// What can be done with a base controller.
#[derive(Debug, Subcommand)]
pub enum LocomotionPart {
    /// Stand, walk, squat, carry, be pulled and pushed; report survival, errors and power per case.
    Bench {
        #[command(flatten)]
        locomotion: LocomotionFlag,
        /// Cases whose names contain one of these words, separated by commas.
        #[arg(long, default_value = "", value_name = "WORDS")]
        cases: String,
        /// Seeds per case.
        #[arg(long, default_value_t = 10, value_name = "N")]
        seeds: usize,
        /// JSON file to write.
        #[arg(long, value_name = "OUT")]
        json: Option<PathBuf>,
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
    for task in tandem_episodes::task_list(&LocomotionChoice::default().limits()).tasks {
        println!("{}: {}", task.id, task.instruction);
        for phase in task.phases {
            let who = if phase.collaborative { "together" } else { "alone" };
            println!("  {} {} ({who}): {}", phase.id, phase.name, phase.description);
        }
    }
}
