//! The command line: its subcommands.

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser, Subcommand};

use crate::commands::{
    CommandResult,
    about::{completions, examples, man, robots, tasks},
    agent, bench, collect, demo, doctor, evaluate, export, import, leaderboard, locomotion, policy_map,
    recover, replay, report, serve,
};

/// Physics of humanoids that must work together, behind an HTTP API.
#[derive(Debug, Parser)]
#[command(name = "tandem", version)]
pub struct Cli {
    /// Subcommand to run.
    #[command(subcommand)]
    command: CliCommand,
}

/// Subcommands of `tandem`. The help text of each is the doc comment of its flags.
#[derive(Debug, Subcommand)]
enum CliCommand {
    Serve(serve::ServeArgs),
    Agent(agent::AgentArgs),
    Demo(demo::DemoArgs),
    Evaluate(evaluate::EvaluateArgs),
    Collect(collect::CollectArgs),
    PolicyMap(policy_map::PolicyMapArgs),
    Locomotion(locomotion::LocomotionArgs),
    Tasks(tasks::TasksArgs),
    Robots(robots::RobotsArgs),
    Recover(recover::RecoverArgs),
    Replay(replay::ReplayArgs),
    Export(export::ExportArgs),
    Import(import::ImportArgs),
    Report(report::ReportArgs),
    Leaderboard(leaderboard::LeaderboardArgs),
    Bench(bench::BenchArgs),
    Doctor(doctor::DoctorArgs),
    Examples(examples::ExamplesArgs),
    Completions(completions::CompletionsArgs),
    Man(man::ManArgs),
}

impl Cli {
    /// Parses the command line of the process. If it is invalid, prints an error and ends the process.
    pub fn read() -> Cli {
        Cli::try_parse().unwrap_or_else(|error| with_advice(error).exit())
    }

    /// Runs the subcommand that the command line names.
    pub fn run(self) -> CommandResult {
        match self.command {
            CliCommand::Serve(args) => serve::run(args),
            CliCommand::Agent(args) => agent::run(args),
            CliCommand::Demo(args) => demo::run(args),
            CliCommand::Evaluate(args) => evaluate::run(args),
            CliCommand::Collect(args) => collect::run(args),
            CliCommand::PolicyMap(args) => policy_map::run(args),
            CliCommand::Locomotion(args) => locomotion::run(args),
            CliCommand::Tasks(args) => tasks::run(args),
            CliCommand::Robots(args) => robots::run(&args),
            CliCommand::Recover(args) => recover::run(args),
            CliCommand::Replay(args) => replay::run(args),
            CliCommand::Export(args) => export::run(args),
            CliCommand::Import(args) => import::run(args),
            CliCommand::Report(args) => report::run(args),
            CliCommand::Leaderboard(args) => leaderboard::run(args),
            CliCommand::Bench(args) => bench::run(args),
            CliCommand::Doctor(args) => doctor::run(args),
            CliCommand::Examples(args) => examples::run(args),
            CliCommand::Completions(args) => completions::run(&args, Cli::command()),
            CliCommand::Man(args) => man::run(args, Cli::command()),
        }
    }
}

/// Adds advice to an error about `--port`, a flag that other servers have.
fn with_advice(mut error: clap::Error) -> clap::Error {
    if error.get(ContextKind::InvalidArg) == Some(&ContextValue::String("--port".into())) {
        let advice = StyledStr::from("the port is a part of --listen, as in --listen 127.0.0.1:8701");
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![advice]));
    }
    error
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flag_of_other_servers_is_told_by_ours() {
        let told = |flags: &[&str]| {
            let mistake = Cli::try_parse_from([&["tandem", "serve"], flags].concat()).expect_err("a mistake");
            with_advice(mistake).to_string()
        };
        assert!(told(&["--port", "8701"]).contains("tip: the port is a part of --listen"));
        assert!(!told(&["--ports", "8701"]).contains("a part of --listen"));
    }

    #[test]
    fn every_subcommand_says_what_it_does_and_every_flag_what_it_is_for() {
        let mut commands = vec![Cli::command()];
        while let Some(command) = commands.pop() {
            assert!(command.get_about().is_some(), "{} says nothing", command.get_name());
            for flag in command.get_arguments() {
                assert!(flag.get_help().is_some(), "{} {} says nothing", command.get_name(), flag.get_id());
            }
            commands.extend(command.get_subcommands().cloned());
        }
        Cli::command().debug_assert();
    }
}
