//! The binary `tandem`: `serve`, `demo` and `tasks`.

use std::process::ExitCode;

use clap::Parser;
use tandem::{
    cli::{Cli, Command, print_tasks},
    demo,
    server::Server,
    settings::Settings,
};

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(cli) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("tandem: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: Cli) -> Result<ExitCode, Box<dyn std::error::Error>> {
    let settings = Settings::resolve(cli.layer, cli.config.as_deref())?;
    match cli.command {
        Command::Serve => {
            log_to_stderr("info");
            Server::start(&settings)?.run_until_signal();
            Ok(ExitCode::SUCCESS)
        }
        Command::Demo { seeds } => {
            log_to_stderr("warn");
            demo::run(&settings, seeds)
        }
        Command::Tasks => {
            print_tasks();
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// `TANDEM_LOG` sets what is logged, as `debug` or `tandem=debug`.
fn log_to_stderr(default: &str) {
    let filter = tracing_subscriber::EnvFilter::try_from_env("TANDEM_LOG").unwrap_or_else(|_| default.into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
}
