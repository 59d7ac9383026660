//! `tandem evaluate`: how far a policy gets, over tasks and seeds.

use std::{path::PathBuf, process::ExitCode};

use tandem_episodes::players;
use tracing_subscriber::filter::LevelFilter;

use super::{
    Outcome,
    episode_flags::{EpisodeFlags, player_parser},
    log, played,
};

/// Play tasks over seeds in parallel worlds and count the phases reached. Goes on where an interrupted run stopped.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Who plays.
    #[arg(long, value_parser = player_parser(), default_value = "expert")]
    policy: &'static players::Entry,
    #[command(flatten)]
    episodes: EpisodeFlags,
    /// Folder for `results.json` and one file per episode.
    #[arg(long, value_name = "DIR", default_value = "runs/evaluation")]
    out: PathBuf,
}

/// Plays and counts.
pub fn run(args: Args) -> Outcome {
    log::to_stderr(LevelFilter::INFO);
    played::play_and_print(&args.episodes.plan(args.policy, false)?, &args.out)?;
    Ok(ExitCode::SUCCESS)
}
