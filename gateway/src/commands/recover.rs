//! `tandem recover`: the recording of an episode whose process was killed.

use std::{path::PathBuf, process::ExitCode};

use tandem_episodes::LeftOut;

use super::CommandResult;

/// Recover an interrupted recording: FILE.mcap from FILE.mcap.partial.
#[derive(Debug, clap::Args)]
pub struct RecoverArgs {
    /// Partial recording of an interrupted episode, for example runs/handover-seed0/episode.mcap.partial. It
    /// is not changed.
    #[arg(value_name = "FILE")]
    partial: PathBuf,
}

/// Recovers the recording, and prints the number of its messages and its duration.
pub fn run(args: RecoverArgs) -> CommandResult {
    let recovered = tandem_episodes::recover(&args.partial)?;
    println!(
        "{}: {} messages, up to {:.2} s of the episode",
        recovered.path.display(),
        recovered.messages,
        recovered.last_s
    );
    if let Some(LeftOut { damage, bytes }) = recovered.left_out {
        println!("the last {bytes} bytes of {} were left out: {damage}", args.partial.display());
    }
    if recovered.unchecked_metadata > 0 {
        println!("the metadata have no checksum there, and were taken as they are");
    }
    Ok(ExitCode::SUCCESS)
}
