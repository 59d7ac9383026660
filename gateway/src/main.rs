//! The binary `tandem`: reads the command line and runs the subcommand that it names.

use std::process::ExitCode;

use mimalloc::MiMalloc;
use tandem::cli::Cli;
use tandem_episodes::printable;

/// Allocator of the binary. Calls beside thousands of held episodes are faster than with the C library's few
/// heaps; fifty episodes take 0.5 GB, and with huge pages 1.3.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    Cli::read().run().unwrap_or_else(|error| {
        // Errors quote files and servers of others.
        eprintln!("tandem: {}", printable(&error.to_string()));
        ExitCode::FAILURE
    })
}
