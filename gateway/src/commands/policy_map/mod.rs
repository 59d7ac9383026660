//! `tandem policy-map`: maps between robots and learned policies, without a policy.

use std::process::ExitCode;

use clap::{Subcommand, builder::PossibleValuesParser};

use super::{CommandResult, print};
use crate::drivers::{PRESETS, PolicyMap, preset, try_map};

/// Print a policy map to start from, or try one.
#[derive(Debug, clap::Args)]
pub struct PolicyMapArgs {
    /// What to do.
    #[command(subcommand)]
    action: MapAction,
}

#[derive(Debug, Subcommand)]
enum MapAction {
    /// Print a preset as TOML; that of openpi says what each line means.
    Show {
        /// The preset.
        #[arg(value_name = "NAME", value_parser = PossibleValuesParser::new(PRESETS.map(|(name, _)| name)))]
        name: String,
    },
    /// Try a map on a made-up observation and a made-up answer, with two robots and with three: say what a policy would be sent,
    /// and what its answer would do.
    Check {
        /// A TOML file, or a preset.
        #[arg(value_name = "FILE")]
        map: String,
    },
}

/// Prints a map or the report on one. The program fails if a map cannot be followed.
pub fn run(args: PolicyMapArgs) -> CommandResult {
    match args.action {
        MapAction::Show { name } => print(preset(&name).unwrap_or_default())?,
        MapAction::Check { map } => print(&try_map(&PolicyMap::find(&map)?)?)?,
    }
    Ok(ExitCode::SUCCESS)
}
