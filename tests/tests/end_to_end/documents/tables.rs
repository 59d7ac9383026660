//! Tables of the book say what the code says: tasks and their phases, flags of the command line, routes of the server.

use clap::{Command, CommandFactory};
use tandem::cli::Cli;
use tandem_episodes::tasks::{self, Task};
use tandem_tests::TestServer;

use super::pages::{BOOK, page};

/// Flags that every subcommand has.
const EVERYWHERE: [&str; 2] = ["help", "version"];

#[test]
fn pages_of_tasks_say_what_tasks_are() {
    for task in tasks::ALL {
        let text = page(&format!("{BOOK}/tasks/{}.md", task.id)).text;
        let expected = expected_of(task);
        let missing: Vec<&String> = expected.iter().filter(|part| !text.contains(part.as_str())).collect();
        assert!(missing.is_empty(), "the page of {} does not say {missing:#?}", task.id);
    }
}

/// What the page of a task has to say, word for word.
fn expected_of(task: &Task) -> Vec<String> {
    let robots = task.robots.iter().map(|robot| format!("| {} | {} |", robot.name, robot.instruction));
    let phases = task.phases.iter().enumerate().map(|(index, phase)| {
        let who = if phase.collaborative { "together" } else { "alone" };
        format!("| p{} | `{}` | {who} | {} |", index + 1, phase.id, phase.description)
    });
    let objects = task.objects.iter().filter(|object| object.name == object.file);
    let objects = objects.map(|object| format!("`{}`", object.name));
    let whole = [
        format!("| all robots | {} |", task.instruction),
        format!("6000, of which 300 are the initial hold | {} |", task.benchmark_steps),
        format!("Scene `{}`", task.scene),
        format!("pictures/{}.png", task.id),
    ];
    whole.into_iter().chain(robots).chain(phases).chain(objects).collect()
}

#[test]
fn the_reference_has_every_flag_of_every_subcommand() {
    let text = page(&format!("{BOOK}/command-line.md")).text;
    let sections: Vec<&str> = text.split("\n## ").skip(1).collect();
    let mut subcommands = Vec::new();
    leaves("", &Cli::command(), &mut subcommands);
    let names: Vec<&str> = subcommands.iter().map(|(name, _)| name.as_str()).collect();
    let titles: Vec<&str> = sections.iter().filter_map(|section| section.lines().next()).collect();
    for title in &titles {
        assert!(names.contains(title), "there is no subcommand {title}");
    }
    for (name, flags) in &subcommands {
        let section = sections.iter().find(|section| section.lines().next() == Some(name));
        let section = section.unwrap_or_else(|| panic!("the reference has no section {name}"));
        // It has the settings of `serve`, and says so.
        if name == "doctor" {
            continue;
        }
        let rows = section.lines().filter_map(|line| line.strip_prefix("| `--"));
        let told: Vec<&str> = rows.filter_map(|row| row.split([' ', '`']).next()).collect();
        assert_eq!(&told, flags, "flags of {name}");
    }
}

/// Every subcommand that has none below it, with its flags.
fn leaves(path: &str, command: &Command, found: &mut Vec<(String, Vec<String>)>) {
    let mut below = command.get_subcommands().peekable();
    if below.peek().is_none() {
        let flags = command.get_arguments().filter_map(|flag| flag.get_long()).map(str::to_owned);
        let own = flags.filter(|flag| !EVERYWHERE.contains(&flag.as_str()));
        found.push((path.trim().to_owned(), own.collect()));
    }
    for subcommand in below {
        leaves(&format!("{path} {}", subcommand.get_name()), subcommand, found);
    }
}

#[test]
fn the_page_about_http_has_every_route() {
    let text = page(&format!("{BOOK}/http.md")).text;
    let server = TestServer::start();
    let document = server.get("/v1/openapi.json").ok();
    let paths = document["paths"].as_object().expect("paths of an OpenAPI description");
    assert!(paths.len() > 4, "{paths:?}");
    for path in paths.keys() {
        // Each tool has a path of its own there.
        let shown = match path.split_once("/tools/") {
            Some((episode, _)) => format!("{episode}/tools/"),
            None => path.clone(),
        };
        let shown = shown.replace("{episode_id}", "{id}");
        assert!(text.contains(&shown), "http.md does not have {path}");
    }
}
