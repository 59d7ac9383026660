//! `tandem evaluate`: how far a policy gets, over tasks and seeds.

use std::{path::PathBuf, process::ExitCode};

use clap::ValueEnum;
use tandem_episodes::evaluation::Policy;

use super::{Outcome, episode_flags::EpisodeFlags, played};

/// Play tasks over seeds in parallel worlds and count the phases reached. Goes on where an interrupted run stopped.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Who plays.
    #[arg(long, value_enum, default_value = "expert")]
    policy: PolicyChoice,
    #[command(flatten)]
    episodes: EpisodeFlags,
    /// Folder for `results.json` and one file per episode.
    #[arg(long, value_name = "DIR", default_value = "runs/evaluation")]
    out: PathBuf,
}

/// Who plays an evaluation.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum PolicyChoice {
    /// The scripted experts.
    Expert,
    /// Nobody: robots hold still.
    Idle,
}

/// Plays and counts.
pub fn run(args: Args) -> Outcome {
    let policy = match args.policy {
        PolicyChoice::Expert => Policy::Expert,
        PolicyChoice::Idle => Policy::Idle,
    };
    played::play_and_print(&args.episodes.plan(policy, false)?, &args.out)?;
    Ok(ExitCode::SUCCESS)
}
