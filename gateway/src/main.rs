//! The binary `tandem`: reads the command line and runs the subcommand that it names.

use std::process::ExitCode;

use mimalloc::MiMalloc;
use tandem::cli::Cli;
use tandem_episodes::printable;

/// Thousands of held episodes leave their pieces all over the C library's few heaps, and every call looks through
/// them; here each thread has its own. Whole huge pages for each would take four times the memory.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    Cli::read().run().unwrap_or_else(|error| {
        // Errors quote files and servers of others.
        eprintln!("tandem: {}", printable(&error.to_string()));
        ExitCode::FAILURE
    })
}
