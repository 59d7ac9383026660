//! The binary `tandem`: reads the command line and runs the subcommand that it names.

use std::process::ExitCode;

use tandem::cli::Cli;
use tandem_episodes::printable;

fn main() -> ExitCode {
    Cli::read().run().unwrap_or_else(|error| {
        // Errors quote files and servers of others.
        eprintln!("tandem: {}", printable(&error.to_string()));
        ExitCode::FAILURE
    })
}
