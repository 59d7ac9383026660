//! Tests of code blocks: every fence declares a check, and each block that is not a command passes its check.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;
use tandem::settings::{Layer, Settings};
use tandem_policies::PolicyMap;
use tandem_tests::skipped;

use super::{
    command_lines,
    pages::{Block, Page, all_documents, root},
};

/// Scene shown by `xml,scene`.
const SCENE: &str = "episodes/tests/scenes/kitchen/handover.xml";

#[test]
fn every_block_of_code_is_what_its_fence_says() {
    let mut wrong = Vec::new();
    for page in all_documents() {
        for block in page.blocks() {
            if let Err(reason) = check(&block) {
                wrong.push(format!("{}: {reason}", page.at(block.line)));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn commands_in_the_text_are_accepted() {
    let mut wrong = Vec::new();
    for page in all_documents() {
        for (line, words) in page.in_backticks() {
            if let Err(reason) = command_lines::check_mention(&words) {
                wrong.push(format!("{}: {words}: {reason}", page.at(line)));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Checks a block that is not run. Scripts and tool bodies have separate tests.
fn check(block: &Block) -> Result<(), String> {
    match (block.language.as_str(), block.purpose.as_str()) {
        ("sh", "run") => Ok(()),
        ("sh", "check") => command_lines::check(&block.text),
        ("yaml", "") => command_lines::check_args(&block.text),
        ("json", _) => {
            serde_json::from_str::<Value>(&block.text).map(drop).map_err(|error| error.to_string())
        }
        ("toml", "map") => {
            in_a_file(block, |path| PolicyMap::find(path).map(drop).map_err(|error| error.to_string()))
        }
        ("toml", "task") => {
            let path = example(block, "gateway/examples/tasks")?;
            tandem_episodes::read_task(&path).map(drop).map_err(|error| error.to_string())
        }
        ("toml", "robot") => {
            let path = example(block, "gateway/examples/robots")?;
            tandem_episodes::RobotFile::of(&path).map(drop).map_err(|error| error.to_string())
        }
        ("toml", "settings") => in_a_file(block, |path| {
            let settings = Settings::resolve(Layer::default(), Some(path.as_ref()));
            settings.map(drop).map_err(|error| error.to_string())
        }),
        ("python", "" | "run") => compile(block),
        ("xml", "") => parse_xml(&block.text),
        ("xml", "scene") => is_scene(block),
        ("text", "") => Ok(()),
        (language, purpose) => {
            Err(format!("no fence {language:?} with {purpose:?}; see documents/mod.rs for those there are"))
        }
    }
}

/// Returns the path of the file in a folder of the repository whose content equals the block's text.
fn example(block: &Block, folder: &str) -> Result<PathBuf, String> {
    let examples = fs::read_dir(root().join(folder)).map_err(|error| error.to_string())?;
    let is_this = |path: &Path| fs::read_to_string(path).is_ok_and(|text| text == block.text);
    let mut paths = examples.filter_map(|entry| Some(entry.ok()?.path()));
    paths.find(|path| is_this(path)).ok_or_else(|| format!("no file in {folder} has this text"))
}

/// Calls `read` with the path of a temporary file that contains the block's text.
fn in_a_file(block: &Block, read: impl Fn(&str) -> Result<(), String>) -> Result<(), String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(format!("block.{}", block.language));
    fs::write(&path, &block.text).expect("a file in a temporary folder");
    read(path.to_str().expect("a path of ours"))
}

/// Checks that Python compiles a block; skipped without Python.
fn compile(block: &Block) -> Result<(), String> {
    if !is_installed("python3") {
        skipped("no python3 to compile blocks with");
        return Ok(());
    }
    in_a_file(block, |path| {
        let compiled = Command::new("python3").args(["-m", "py_compile", path]).output();
        let compiled = compiled.map_err(|error| error.to_string())?;
        match compiled.status.success() {
            true => Ok(()),
            false => Err(String::from_utf8_lossy(&compiled.stderr).into_owned()),
        }
    })
}

/// Returns true if a program can be run.
pub fn is_installed(program: &str) -> bool {
    succeeds(Command::new(program).arg("--version"))
}

/// Compiles the Python files for users, which no other check compiles.
#[test]
fn examples_are_python() {
    let folders = ["agents", "bridges", "environments", "servers", "training"]
        .map(|folder| root().join("gateway/examples").join(folder));
    let files = folders.iter().flat_map(|folder| fs::read_dir(folder).expect("a folder of examples"));
    let files: Vec<_> = files.map(|file| file.expect("a file").path()).collect();
    let python: Vec<_> =
        files.iter().filter(|file| file.extension().is_some_and(|end| end == "py")).collect();
    assert!(python.len() >= 3, "{files:?}");
    for file in python {
        let text = fs::read_to_string(file).expect("text");
        let compiled = compile(&Block { language: "python".into(), purpose: String::new(), text, line: 1 });
        assert_eq!(compiled, Ok(()), "{}", file.display());
    }
}

/// Returns true if a command succeeds.
pub fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

/// Parses XML. Fragments have no single root, so one is added.
fn parse_xml(text: &str) -> Result<(), String> {
    roxmltree::Document::parse(&format!("<block>{text}</block>")).map(drop).map_err(|error| error.to_string())
}

fn is_scene(block: &Block) -> Result<(), String> {
    let scene = fs::read_to_string(root().join(SCENE)).map_err(|error| error.to_string())?;
    match words(&scene) == words(&block.text) {
        true => Ok(()),
        false => Err(format!("it is not what {SCENE} says")),
    }
}

fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().collect()
}

#[test]
fn blocks_are_found_with_what_their_fences_say() {
    let text = "a\n```sh,run\ntandem tasks\n```\nb `c` d\n```\nx\n```\n";
    let page = Page { path: "a.md".into(), text: text.into() };
    let blocks: Vec<_> = page
        .blocks()
        .into_iter()
        .map(|block| (block.language, block.purpose, block.text, block.line))
        .collect();
    let [one, two] = [("sh", "run", "tandem tasks\n", 2), ("", "", "x\n", 6)];
    let owned = |(language, purpose, text, line): (&str, &str, &str, usize)| {
        (language.to_owned(), purpose.to_owned(), text.to_owned(), line)
    };
    assert_eq!(blocks, [owned(one), owned(two)]);
    assert_eq!(page.prose(), [(1, "a".to_owned()), (5, "b ` d".to_owned())]);
    assert!(check(&page.blocks()[1]).is_err(), "a block has to say what it is");
}
