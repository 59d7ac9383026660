//! `tandem leaderboard`: one table of policies and models from many run folders.

use std::{fs, path::PathBuf, process::ExitCode};

use tandem_episodes::{build, printable, write_whole};
use tandem_evaluation::reports::{Leaderboard, ReportOrigin, load};

use super::CommandResult;

/// Make one table of policies and models from run folders, beside the benchmark's published figures. Episodes
/// of different protocols, assistance, settings or builds are different rows. A policy of `serve` has the name
/// of its folder; one of `tandem agent`, that of its model.
#[derive(Debug, clap::Args)]
pub struct LeaderboardArgs {
    /// Folders written by `evaluate`, `agent` or `serve`.
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// Folder for `leaderboard.md`, `leaderboard.html` and `leaderboard.json`, whose links are relative to it.
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

/// Reads the results and writes the tables.
pub fn run(args: LeaderboardArgs) -> CommandResult {
    let loaded = load(&args.folders)?;
    fs::create_dir_all(&args.out)?;
    let mut board = Leaderboard::of(&loaded, &args.out);
    board.made = Some(ReportOrigin::here(build()?));
    for (name, text) in board.files()? {
        let path = args.out.join(name);
        write_whole(&path, text.as_bytes())?;
        println!("{}", path.display());
    }
    board.skipped.iter().for_each(|skipped| eprintln!("left out: {}", printable(skipped)));
    Ok(ExitCode::SUCCESS)
}
