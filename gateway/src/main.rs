//! The binary `tandem`: reads the command line and runs the subcommand that it names.

use std::process::ExitCode;

use tandem::cli::Cli;

fn main() -> ExitCode {
    Cli::read().run().unwrap_or_else(|error| {
        eprintln!("tandem: {error}");
        ExitCode::FAILURE
    })
}
