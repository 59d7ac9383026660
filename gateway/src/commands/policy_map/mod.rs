//! `tandem policy-map`: maps between robots and learned policies, which are tried without a policy.

use std::process::ExitCode;

use clap::{Subcommand, builder::PossibleValuesParser};
use tandem_policies::{PRESETS, PolicyMap, preset, try_map};

use super::{CommandResult, print};

/// Print a policy map to start from, or try one.
#[derive(Debug, clap::Args)]
pub struct PolicyMapArgs {
    /// Subcommand to run.
    #[command(subcommand)]
    action: MapAction,
}

#[derive(Debug, Subcommand)]
enum MapAction {
    /// Print a preset as TOML; the openpi preset explains each line.
    Show {
        /// Name of the preset.
        #[arg(value_name = "NAME", value_parser = PossibleValuesParser::new(PRESETS.map(|(name, _)| name)))]
        name: String,
    },
    /// Try a map on a made-up observation and answer, with two and with three robots: show the request to the
    /// policy, and the effect of its answer.
    Check {
        /// A TOML file, or a preset.
        #[arg(value_name = "FILE")]
        map: String,
    },
}

/// Prints a map or its report. The program fails if a map cannot be used.
pub fn run(args: PolicyMapArgs) -> CommandResult {
    match args.action {
        MapAction::Show { name } => print(preset(&name).unwrap_or_default())?,
        MapAction::Check { map } => print(&try_map(&PolicyMap::find(&map)?)?)?,
    }
    Ok(ExitCode::SUCCESS)
}
