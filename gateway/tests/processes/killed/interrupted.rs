//! Tests of evaluations that signals end, that are killed while a program runs, and that share a folder.

use std::{
    fs,
    io::Read,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;
use tandem_episodes::Recording;

use crate::hangups_are_ignored;
use crate::skipped::skipped;

/// Time limit of every wait.
const DEADLINE: Duration = Duration::from_secs(120);

fn evaluate(policy: &str, seeds: &str, further: &[&str], out: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tandem"));
    command.args(["evaluate", "--policy", policy, "--tasks", "handover", "--protocol", "benchmark"]);
    command.args(["--seeds", seeds]).args(further).arg("--out").arg(out);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

#[track_caller]
fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < DEADLINE, "{what} does not come");
        thread::sleep(Duration::from_millis(20));
    }
}

fn kill(signal: &str, child: &Child) {
    let killed = Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(killed.expect("kill").success());
}

/// Reads all output that the process writes to a pipe.
fn text(pipe: Option<impl Read>) -> String {
    let mut text = String::new();
    pipe.expect("a pipe").read_to_string(&mut text).expect("UTF-8");
    text
}

#[test]
fn a_signal_leaves_a_table_and_the_command_that_goes_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("my run");
    for (signal, kept) in [("-INT", 0), ("-TERM", 1), ("-HUP", 2)] {
        if signal == "-HUP" && hangups_are_ignored() {
            skipped("hangups are ignored here, as under nohup");
            continue;
        }
        let results = || {
            fs::read_dir(out.join("episodes")).map_or(0, |files| {
                let names = files.flatten().map(|file| file.file_name().to_string_lossy().into_owned());
                names.filter(|name| name.ends_with(".json")).count()
            })
        };
        let before = results();
        let mut child = evaluate("idle", "2000-2099", &[], &out).spawn().expect("the program starts");
        wait_until("another episode", || results() > before);
        kill(signal, &child);
        let printed = text(child.stdout.take());
        let status = child.wait().expect("it ends");
        assert_eq!(status.code(), Some(130), "{signal}: {printed}");
        let begun = if kept == 0 { "100 to play, in " } else { " to play, in " };
        assert!(printed.contains(begun), "{signal}: {printed}");
        let first = printed.lines().next().unwrap_or_default();
        assert_eq!(first.contains(" kept, "), kept > 0, "{signal}: {printed}");
        assert!(printed.contains("interrupted; ") && printed.contains(" episodes are kept, "), "{printed}");
        assert!(printed.contains("handover  "), "{signal}: no table in {printed}");
        let go_on = "to go on: tandem evaluate --policy idle --tasks handover --protocol benchmark --seeds 2000-2099 --out '";
        assert!(printed.contains(go_on), "{signal}: {printed}");
    }
}

#[test]
fn a_program_ends_with_an_evaluation_that_is_killed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("group");
    let policy = format!("exec:echo $$ > '{}'; sleep 1000 & wait", file.display());
    let out = folder.path().join("out");
    let mut child = evaluate(&policy, "2000", &[], &out).spawn().expect("the program starts");
    let group = || fs::read_to_string(&file).ok().and_then(|text| text.trim().parse::<u32>().ok());
    wait_until("the program", || group().is_some());
    let group = format!("-{}", group().expect("its number"));
    let lives = || {
        let asked = Command::new("kill").args(["-s", "0", "--", &group]).stderr(Stdio::null()).status();
        asked.expect("kill").success()
    };
    assert!(lives());
    kill("-KILL", &child);
    child.wait().expect("it ends");
    wait_until("the end of the program", || !lives());
}

#[test]
fn two_processes_in_one_folder_tear_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let start = || evaluate("idle", "2000-2002", &["--record"], folder.path()).spawn().expect("it starts");
    let children = [start(), start()];
    for mut child in children {
        let printed = text(child.stdout.take()) + &text(child.stderr.take());
        assert!(child.wait().expect("it ends").success(), "{printed}");
        assert!(printed.contains("handover              3  "), "{printed}");
    }
    for seed in 2000..=2002 {
        let episode = folder.path().join(format!("episodes/handover-{seed}"));
        let text = fs::read_to_string(episode.with_extension("json")).expect("a result");
        let result: Value = serde_json::from_str(&text).expect("JSON");
        let recording = Recording::read(&episode.join("episode.mcap")).expect("a whole recording");
        let recorded = recording.result.expect("its result");
        assert_eq!(recorded.state_hash.as_deref(), result["state_hash"].as_str());
        assert_eq!(Some(u64::from(recorded.env_steps)), result["env_steps"].as_u64());
        let names =
            fs::read_dir(&episode).expect("its folder").map(|entry| entry.expect("a file").file_name());
        assert!(names.into_iter().all(|name| !name.to_string_lossy().ends_with(".partial")));
    }
}

/// Two different runs have two default folders. Repetitions of a run on the same build share a folder.
#[test]
fn runs_have_folders_of_their_own_without_being_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let play = |policy: &str, seeds: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tandem"));
        command.args(["evaluate", "--policy", policy, "--tasks", "handover", "--protocol", "benchmark"]);
        let output = command.args(["--seeds", seeds]).current_dir(folder.path()).output().expect("it starts");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let first = play("idle", "2000");
    assert!(first.contains("1 to play, in runs/idle-benchmark-"), "{first}");
    assert!(play("idle", "2000").contains("1 kept, 0 to play, in runs/idle-benchmark-"));
    assert!(play("idle", "2001").contains("1 to play, in runs/idle-benchmark-"));
    // The program makes no call, which does not affect the name of its folder.
    assert!(play("exec:true", "2000").contains("1 to play, in runs/exec-true-benchmark-"));
    let names = fs::read_dir(folder.path().join("runs")).expect("runs").map(|entry| entry.expect("a run"));
    let mut names: Vec<String> = names.map(|run| run.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    assert_eq!(names.len(), 3, "{names:?}");
    assert!(
        names[0].starts_with("exec-true-benchmark-") && names[1].starts_with("idle-benchmark-"),
        "{names:?}"
    );
}

#[test]
fn a_second_policy_is_refused_in_the_first_ones_folder() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let play = |policy: &str, further: &[&str]| {
        let output = evaluate(policy, "2000", further, folder.path()).output().expect("it starts");
        let printed =
            [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
        (output.status.success(), printed.concat())
    };
    assert!(play("idle", &["--record"]).0);
    let recording = folder.path().join("episodes/handover-2000/episode.mcap");
    let film = fs::read(&recording).expect("a recording");
    let (fared, printed) = play("expert", &[]);
    assert!(!fared && printed.contains("policy is \"expert\", and was \"idle\""), "{printed}");
    assert!(printed.contains("--out") && printed.contains("--overwrite"), "{printed}");
    assert_eq!(fs::read(&recording).expect("it stays"), film);
    let (fared, printed) = play("expert", &["--overwrite"]);
    assert!(fared && printed.contains("1 to play") && !recording.exists(), "{printed}");
}
