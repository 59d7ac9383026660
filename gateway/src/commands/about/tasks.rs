//! `tandem tasks`: the list of tasks. `tandem tasks check`: validation of the user's own task. `tandem tasks
//! new`: a task to start from.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
    process::ExitCode,
};

use tandem_episodes::tasks::TaskSet;
use tandem_episodes::{BodyScale, LocomotionChoice, create_private_folder, read_task, write_whole};
use tandem_evaluation::{TaskDraft, check_task, draft_task};
use tandem_tools_spec::TaskList;

use super::seen_from;
use crate::commands::{CommandResult, Seeds, print};

/// List the tasks and their phases, or write and check a task of your own.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct TasksArgs {
    /// Print JSON as in `GET /v1/tasks`, including the robots' instructions, the budgets and the limits of
    /// the base command.
    #[arg(long)]
    json: bool,
    #[command(subcommand)]
    action: Option<TasksAction>,
}

#[derive(Debug, clap::Subcommand)]
enum TasksAction {
    Check(CheckArgs),
    New(NewArgs),
}

/// Check a task's file: every mistake with its line and column, everything that falls without any action, and
/// an image of the start from every camera.
#[derive(Debug, clap::Args)]
struct CheckArgs {
    /// TOML file with the task.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// One seed, or a range of seeds as 0-9 or 0..9, both ends included.
    #[arg(long, value_name = "SEEDS", default_value = "0-4")]
    seeds: Seeds,
    /// Folder for the images [default: runs/tasks and the task's id].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// List what can be moved in a scene, and write a task in it to start from.
#[derive(Debug, clap::Args)]
struct NewArgs {
    /// MJCF file with the scene.
    #[arg(long, value_name = "FILE")]
    from_scene: PathBuf,
    /// TOML file to write, for example beside the scene. An existing file is kept.
    #[arg(value_name = "OUT")]
    out: PathBuf,
}

/// Prints the tasks in the form of `list_tasks`, or the findings for a file.
pub fn run(args: TasksArgs) -> CommandResult {
    match args.action {
        Some(TasksAction::Check(args)) => return check(args),
        Some(TasksAction::New(args)) => return new(&args),
        None => {}
    }
    let limits = LocomotionChoice::default().limits(&BodyScale::G1);
    let list = tandem_episodes::task_list(&TaskSet::default(), None, &limits);
    let text = match args.json {
        true => serde_json::to_string_pretty(&list)? + "\n",
        false => told(&list),
    };
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Checks a file. The program fails if an object falls.
fn check(args: CheckArgs) -> CommandResult {
    let task = read_task(&args.file)?;
    let own = tandem_episodes::task_list(
        &TaskSet::with_files(vec![task.clone()]),
        None,
        &LocomotionChoice::default().limits(&BodyScale::G1),
    );
    let own = TaskList { tasks: own.tasks.into_iter().filter(|info| info.id == task.id).collect(), ..own };
    print(&told(&own))?;
    let folder = args.out.unwrap_or_else(|| Path::new("runs/tasks").join(&task.id));
    create_private_folder(&folder)?;
    let seeds: Vec<u32> = args.seeds.0.collect();
    let found = check_task(&task, &seeds, Some(&folder))?;
    let mut text = String::new();
    for note in &found.notes {
        let _ = writeln!(text, "note: {note}");
    }
    for picture in &found.pictures {
        let _ = writeln!(text, "drawn: {}", picture.display());
    }
    for line in &found.falls {
        let _ = writeln!(text, "falls: {line}");
    }
    if found.falls.is_empty() {
        let _ = writeln!(
            text,
            "nothing falls, and nobody who does not act reaches a phase, with {} seeds",
            seeds.len()
        );
    }
    print(&text)?;
    Ok(if found.falls.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Writes a draft of a task in a scene.
fn new(args: &NewArgs) -> CommandResult {
    if args.out.exists() {
        return Err(format!("{} exists already; give another name", args.out.display()).into());
    }
    let scene_name = seen_from(&args.out, &args.from_scene);
    if !scene_name.ends_with(".xml") {
        return Err(format!("{scene_name} is no MJCF file, whose name ends in .xml").into());
    }
    let TaskDraft { bodies, text, notes } = draft_task(&args.from_scene, &scene_name, &id_of(&args.out))?;
    write_whole(&args.out, text.as_bytes())?;
    let mut told = bodies.join("\n") + "\n";
    for note in notes {
        let _ = writeln!(told, "note: {note}");
    }
    let out = args.out.display();
    let _ = writeln!(told, "written: {out}; check it by `tandem tasks check {out}`");
    print(&told)?;
    Ok(ExitCode::SUCCESS)
}

/// Derives the id of a task from the name of its file.
fn id_of(task: &Path) -> String {
    const LONGEST_ID: usize = 40;
    let stem = task.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    let plain = |letter: char| if letter.is_ascii_alphanumeric() { letter } else { '_' };
    stem.chars().map(plain).take(LONGEST_ID).collect()
}

fn told(list: &TaskList) -> String {
    let mut text = String::new();
    let mut suite = list.tasks.first().and_then(|task| task.suite.as_ref());
    // Writing to a string cannot fail.
    for task in &list.tasks {
        if task.suite.as_ref() != suite {
            suite = task.suite.as_ref();
            let _ = suite.map(|suite| writeln!(text, "\n{suite}, a suite that is reported apart:"));
        }
        let _ = writeln!(text, "{}: {}", task.id, task.instruction);
        for phase in &task.phases {
            let who = if phase.collaborative { "together" } else { "alone" };
            let _ = writeln!(text, "  {} {} ({who}): {}", phase.number, phase.id, phase.description);
        }
    }
    text
}
