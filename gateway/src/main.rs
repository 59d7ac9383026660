//! The binary `tandem`: from the command line to what it names.

use std::{io::IsTerminal, process::ExitCode};

use clap::Parser;
use tandem::{
    bench,
    cli::{BenchPart, Cli, Command, LocomotionPart, PolicyChoice, print_tasks},
    demo, evaluate,
    server::Server,
    settings::Settings,
};
use tracing_subscriber::{
    filter::{LevelFilter, Targets},
    layer::SubscriberExt,
    util::SubscriberInitExt,
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
    match cli.command {
        Command::Serve { config, flags } => {
            log_to_stderr(LevelFilter::INFO);
            let settings = Settings::resolve(flags, config.as_deref())?;
            Server::start(&settings)?.run_until_signal();
            Ok(ExitCode::SUCCESS)
        }
        Command::Demo { seeds, runs, locomotion } => {
            log_to_stderr(LevelFilter::WARN);
            let results = demo::play_all(&runs, seeds, locomotion.file)?;
            Ok(if demo::passed(&results) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
        }
        Command::Bench { part: BenchPart::Ik { targets, json } } => {
            bench::ik(targets.as_deref(), json)?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Evaluate { policy, episodes, out } => {
            evaluate::run(&episodes.plan(policy, false)?, &out)?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Collect { episodes, out } => {
            evaluate::run(&episodes.plan(PolicyChoice::Expert, true)?, &out)?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Locomotion { part: LocomotionPart::Bench { locomotion, cases, seeds, json } } => {
            bench::locomotion(&locomotion.load()?, &cases, seeds, json.as_deref())?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Tasks => {
            print_tasks();
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// `TANDEM_LOG` sets what is logged, as `debug` or `tandem=debug`.
fn log_to_stderr(default: LevelFilter) {
    let wanted = std::env::var("TANDEM_LOG").ok().and_then(|text| text.parse::<Targets>().ok());
    let lines = tracing_subscriber::fmt::layer()
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr);
    let filter = wanted.unwrap_or_else(|| Targets::new().with_default(default));
    tracing_subscriber::registry().with(filter).with(lines).init();
}
