//! `tandem collect`: demonstrations of the experts.

use std::{path::PathBuf, process::ExitCode};

use tandem_episodes::players;
use tracing_subscriber::filter::LevelFilter;

use super::{Outcome, flags::EpisodeFlags, log, played};

/// Record demonstrations of the experts as MCAP, one folder per episode.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    episodes: EpisodeFlags,
    /// Folder for the recordings.
    #[arg(long, value_name = "DIR", default_value = "runs/demonstrations")]
    out: PathBuf,
}

/// Plays and records.
pub fn run(args: Args) -> Outcome {
    log::to_stderr(LevelFilter::INFO);
    let plan = args.episodes.plan(players::find("expert")?, true)?;
    played::play_and_print(&plan, &args.out)?;
    Ok(ExitCode::SUCCESS)
}
