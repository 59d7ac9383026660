//! `tandem man`: the manual pages, made from the same texts as `--help`.

use std::{fs, path::PathBuf, process::ExitCode};

use clap::Command;
use clap_mangen::Man;

use crate::commands::{CommandResult, print};

/// Print the manual page, or write one for each subcommand into a folder.
#[derive(Debug, clap::Args)]
pub struct ManArgs {
    /// Folder for `tandem.1`, `tandem-serve.1` and so on [default: `tandem.1` is printed].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Prints the manual page of `command`, or writes its page and the pages of all subcommands.
pub fn run(args: ManArgs, command: Command) -> CommandResult {
    let Some(folder) = args.out else {
        let mut page = Vec::new();
        Man::new(command).render(&mut page)?;
        print(&String::from_utf8(page)?)?;
        return Ok(ExitCode::SUCCESS);
    };
    let told = |error| format!("{}: {error}; give another --out", folder.display());
    fs::create_dir_all(&folder).map_err(told)?;
    clap_mangen::generate_to(command, &folder).map_err(told)?;
    Ok(ExitCode::SUCCESS)
}
