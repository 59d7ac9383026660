//! `tandem collect`: demonstrations of the experts.

use std::{path::PathBuf, process::ExitCode};

use tandem_episodes::players;
use tandem_tools_spec::Assistance;
use tracing_subscriber::filter::LevelFilter;

use super::{CommandResult, evaluate::play_and_print, flags::EpisodeFlags, logging::log_to_stderr};

/// Record demonstrations of the experts as MCAP, one folder per episode.
#[derive(Debug, clap::Args)]
pub struct CollectArgs {
    #[command(flatten)]
    episodes: EpisodeFlags,
    /// Folder for the recordings.
    #[arg(long, value_name = "DIR", default_value = "runs/demonstrations")]
    out: PathBuf,
}

/// Plays and records.
pub fn run(args: CollectArgs) -> CommandResult {
    log_to_stderr(LevelFilter::INFO);
    let plan = args.episodes.plan(players::find("expert")?, true, Assistance::Full)?;
    play_and_print(&plan, &args.out)?;
    Ok(ExitCode::SUCCESS)
}
