//! `tandem robots new`: a description of a robot's MJCF file to start from.

use std::{fmt::Write, path::PathBuf, process::ExitCode};

use tandem_episodes::write_whole;
use tandem_evaluation::draft_robot;

use super::seen_from;
use crate::commands::{CommandResult, print};

/// Write a description of another robot to start from.
#[derive(Debug, clap::Args)]
pub struct RobotsArgs {
    #[command(subcommand)]
    action: RobotsAction,
}

#[derive(Debug, clap::Subcommand)]
enum RobotsAction {
    New(NewRobotArgs),
}

/// Draft the description of a robot's MJCF file: which joint is which, guessed from the tree, the axes of its
/// joints and their names.
#[derive(Debug, clap::Args)]
struct NewRobotArgs {
    /// MJCF file with the robot.
    #[arg(long, value_name = "FILE")]
    from_model: PathBuf,
    /// TOML file to write, for example beside the model. An existing file is kept.
    #[arg(value_name = "OUT")]
    out: PathBuf,
}

/// Writes a draft of a robot's description.
pub fn run(args: &RobotsArgs) -> CommandResult {
    let RobotsAction::New(NewRobotArgs { from_model, out }) = &args.action;
    if out.exists() {
        return Err(format!("{} exists already; give another name", out.display()).into());
    }
    let draft = draft_robot(from_model, &seen_from(out, from_model))?;
    write_whole(out, draft.text.as_bytes())?;
    let out = out.display();
    let mut told = draft.notes.iter().fold(String::new(), |mut told, note| {
        // Writing to a string cannot fail.
        let _ = writeln!(told, "note: {note}");
        told
    });
    let _ = writeln!(told, "written: {out}; check it by `tandem doctor --robot {out}`");
    print(&told)?;
    Ok(ExitCode::SUCCESS)
}
