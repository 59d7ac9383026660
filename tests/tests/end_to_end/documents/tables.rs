//! Tests of the book's tables against the code: tasks and their phases, command-line flags, and routes of
//! the server.

use clap::{Arg, Command, CommandFactory};
use tandem::cli::Cli;
use tandem_episodes::tasks::{self, Task};
use tandem_tests::TestServer;

use super::pages::{BOOK, page};

/// Flags of every subcommand.
const EVERYWHERE: [&str; 2] = ["help", "version"];

#[test]
fn pages_of_tasks_say_what_tasks_are() {
    for task in tasks::built_in() {
        let folder = if task.suite().is_some() { "tasks/plus" } else { "tasks" };
        let text = page(&format!("{BOOK}/{folder}/{}.md", task.id)).text;
        let expected = expected_of(task);
        let missing: Vec<&String> = expected.iter().filter(|part| !text.contains(part.as_str())).collect();
        assert!(missing.is_empty(), "the page of {} does not say {missing:#?}", task.id);
    }
}

/// Returns the texts that the page of a task must contain, word for word.
fn expected_of(task: &Task) -> Vec<String> {
    let robots = task.robots.iter().map(|robot| format!("| {} | {} |", robot.name, robot.instruction));
    let phases = task.phases.iter().enumerate().map(|(index, phase)| {
        let who = if phase.collaborative { "together" } else { "alone" };
        format!("| p{} | `{}` | {who} | {} |", index + 1, phase.id, phase.description)
    });
    let objects = task.objects.iter().filter(|object| object.name == object.file);
    let objects = objects.map(|object| format!("`{}`", object.name));
    let agentic_steps = task.agentic_steps;
    let whole = [
        format!("| all robots | {} |", task.instruction),
        format!("{agentic_steps}, of which 300 are the initial hold | {} |", task.benchmark_steps),
        format!("Scene `{}`", task.scene),
        format!("pictures/{}.png", task.id),
    ];
    whole.into_iter().chain(robots).chain(phases).chain(objects).collect()
}

#[test]
fn the_reference_has_every_flag_with_its_meaning() {
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
        // `doctor` has the same flags as `serve`, to which the book refers.
        if name == "doctor" {
            let serve = subcommands.iter().find(|(name, _)| name == "serve").map(|(_, flags)| flags);
            assert_eq!(serve, Some(flags), "`doctor` takes what `serve` takes");
            continue;
        }
        let rows: Vec<&str> = section.lines().filter_map(|line| line.strip_prefix("| `--")).collect();
        let told: Vec<&str> = rows.iter().filter_map(|row| row.split([' ', '`']).next()).collect();
        let wanted: Vec<&str> = flags.iter().map(|flag| flag.name.as_str()).collect();
        assert_eq!(told, wanted, "flags of {name}");
        for (row, flag) in rows.iter().zip(flags) {
            let meaning = words(&flag.help);
            assert!(
                words(row).contains(&meaning),
                "{name} --{}: the reference does not say {meaning}",
                flag.name
            );
        }
    }
}

/// Flags hidden from `--help` are for experiments, and are documented in one place.
#[test]
fn flags_for_experiments_are_told_of_in_one_place() {
    fn hidden(command: &Command) -> Vec<String> {
        let own = command.get_arguments().filter(|flag| flag.is_hide_set());
        let own = own.filter_map(|flag| flag.get_long().map(str::to_owned));
        own.chain(command.get_subcommands().flat_map(hidden)).collect()
    }
    let text = page(&format!("{BOOK}/concepts.md")).text;
    let section = text.split("\n### ").find(|section| section.starts_with("Finer settings for experiments"));
    let mut told: Vec<&str> = section
        .expect("a section on finer settings")
        .lines()
        .filter_map(|line| line.strip_prefix("| `--")?.split('`').next())
        .collect();
    let mut hidden = hidden(&Cli::command());
    hidden.sort();
    hidden.dedup();
    told.sort_unstable();
    assert_eq!(told, hidden);
}

/// A flag with its help text, without the default and other sources in brackets.
#[derive(Debug, PartialEq)]
struct Flag {
    name: String,
    help: String,
}

impl Flag {
    fn of(argument: &Arg) -> Option<Flag> {
        let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
        let help = help.split(" [default").next().unwrap_or_default().to_owned();
        Some(Flag { name: argument.get_long()?.to_owned(), help })
    }
}

/// Returns the words of a text without punctuation, so that tables may format them freely.
fn words(text: &str) -> String {
    let words = text.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join(" ")
}

/// Collects every subcommand that can be called alone, with its flags.
fn leaves(path: &str, command: &Command, found: &mut Vec<(String, Vec<Flag>)>) {
    let mut below = command.get_subcommands().peekable();
    if below.peek().is_none() || !command.is_subcommand_required_set() {
        let flags = command.get_arguments().filter(|flag| !flag.is_hide_set()).filter_map(Flag::of);
        let own = flags.filter(|flag| !EVERYWHERE.contains(&flag.name.as_str()));
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
