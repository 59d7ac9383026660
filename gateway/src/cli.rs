//! The command line: which subcommands there are.

use clap::{CommandFactory, Parser, Subcommand};

use crate::commands::{
    CommandResult,
    about::{completions, man, tasks},
    agent, bench, collect, demo, doctor, evaluate, export, locomotion, policy_map, recover, replay, report,
    serve,
};

/// Physics of humanoids that must work together, behind an HTTP API.
#[derive(Debug, Parser)]
#[command(name = "tandem", version)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    command: CliCommand,
}

/// What `tandem` can do. The help text of each is the doc comment of its flags.
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
    Recover(recover::RecoverArgs),
    Replay(replay::ReplayArgs),
    Export(export::ExportArgs),
    Report(report::ReportArgs),
    Bench(bench::BenchArgs),
    Doctor(doctor::DoctorArgs),
    Completions(completions::CompletionsArgs),
    Man(man::ManArgs),
}

impl Cli {
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
            CliCommand::Recover(args) => recover::run(args),
            CliCommand::Replay(args) => replay::run(args),
            CliCommand::Export(args) => export::run(args),
            CliCommand::Report(args) => report::run(args),
            CliCommand::Bench(args) => bench::run(args),
            CliCommand::Doctor(args) => doctor::run(args),
            CliCommand::Completions(args) => completions::run(&args, Cli::command()),
            CliCommand::Man(args) => man::run(args, Cli::command()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
