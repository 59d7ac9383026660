//! Tests of SIGKILL during rendering and during episodes: the next run does only the missing work.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use crate::Delays;

const KILLS: usize = 5;

fn tandem(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tandem"));
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Runs the program to its end and returns its output.
fn finish(arguments: &[&str]) -> String {
    let output = tandem(arguments).output().expect("the program starts");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn start_and_kill(arguments: &[&str], delays: &mut Delays, most_ms: u64) {
    let mut child = tandem(arguments).spawn().expect("the program starts");
    thread::sleep(delays.next(most_ms));
    child.kill().expect("it is killed, or has ended");
    child.wait().expect("it ends");
}

/// Returns every complete file below `folder` with its content.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("an entry")) {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_none_or(|extension| extension != "partial") {
            found.insert(path.clone(), std::fs::read(path).expect("a file"));
        }
    }
    found
}

fn below(files: BTreeMap<PathBuf, Vec<u8>>, folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let name = |path: PathBuf| path.strip_prefix(folder).map(PathBuf::from).expect("it lies below");
    files.into_iter().map(|(path, bytes)| (name(path), bytes)).collect()
}

/// Returns the files that mark episodes as played. The folder of an episode without such a file may be
/// written again.
fn played(episodes: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let all = files(episodes).into_iter();
    all.filter(|(path, _)| path.parent() == Some(episodes) && path.extension().is_some_and(|e| e == "json"))
        .collect()
}

#[test]
fn kills_lose_nothing_but_the_episode_and_the_picture_under_way() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = |path: &Path| path.to_str().expect("UTF-8").to_owned();
    let demos = text(&folder.path().join("demos"));
    let play = [
        "evaluate",
        "--record",
        "--tasks",
        "pouring",
        "--seeds",
        "0-2",
        "--protocol",
        "benchmark",
        "--out",
        &demos,
    ];
    let mut delays = Delays(5);
    let results = || played(&folder.path().join("demos/episodes"));
    for _ in 0..KILLS {
        let before = results();
        start_and_kill(&play, &mut delays, 1500);
        let after = results();
        for (path, bytes) in &before {
            assert_eq!(after.get(path), Some(bytes), "{} was played and is played again", path.display());
        }
    }
    let kept = results();
    finish(&play);
    let whole = results();
    assert!(kept.iter().all(|(path, bytes)| whole.get(path) == Some(bytes)));
    assert!(whole.keys().any(|path| path.ends_with("pouring-2.json")), "{:?}", whole.keys());

    let recording = text(&folder.path().join("demos/episodes/pouring-0/episode.mcap"));
    let verified = finish(&["replay", &recording, "--verify"]);
    assert!(verified.contains("  verified: "), "{verified}");
    let [once, often] = ["once", "often"].map(|name| folder.path().join(name));
    let draw = |out: &str| {
        ["replay", &recording, "--rate", "10", "--size", "64x48", "--render", out].map(str::to_owned)
    };
    let run = |out: &Path| draw(&text(out));
    let arguments = run(&often);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut drawn = 0;
    for _ in 0..KILLS {
        start_and_kill(&arguments, &mut delays, 700);
        let now = files(&often).len();
        assert!(now >= drawn, "{now} files after {drawn}");
        drawn = now;
    }
    finish(&arguments);
    let arguments = run(&once);
    finish(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let [one, other] = [&once, &often].map(|folder| below(files(folder), folder));
    assert!(one.len() > 500 && one == other, "{} and {} files", one.len(), other.len());
}
