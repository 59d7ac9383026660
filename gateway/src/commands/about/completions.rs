//! `tandem completions`: the completion script for a shell.

use std::process::ExitCode;

use clap_complete::Shell;

use crate::commands::{CommandResult, print};

/// Print a completion script for a shell.
#[derive(Debug, clap::Args)]
pub struct CompletionsArgs {
    /// Shell to complete for.
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// Prints the completion script of `command`.
pub fn run(args: &CompletionsArgs, mut command: clap::Command) -> CommandResult {
    let (name, mut script) = (command.get_name().to_owned(), Vec::new());
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    print(&String::from_utf8(script)?)?;
    Ok(ExitCode::SUCCESS)
}
