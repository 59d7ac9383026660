//! Tests of command lines in the documents: `tandem` is checked by its own parser. For other programs,
//! the files, packages and tests of this repository that they name must exist.

use std::path::Path;

use clap::{Parser, error::ErrorKind};
use tandem::cli::Cli;

use super::pages::root;

/// External programs whose arguments are not checked.
const OTHERS: [&str; 8] =
    ["claude", "export", "inspect", "jupyter", "jupytext", "mdbook", "ollama", "openssl"];

/// Values for the environment variables of a cluster, with which command lines can be parsed.
const VARIABLES: [(&str, &str); 6] = [
    ("$(JOB_COMPLETION_INDEX)", "0"),
    ("$SLURM_ARRAY_TASK_ID", "0"),
    ("$SLURM_ARRAY_TASK_COUNT", "20"),
    ("$SLURM_CPUS_PER_TASK", "2"),
    ("$SCRATCH", "scratch"),
    ("$PWD", "."),
];

/// Errors of an incomplete command, or of a request for help.
const UNFINISHED: [ErrorKind; 4] = [
    ErrorKind::DisplayHelp,
    ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand,
    ErrorKind::MissingRequiredArgument,
    ErrorKind::MissingSubcommand,
];

/// Checks every command of a script.
pub fn check(script: &str) -> Result<(), String> {
    let script = VARIABLES.iter().fold(script.to_owned(), |text, (name, value)| text.replace(name, value));
    commands(&script).iter().try_for_each(|words| {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        check_command(&words).map_err(|reason| format!("{}: {reason}", words.join(" ")))
    })
}

/// Checks the `args: [...]` of a Kubernetes manifest.
pub fn check_args(manifest: &str) -> Result<(), String> {
    let (_, rest) = manifest.split_once("args: [").ok_or("no args")?;
    let (args, _) = rest.split_once(']').ok_or("args are not closed")?;
    let args = VARIABLES.iter().fold(args.to_owned(), |text, (name, value)| text.replace(name, value));
    let args: Vec<&str> = args.split(',').map(str::trim).collect();
    check_tandem(&args)
}

/// Checks a command mentioned in prose, which may omit required arguments such as a file. Other texts in
/// backticks pass.
pub fn check_mention(text: &str) -> Result<(), String> {
    let found = commands(text);
    let words: Vec<&str> = found.first().into_iter().flatten().map(String::as_str).collect();
    match words.as_slice() {
        ["tandem", "SUBCOMMAND", ..]
        | ["cargo", "run"]
        | ["cargo", "run", "--release", "--"]
        | ["cargo", "+nightly", ..] => Ok(()),
        ["tandem", args @ ..] => match Cli::try_parse_from([&["tandem"], args].concat()) {
            Err(error) if UNFINISHED.contains(&error.kind()) => Ok(()),
            _ if args.is_empty() => Ok(()),
            parsed => parsed.map(drop).map_err(|error| error.to_string()),
        },
        ["cargo" | "python" | "pip", _, ..] => check_command(&words),
        _ => Ok(()),
    }
}

fn check_command(words: &[&str]) -> Result<(), String> {
    let assignments = words.iter().take_while(|word| is_assignment(word)).count();
    match &words[assignments..] {
        [] => Ok(()),
        ["tandem", args @ ..] | ["srun", "tandem", args @ ..] => check_tandem(args),
        ["cargo", args @ ..] => check_cargo(args),
        ["podman", "build", ..] => expect_file("Containerfile"),
        ["podman", "run", args @ ..] => match args.iter().position(|word| *word == "tandem") {
            Some(image) => check_tandem(&args[image + 1..]),
            None => Err("it runs another image".into()),
        },
        ["pip", "install", "-r", file] => expect_file(file),
        ["pip", "install", package] => {
            let folder = package.split('[').next().unwrap_or_default();
            expect_file(&format!("{folder}/pyproject.toml"))
        }
        // The Python package's own command line.
        ["python" | "python3", "-m", "tandem", args @ ..] => match args.is_empty() {
            true => Ok(()),
            false => check_tandem(args),
        },
        ["python" | "python3", "-m", module, ..]
            if module.starts_with("tandem.") || module.starts_with("tandem_") =>
        {
            expect_file(&format!("gateway/python/{}/__main__.py", module.replace('.', "/")))
        }
        ["python" | "python3", file, ..] => expect_file(file),
        [script, ..] if script.starts_with(".ci/") => expect_file(script),
        [program, ..] if OTHERS.contains(program) => Ok(()),
        [program, ..] => Err(format!("nobody knows the program {program}; see OTHERS in command_lines.rs")),
    }
}

fn is_assignment(word: &str) -> bool {
    let name = word.split_once('=').map(|(name, _)| name).unwrap_or_default();
    !name.is_empty() && name.chars().all(|letter| letter.is_ascii_uppercase() || letter == '_')
}

fn check_tandem(args: &[&str]) -> Result<(), String> {
    let parsed = Cli::try_parse_from([&["tandem"], args].concat());
    parsed.map(drop).map_err(|error| error.to_string())
}

fn expect_file(path: &str) -> Result<(), String> {
    match root().join(path).exists() {
        true => Ok(()),
        false => Err(format!("there is no {path}")),
    }
}

/// Checks a subcommand of Cargo, and the packages, features and tests that it names.
fn check_cargo(args: &[&str]) -> Result<(), String> {
    let end = args.iter().position(|word| *word == "--").unwrap_or(args.len());
    let (own, rest) = args.split_at(end);
    if own.first() == Some(&"run") {
        check_tandem(rest.get(1..).unwrap_or_default())?;
    }
    let known = ["bench", "build", "check", "clippy", "deny", "doc", "fmt", "install", "run", "test"];
    match own.first() {
        Some(command) if is_alias(command) => return Ok(()),
        Some(command) if known.contains(command) => {}
        _ => return Err(format!("Cargo has no such command here; have: {}", known.join(", "))),
    }
    for pair in own.windows(2) {
        match pair {
            ["-p", package] => drop(folder_of(package)?),
            ["--features", features] => features.split(',').try_for_each(expect_feature)?,
            ["--test", test] => expect_test(own, test)?,
            _ => {}
        }
    }
    Ok(())
}

/// Returns true if `.cargo/config.toml` has this alias.
fn is_alias(command: &str) -> bool {
    let config = std::fs::read_to_string(root().join(".cargo/config.toml")).unwrap_or_default();
    config.lines().any(|line| line.starts_with(&format!("{command} = ")))
}

/// Returns the folder of a package, for example `sim` for `tandem-sim`.
fn folder_of(package: &str) -> Result<String, String> {
    let name = package.strip_prefix("tandem-").unwrap_or("gateway").replace('-', "_");
    match package.starts_with("tandem") && root().join(&name).join("Cargo.toml").exists() {
        true => Ok(name),
        false => Err(format!("there is no package {package}")),
    }
}

fn expect_feature(feature: &str) -> Result<(), String> {
    let manifest = std::fs::read_to_string(root().join("gateway/Cargo.toml")).expect("a manifest");
    match manifest.lines().any(|line| line.starts_with(&format!("{feature} = ["))) {
        true => Ok(()),
        false => Err(format!("the program has no feature {feature}")),
    }
}

/// Checks that the named package, or any package, has this integration test and the module in its filter.
fn expect_test(args: &[&str], test: &str) -> Result<(), String> {
    let package = args.windows(2).find(|pair| pair[0] == "-p").map(|pair| pair[1]);
    let folders = match package {
        Some(package) => vec![folder_of(package)?],
        None => ["gateway", "episodes", "sim", "ik", "tools_spec", "tests"].map(String::from).into(),
    };
    let targets = folders.iter().map(|folder| root().join(folder).join("tests"));
    let target = targets.map(|tests| tests.join(test)).find(|target| target.join("main.rs").exists());
    let target = target.ok_or_else(|| format!("there is no test {test}"))?;
    let filter = args.iter().skip_while(|word| **word != test).nth(1).filter(|word| !word.starts_with('-'));
    match filter {
        Some(filter) if !is_below(&target, filter) => Err(format!("the test {test} has no file {filter}")),
        _ => Ok(()),
    }
}

/// Returns true if a folder has a module with this name, at any depth.
fn is_below(folder: &Path, module: &str) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    entries.flatten().any(|entry| {
        let path = entry.path();
        path.file_stem().is_some_and(|stem| stem == module) || is_below(&path, module)
    })
}

/// Splits a script into commands and words, with the syntax that the pages use: quotes, comments, pipes,
/// lists and redirections.
fn commands(script: &str) -> Vec<Vec<String>> {
    let script = script.replace("\\\n", " ");
    let mut splitter = Splitter::default();
    let mut letters = script.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '\'' | '"' => {
                let quoted: String = letters.by_ref().take_while(|inner| *inner != letter).collect();
                splitter.push(&quoted);
            }
            '$' if letters.peek() == Some(&'(') => {
                letters.by_ref().take_while(|inner| *inner != ')').for_each(drop);
                splitter.push("1");
            }
            '#' if splitter.word.is_none() => {
                letters.by_ref().take_while(|inner| *inner != '\n').for_each(drop);
                splitter.end_command();
            }
            '>' | '<' => {
                splitter.end_word();
                splitter.redirected = true;
            }
            '\n' | ';' | '|' | '&' => splitter.end_command(),
            ' ' => splitter.end_word(),
            letter => splitter.push(&letter.to_string()),
        }
    }
    splitter.end_command();
    splitter.commands
}

/// State of the splitter of scripts.
#[derive(Default)]
struct Splitter {
    commands: Vec<Vec<String>>,
    command: Vec<String>,
    word: Option<String>,
    /// True if the next word is the file of a redirection.
    redirected: bool,
}

impl Splitter {
    fn push(&mut self, text: &str) {
        self.word.get_or_insert_default().push_str(text);
    }

    fn end_word(&mut self) {
        let Some(word) = self.word.take() else { return };
        match self.redirected {
            true => self.redirected = false,
            false => self.command.push(word),
        }
    }

    fn end_command(&mut self) {
        self.end_word();
        if !self.command.is_empty() {
            self.commands.push(std::mem::take(&mut self.command));
        }
    }
}

#[test]
fn scripts_are_split_as_a_shell_does() {
    let script = "A=1 tandem x \"a b\" \\\n  --y 'c;d' > out & # e\ncurl z|head\nf $(g h)\n";
    let found = commands(script);
    let expected: [&[&str]; 4] =
        [&["A=1", "tandem", "x", "a b", "--y", "c;d"], &["curl", "z"], &["head"], &["f", "1"]];
    assert_eq!(found, expected);
}

#[test]
fn what_would_not_work_is_refused() {
    for script in [
        "tandem evaluate --polcy expert",
        "tandem evaluate --tasks handove",
        "cargo run --release -- serv",
        "cargo dmo",
        "cargo test -p tandem-simulator",
        "cargo test -p tandem-sim --release --test odometri",
        "cargo test -p tandem-sim --release --test simulation odometri",
        "cargo build --release --features onyx",
        "podman run tandem evaluates",
        "pip install -r tests/peers/nothing.txt",
        "python -m tandem.baseline train",
        "rm -r runs",
    ] {
        assert!(check(script).is_err(), "{script}");
    }
    assert!(
        check_mention("tandem replay --verfy").is_err() && check_mention("tandem replay --verify").is_ok()
    );
    check("cargo test -p tandem-sim --release --test simulation odometry").expect("a test that is there");
    check("B=1 srun tandem evaluate --shard $SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT")
        .expect("a command line");
}
