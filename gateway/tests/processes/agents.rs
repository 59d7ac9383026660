//! Tests of language models, which Python plays: the start of Python, and the errors if it cannot play. A
//! script replaces Python here. The package's own tests cover the loop.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

use crate::skipped::skipped;

fn tandem(python: &Path, arguments: &[&str]) -> (Output, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tandem"));
    let output = command.env("TANDEM_PYTHON", python).args(arguments).output().expect("the program starts");
    let printed = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    (output, printed.concat())
}

/// Creates an interpreter that runs `what` instead of the loop, or `when_checked` if it gets the flag
/// `--check`.
#[cfg(unix)]
fn interpreter(folder: &Path, when_checked: &str, what: &str) -> std::path::PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let path = folder.join("python");
    let text = format!("#!/bin/sh\ncase \" $* \" in *\" --check \"*) {when_checked};; esac\n{what}\n");
    fs::write(&path, text).expect("a script");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("a script that runs");
    path
}

#[test]
fn what_is_missing_is_said_before_an_episode_begins() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let out = out.to_str().expect("UTF-8");
    let evaluate =
        ["evaluate", "--policy", "agent:m", "--tasks", "handover", "--seeds", "2000", "--out", out];
    let agent = ["agent", "--model", "m", "--seed", "2000", "--runs", out];
    let check = |python: &Path, says: &str| {
        for arguments in [&evaluate[..], &agent] {
            let (output, printed) = tandem(python, arguments);
            assert!(!output.status.success() && printed.contains(says), "{arguments:?}: {printed}");
            assert!(!Path::new(out).exists(), "{arguments:?}: {printed}");
        }
    };
    check(Path::new("/no/python"), "/no/python cannot be started");
    check(Path::new("/no/python"), "pip install 'tandem-sim[agents]'");
    #[cfg(unix)]
    {
        let missing = "echo 'python: No module named tandem' >&2; exit 1";
        check(&interpreter(folder.path(), missing, "exit 9"), "pip install 'tandem-sim[agents]'");
        let refused = "echo 'tandem agent: no key for m; set OPENAI_API_KEY' >&2; exit 1";
        check(&interpreter(folder.path(), refused, "exit 9"), "tandem: no key for m; set OPENAI_API_KEY");
    }
}

#[cfg(unix)]
#[test]
fn a_model_plays_as_a_program_does() {
    if Command::new("curl").arg("--version").output().is_err() {
        return skipped("there is no curl");
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let post =
        "curl -sf -X POST -H \"Authorization: Bearer $TANDEM_TOKEN\" -H 'content-type: application/json'";
    let finish = format!(
        "echo \"$@\"; {post} -d '{{\"steps\": 5}}' \"$TANDEM_URL/v1/episodes/$TANDEM_EPISODE/tools/wait\" > /dev/null; \
         {post} -d '{{}}' \"$TANDEM_URL/v1/episodes/$TANDEM_EPISODE/tools/finish\" > /dev/null"
    );
    let python = interpreter(folder.path(), "exit 0", &finish);
    let out = folder.path().join("out");
    let policy = "agent:org/m:8b?api=openai-chat&base-url=http://127.0.0.1:1/v1&max-usd=2";
    let evaluate = ["evaluate", "--policy", policy, "--tasks", "handover", "--seeds", "2000", "--out"];
    let (output, printed) = tandem(&python, &[&evaluate[..], &[out.to_str().expect("UTF-8")]].concat());
    assert!(output.status.success(), "{printed}");
    let read = |name: &str| fs::read_to_string(out.join(name)).expect(name);
    let results: Value = serde_json::from_str(&read("results.json")).expect("JSON");
    assert_eq!(results["policy"], "agent:org/m:8b", "{results}");
    let settings = &results["policy_settings"];
    assert_eq!((&settings["api"], &settings["max_usd"]), (&"openai-chat".into(), &2.into()), "{settings}");
    let said = "-m tandem.agent --model=org/m:8b --api=openai-chat --base-url=http://127.0.0.1:1/v1 --max-usd=2 --max-seconds=3300\n";
    assert_eq!(read("episodes/handover-2000/stdout.txt"), said);
    let (output, printed) =
        tandem(&python, &["evaluate", "--policy", "agent:m?colour=red", "--tasks", "handover"]);
    assert!(!output.status.success() && printed.contains("one of api, base-url"), "{printed}");
}

#[cfg(unix)]
#[test]
fn a_run_costs_no_more_than_its_limit() {
    if Command::new("curl").arg("--version").output().is_err() {
        return skipped("there is no curl");
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let episode = "\"$TANDEM_URL/v1/episodes/$TANDEM_EPISODE";
    let post =
        "curl -sf -X POST -H \"Authorization: Bearer $TANDEM_TOKEN\" -H 'content-type: application/json'";
    let note = r#"{"kind": "message", "text": "so", "tokens": {"input": 400000, "output": 10000, "cached": 300000}, "usd": 0.7}"#;
    let play = format!(
        "{post} -d '{note}' {episode}/notes\" > /dev/null; {post} -d '{{}}' {episode}/tools/finish\" > /dev/null"
    );
    let python = interpreter(folder.path(), "exit 0", &play);
    let out = folder.path().join("out");
    let out = out.to_str().expect("UTF-8");
    let evaluate = |policy: &str, others: &[&str]| {
        let seeds =
            ["evaluate", "--policy", policy, "--tasks", "handover", "--seeds", "2000-2002", "--jobs", "1"];
        tandem(&python, &[&seeds, others].concat())
    };
    let priced = "agent:m?usd-per-million-input=2&usd-per-million-output=10";
    let (output, printed) = evaluate("agent:m", &["--max-usd", "1", "--out", out]);
    assert!(!output.status.success() && printed.contains("--max-usd needs prices"), "{printed}");
    let (output, printed) = evaluate(priced, &["--max-usd", "1.5", "--out", out]);
    assert!(!output.status.success() && printed.contains("of 3 episodes 2 are played and kept"), "{printed}");
    assert!(printed.contains("the run has cost 1.40 US dollars, and another episode may pass --max-usd 1.5"));
    // Kept episodes count towards the limit.
    let (output, printed) = evaluate(priced, &["--max-usd", "2", "--out", out]);
    assert!(!output.status.success() && printed.contains("of 3 episodes 2 are played and kept"), "{printed}");
    let (output, printed) = evaluate(priced, &["--dry-run", out]);
    assert!(output.status.success(), "{printed}");
    let says = "3 to play; in 2 recorded, models read 400 thousand tokens an episode (300 from a cache) and wrote 10: \
                0.90 US dollars an episode, 2.70 for all";
    assert!(printed.contains(says), "{printed}");
    let nothing = tempfile::tempdir().expect("a temporary folder");
    let (output, printed) = evaluate(priced, &["--dry-run", nothing.path().to_str().expect("UTF-8")]);
    assert!(!output.status.success(), "{printed}");
    let (output, printed) = evaluate(priced, &["--max-usd", "3", "--out", out]);
    assert!(output.status.success(), "{printed}");
}

#[cfg(unix)]
#[test]
fn the_command_gives_a_model_its_server() {
    if Command::new("curl").arg("--version").output().is_err() {
        return skipped("there is no curl");
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let list = "echo \"$@\"; while [ \"$1\" != --url ]; do shift; done; \
                curl -sf -H \"Authorization: Bearer $TANDEM_TOKEN\" \"$2/v1/episodes\"";
    let python = interpreter(folder.path(), "exit 0", list);
    let runs = folder.path().join("runs");
    let agent = ["agent", "--model", "m", "--per-robot", "--task", "pouring", "--seeds", "7-8", "--runs"];
    let (output, printed) = tandem(&python, &[&agent[..], &[runs.to_str().expect("UTF-8")]].concat());
    assert!(output.status.success(), "{printed}");
    for says in
        ["--task pouring --seed 7 --per-robot ", "--task pouring --seed 8 --per-robot ", "{\"episodes\":[]}"]
    {
        assert!(printed.contains(says), "no {says:?} in {printed}");
    }
    let failing = interpreter(folder.path(), "exit 0", "exit 3");
    let (output, printed) = tandem(&failing, &[&agent[..], &[runs.to_str().expect("UTF-8")]].concat());
    assert!(!output.status.success(), "{printed}");
}

#[cfg(unix)]
#[test]
fn who_resumes_an_episode_hands_on_what_is_given_and_no_defaults() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let python = interpreter(runs.path(), "exit 0", "echo \"$@ token $TANDEM_TOKEN\"");
    let folder = runs.path().join("handover-seed3");
    fs::create_dir(&folder).expect("a folder");
    fs::write(
        folder.join("agent.json"),
        r#"{"format": 1, "flags": {"assistance": "paper", "task": "handover"}}"#,
    )
    .expect("a file");
    let folder_text = folder.to_str().expect("UTF-8");
    let given = ["--seed", "3", "--per-robot", "--scene", "room.xml", "--max-usd", "2"];
    let models = ["--robot-model", "B=m?max-usd=1", "--robot-model", "C=n"];
    let resume = [&["agent", "--resume", folder_text][..], &given, &models].concat();
    let arguments = format!(
        "--max-usd=2 --seed=3 --per-robot --robot-model=B=m?max-usd=1 --robot-model=C=n --resume={folder_text} \
         --server-flags={{\"scene\":\"room.xml\"}} token "
    );
    let (output, printed) = tandem(&python, &resume);
    assert!(output.status.success(), "{printed}");
    assert!(printed.starts_with("-m tandem.agent --url http://127.0.0.1:"), "{printed}");
    assert!(printed.contains(&arguments), "no {arguments} in {printed}");
    let (_, printed) = tandem(&python, &["agent", "--seed", "3"]);
    assert!(printed.contains("--model <NAME>|--resume <FOLDER>"), "{printed}");
}
