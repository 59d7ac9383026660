//! Tests of `tandem collect --operators`. The people are replaced by programs that only finish their
//! episodes.

use std::{
    fs,
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

use serde_json::{Value, json};

/// A collection in a separate process, with its printed links.
struct Collecting {
    process: Child,
    base: String,
    /// Tokens of A, of B and of the host.
    tokens: [String; 3],
}

impl Collecting {
    fn start(out: &Path, seeds: &str) -> Collecting {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tandem"));
        command.args(["collect", "--operators", "2", "--tasks", "handover", "--protocol", "benchmark"]);
        command.args(["--seeds", seeds, "--renderer", "cpu", "--no-reports", "--out"]).arg(out);
        let mut process = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut lines = BufReader::new(process.stdout.take().unwrap()).lines().map(Result::unwrap);
        let mut link = |name: &str| {
            let line = lines.next().unwrap();
            let (found, link) = line.split_once(": ").unwrap();
            assert_eq!(found, name);
            let (base, fragment) = link.split_once("/operate#").unwrap();
            (base.to_owned(), fragment.rsplit_once("token=").unwrap().1.to_owned())
        };
        let [(base, a), (_, b), (_, host)] = ["robot A", "robot B", "all links"].map(&mut link);
        // Later output is read, so that the process does not block.
        thread::spawn(move || lines.for_each(drop));
        Collecting { process, base, tokens: [a, b, host] }
    }

    fn ask(&self, token: &str, path: &str, body: Option<Value>) -> (u16, Value) {
        let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
        let (url, header) = (format!("{}{path}", self.base), format!("Bearer {token}"));
        let mut answer = match body {
            Some(body) => agent.post(url).header("authorization", header).send_json(body).unwrap(),
            None => agent.get(url).header("authorization", header).call().unwrap(),
        };
        (answer.status().as_u16(), answer.body_mut().read_json().unwrap_or_default())
    }

    /// Waits for `stage`, and returns the progress at that time.
    fn wait_for(&self, stage: &str) -> Value {
        loop {
            let (status, progress) = self.ask(&self.tokens[0], "/operate/collection", None);
            assert_eq!(status, 200, "{progress}");
            if progress["stage"] == stage {
                return progress;
            }
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Finishes and marks the current episode for both people. Returns its seed.
    fn play(&self, marks: [bool; 2]) -> u64 {
        let progress = self.wait_for("playing");
        let finish =
            format!("/v1/episodes/{}/tools/finish", progress["episode"]["episode_id"].as_str().unwrap());
        let [a, b, _] = &self.tokens;
        assert_eq!(self.ask(a, "/operate/mark", Some(json!({ "good": true }))).0, 409, "it has not ended");
        assert_eq!(self.ask(a, &finish, Some(json!({}))).0, 202);
        assert_eq!(self.ask(b, &finish, Some(json!({}))).0, 200);
        self.wait_for("marking");
        for (token, good) in [a, b].into_iter().zip(marks) {
            let (status, told) = self.ask(token, "/operate/mark", Some(json!({ "good": good })));
            assert_eq!(status, 200, "{told}");
        }
        progress["episode"]["seed"].as_u64().unwrap()
    }

    fn end(mut self) {
        self.wait_for("over");
        assert!(self.process.wait().unwrap().success());
    }
}

#[test]
fn bad_episodes_are_put_aside_and_asked_for_again() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("people");
    let run = Collecting::start(&out, "2000-2001");
    let [a, _, host] = &run.tokens;
    let (_, told) = run.ask(host, "/operate/collection", None);
    assert_eq!(told["operators"][0]["token"], **a);
    let (_, told) = run.ask(a, "/operate/collection", None);
    assert!(told.get("operators").is_none(), "a person gets nobody else's token: {told}");
    assert_eq!(run.ask("0123456789abcdef0123456789abcdef01234567", "/operate/collection", None).0, 401);
    run.wait_for("playing");
    for stand_in in ["/operate/expert", "/operate/policy"] {
        let (status, told) = run.ask(a, stand_in, Some(json!({})));
        assert_eq!((status, &told["title"]), (403, &json!("People drive")), "{told}");
    }
    assert_eq!(run.play([true, true]), 2000);
    assert_eq!(run.play([true, false]), 2001);
    run.end();

    let good = out.join("episodes/handover-2000");
    assert!(["episode.mcap", "result.json", "good"].iter().all(|file| good.join(file).is_file()));
    let bad = place.path().join("people-bad/handover-2001");
    assert_eq!(fs::read_to_string(bad.join("bad")).unwrap(), "marked bad by B\n");
    assert!(bad.join("episode.mcap").is_file() && !out.join("episodes/handover-2001").exists());

    let run = Collecting::start(&out, "2000-2001");
    assert_eq!(run.play([true, true]), 2001, "2000 is there already");
    run.end();
    let results: Value = serde_json::from_slice(&fs::read(out.join("results.json")).unwrap()).unwrap();
    assert_eq!((&results["policy"], results["episodes"].as_array().unwrap().len()), (&json!("people"), 2));
    assert!(out.join("episodes/handover-2001/good").is_file());
}

#[test]
fn each_robot_needs_its_person() {
    let place = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tandem"));
    command
        .args(["collect", "--operators", "2", "--tasks", "move_house", "--out"])
        .arg(place.path().join("x"));
    let said = command.output().unwrap();
    let text = String::from_utf8_lossy(&said.stderr);
    assert!(!said.status.success() && text.contains("give --operators 3"), "{text}");
}
