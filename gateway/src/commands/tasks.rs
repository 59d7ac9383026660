//! `tandem tasks`: what there is to play.

use std::process::ExitCode;

use tandem_episodes::LocomotionChoice;

use super::CommandResult;

/// List the tasks and their phases.
#[derive(Debug, clap::Args)]
pub struct TasksArgs {}

/// Prints the tasks as `list_tasks` has them.
pub fn run(_: TasksArgs) -> CommandResult {
    for task in tandem_episodes::task_list(&LocomotionChoice::default().limits()).tasks {
        println!("{}: {}", task.id, task.instruction);
        for phase in task.phases {
            let who = if phase.collaborative { "together" } else { "alone" };
            println!("  {} {} ({who}): {}", phase.number, phase.id, phase.description);
        }
    }
    Ok(ExitCode::SUCCESS)
}
