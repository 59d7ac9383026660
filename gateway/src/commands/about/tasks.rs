//! `tandem tasks`: what there is to play.

use std::{fmt::Write, process::ExitCode};

use tandem_episodes::LocomotionChoice;
use tandem_tools_spec::TaskList;

use crate::commands::{CommandResult, print};

/// List the tasks and their phases.
#[derive(Debug, clap::Args)]
pub struct TasksArgs {
    /// As JSON, as `GET /v1/tasks` has it: with the robots' instructions, the budgets and the limits of the base command.
    #[arg(long)]
    json: bool,
}

/// Prints the tasks as `list_tasks` has them.
pub fn run(args: TasksArgs) -> CommandResult {
    let list = tandem_episodes::task_list(&LocomotionChoice::default().limits());
    let text = match args.json {
        true => serde_json::to_string_pretty(&list)? + "\n",
        false => told(&list),
    };
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

fn told(list: &TaskList) -> String {
    let mut text = String::new();
    // Writing to a text cannot fail.
    for task in &list.tasks {
        let _ = writeln!(text, "{}: {}", task.id, task.instruction);
        for phase in &task.phases {
            let who = if phase.collaborative { "together" } else { "alone" };
            let _ = writeln!(text, "  {} {} ({who}): {}", phase.number, phase.id, phase.description);
        }
    }
    text
}
