//! Tests of cheats: a policy program attempts them with nothing but its token. Each is refused, or does not
//! affect the score.

use std::{
    env, fs,
    io::Read,
    path::{Path, PathBuf},
    time::Duration,
};

use serde_json::{Value, json};
use tandem::drivers::Program;
use tandem_evaluation::evaluation::{EvaluationPlan, SeedKey};
use tandem_tools_spec::{Driving, EndReason, Operators};

use super::plans::{plan, play};

const LONG: Duration = Duration::from_secs(100);
/// A seed that is distinguishable from every other number in an episode.
const SEED: u32 = 48_611;

/// Returns the command line that starts `cheat` below. It passes the evaluation's folder, as if the program
/// had discovered it.
fn cheat_command(found: &Path) -> String {
    let binary = env::current_exe().expect("this binary");
    format!(
        "FOUND='{}' RUST_BACKTRACE=0 '{}' --exact policies::cheats::cheat --ignored --nocapture",
        found.display(),
        binary.display()
    )
}

/// The program's access to its server.
struct Cheat {
    url: String,
    episode: String,
    token: String,
}

impl Cheat {
    /// Sends a request and returns its status and body.
    fn ask(&self, path: &str, body: Option<Value>) -> (u16, String) {
        let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
        let (url, bearer) = (format!("{}{path}", self.url), format!("Bearer {}", self.token));
        let mut answer = match body {
            Some(body) => agent
                .post(url)
                .header("authorization", bearer)
                .header("accept", "application/json, text/event-stream")
                .send_json(body)
                .expect("an answer"),
            None => agent.get(url).header("authorization", bearer).call().expect("an answer"),
        };
        (answer.status().as_u16(), answer.body_mut().read_to_string().expect("a text"))
    }

    fn tool(&self, name: &str, args: Value) -> (u16, String) {
        self.ask(&format!("/v1/episodes/{}/tools/{name}", self.episode), Some(args))
    }

    fn mcp(&self, name: &str, args: Value) -> String {
        let params = json!({ "name": name, "arguments": args });
        self.ask("/mcp", Some(json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": params })))
            .1
    }

    /// Tries to let another party drive the robots.
    fn try_operating(&self) {
        for path in ["/operate/expert", "/operate/policy", "/operate/enter", "/operate/mark"] {
            tell("operate", json!(self.ask(path, Some(json!({ "good": true }))).0));
        }
        for path in ["/operate", "/operate/policy", "/operate/drive?robots=A", "/operate/collection"] {
            tell("operate", json!(self.ask(path, None).0));
        }
    }

    /// Requests withheld information in other ways, and sends forbidden commands.
    fn try_looking(&self, robot: &str) {
        for frame in ["start", "level"] {
            let look = json!({ "steps": 1, "observe": { "robots": [robot], "frame": frame } });
            tell("look", json!(self.tool("wait", look).0));
            let named = json!({ "steps": 1, "observe": { "frame": frame }, "episode_id": self.episode });
            tell("mcp look", json!(self.mcp("wait", named)));
        }
        for with in
            [json!({ "frame": "start" }), json!({ "keep_waist": true }), json!({ "stand_fast": true })]
        {
            let mut entry = json!({ "robot": robot, "right_position_m": [0.25, -0.2, 0.2] });
            entry.as_object_mut().expect("an object").extend(with.as_object().expect("an object").clone());
            tell("command", json!(self.tool("move_wrists", json!({ "steps": 1, "robots": [entry] })).0));
        }
    }

    /// Tries to start another episode, and returns the request.
    fn try_starting(&self) -> Value {
        let another = json!({ "task": "handover", "seed": SEED, "protocol": "benchmark" });
        tell("start", json!(self.ask("/v1/episodes", Some(another.clone())).0));
        tell("mcp start", json!(self.mcp("start_episode", another.clone())));
        another
    }
}

/// Prints the outcome of a cheat, for the test to read.
fn tell(name: &str, came: Value) {
    println!("\nCHEAT {}", json!({ "name": name, "came": came }));
}

#[test]
#[ignore = "the program that the tests here start"]
fn cheat() {
    let variable = |name: &str| env::var(format!("TANDEM_{name}"));
    let (Ok(url), Ok(episode), Ok(start), Ok(token)) =
        (variable("URL"), variable("EPISODE"), variable("START"), variable("TOKEN"))
    else {
        return;
    };
    let mut brief = String::new();
    std::io::stdin().read_to_string(&mut brief).expect("a brief");
    let (start, cheat) = (PathBuf::from(start), Cheat { url, episode, token });
    let own = |path: &str| cheat.ask(&format!("/v1/episodes/{}{path}", cheat.episode), None).1;
    let told = [
        brief,
        fs::read_to_string(&start).expect("a file"),
        format!("{} {}", start.display(), cheat.episode),
        own(""),
        own("/briefing"),
        cheat.ask("/v1/episodes", None).1,
        cheat.tool("get_status", json!({})).1,
    ];
    tell("told", json!(told));
    let folder = start.parent().expect("a folder");
    tell("folder", json!(mode(folder)));

    let robot = variable("ROBOT").unwrap_or_else(|_| "A".into());
    cheat.try_operating();
    cheat.try_looking(&robot);
    let another = cheat.try_starting();
    let found = PathBuf::from(env::var("FOUND").expect("a folder"));
    forge(&found);
    plant_links(folder, &found);
    tell("finish", json!(cheat.tool("finish", json!({})).1));
    tell("start", json!(cheat.ask("/v1/episodes", Some(another)).0));
    // Forges the results again, after the server has written the true results.
    forge(&found);
}

/// Writes the forged results of a success to the evaluation's folder.
fn forge(found: &Path) {
    let folder = found.join(format!("episodes/handover-{SEED}"));
    let forged = json!({
        "task": "handover", "seed": SEED, "protocol": "benchmark", "phases": { "p1": 1.0, "p2": 2.0, "p3": 3.0 },
        "ended": "finished", "env_steps": 5, "tool_calls": 60, "falls": 0, "realtime_factor": 60.0,
        "state_hash": "7ae670852d40c288", "assistance": "paper",
    });
    fs::write(folder.join("result.json"), forged.to_string()).expect("a folder that was found");
}

#[cfg(unix)]
fn plant_links(folder: &Path, found: &Path) {
    for name in ["brief.txt", "start.json", "stderr.txt"] {
        fs::remove_file(folder.join(name)).expect("its own file");
        std::os::unix::fs::symlink(found.join("secret.txt"), folder.join(name)).expect("a link");
    }
}

#[cfg(not(unix))]
fn plant_links(_: &Path, _: &Path) {}

#[cfg(unix)]
fn mode(path: &Path) -> u32 {
    use std::os::unix::fs::PermissionsExt;
    fs::metadata(path).expect("a folder").permissions().mode() & 0o777
}

#[cfg(not(unix))]
fn mode(_: &Path) -> u32 {
    0o700
}

/// Returns the outcomes of the cheat with this name, parsed from the output of a program.
fn came(stdout: &str, name: &str) -> Vec<Value> {
    let all =
        stdout.lines().filter_map(|line| serde_json::from_str::<Value>(line.strip_prefix("CHEAT ")?).ok());
    let found: Vec<Value> =
        all.filter(|cheat| cheat["name"] == name).map(|cheat| cheat["came"].clone()).collect();
    assert!(!found.is_empty(), "{name} in {stdout}");
    found
}

fn check_refused(stdout: &str, starts: u16) {
    for told in came(stdout, "told").iter().chain(&came(stdout, "finish")) {
        let told = told.to_string();
        for secret in [SEED.to_string().as_str(), "state_hash", "\\\"seed\\\""] {
            let at = told.find(secret).map(|at| &told[at.saturating_sub(40)..told.len().min(at + 40)]);
            assert_eq!(at, None, "{secret}");
        }
    }
    assert_eq!(came(stdout, "folder"), [json!(0o700)]);
    assert!(came(stdout, "operate").iter().all(|status| *status == 404), "{stdout}");
    assert_eq!(came(stdout, "look"), [422, 422]);
    assert!(came(stdout, "mcp look").iter().all(|text| text.to_string().contains("pelvis frame alone")));
    assert_eq!(came(stdout, "command"), [422, 422, 422]);
    assert!(came(stdout, "start").iter().all(|status| *status == starts), "{stdout}");
    let text = came(stdout, "mcp start")[0].to_string();
    assert!(
        text.contains("isError") && text.contains("for who started") || text.contains("one episode"),
        "{text}"
    );
}

#[test]
fn a_program_that_cheats_gains_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    fs::create_dir_all(&out).expect("a folder");
    fs::write(out.join("secret.txt"), "the bottle is at 0.31, 0.12").expect("a file");
    let program = Program::new(cheat_command(&out), Driving::default(), LONG).expect("settings");
    let evaluation = play(&plan(&program, vec![SEED], true), &out);
    let played = evaluation.episodes.first().unwrap_or_else(|| panic!("{:?}", evaluation.left_out));
    assert_eq!((played.result.ended, played.result.env_steps), (EndReason::Finished, 0));
    assert!(played.result.phases.0.iter().all(|(_, time_s)| time_s.is_none()), "{played:?}");
    assert_eq!((played.result.seed, played.result.state_hash.is_some()), (Some(SEED), true));
    assert_eq!(played.result.extra_information, [""; 0]);
    let kept = out.join(format!("episodes/handover-{SEED}"));
    let read = |name: &str| fs::read_to_string(kept.join(name)).unwrap_or_default();
    let result: Value = serde_json::from_str(&read("result.json")).expect("JSON");
    assert_eq!(result, json!(played.result), "the server's own stands");
    check_refused(&read("stdout.txt"), 403);
    for name in ["brief.txt", "start.json", "stderr.txt"] {
        assert!(!read(name).contains("bottle is at"), "a link was followed");
    }
}

#[test]
fn operators_that_cheat_gain_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("secret.txt"), "the bottle is at 0.31, 0.12").expect("a file");
    let driving = Driving { operators: Some(Operators::PerRobot), patience_s: Some(1.0), talk: None };
    let programs = Program::new(cheat_command(folder.path()), driving, LONG).expect("settings");
    let evaluation = play(&plan(&programs, vec![SEED], true), folder.path());
    let played = evaluation.episodes.first().unwrap_or_else(|| panic!("{:?}", evaluation.left_out));
    assert!(played.result.phases.0.iter().all(|(_, time_s)| time_s.is_none()), "{played:?}");
    assert_eq!((played.result.extra_information.clone(), played.result.env_steps), (vec![], 0));
    for robot in ["A", "B"] {
        let kept = folder.path().join(format!("episodes/handover-{SEED}/{robot}"));
        let stdout = fs::read_to_string(kept.join("stdout.txt")).expect("a file");
        check_refused(&stdout, 403);
    }
}

/// The public seed alone is not enough to simulate the episode; the recording is.
#[test]
fn a_key_of_the_evaluators_draws_other_worlds() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let idle = tandem_episodes::players::find("idle").expect("a player");
    let plain = EvaluationPlan { jobs: 1, ..plan(idle, vec![1], true) };
    let key = SeedKey { fingerprint: "00112233".into(), drawn: [(1, 77)].into() };
    let private = EvaluationPlan { seed_key: Some(key), ..plain.clone() };
    let public = play(&plain, &folder.path().join("public"));
    let keyed = play(&private, &folder.path().join("keyed"));
    let drawn = play(&EvaluationPlan { seeds: vec![77], ..plain }, &folder.path().join("drawn"));
    let hash = |evaluation: &tandem_evaluation::evaluation::Evaluation| {
        evaluation.episodes[0].result.state_hash.clone()
    };
    assert_ne!(hash(&keyed), hash(&public));
    assert_eq!((hash(&keyed), keyed.episodes[0].result.seed), (hash(&drawn), Some(1)));
    assert_eq!(
        keyed.departures,
        ["controller: Tandem's own", "instructions: Tandem's own", "seed key: 00112233"]
    );
    let again = play(&private, &folder.path().join("keyed"));
    assert_eq!(again.episodes, keyed.episodes, "what was played is kept");
    let recording = folder.path().join("keyed/episodes/handover-1/episode.mcap");
    let recording = tandem_episodes::Recording::read(&recording).expect("a recording");
    let verified = tandem_episodes::replay::verify(&recording).expect("it is played again");
    assert_eq!(verified.outcome, tandem_episodes::replay::Verdict::Same);
}

/// A command line is visible to every user on the machine.
#[cfg(unix)]
#[test]
fn examples_put_no_token_on_a_command_line() {
    use std::os::unix::fs::PermissionsExt;
    let place = tempfile::tempdir().expect("a temporary folder");
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../gateway/examples/agents");
    for name in ["claude", "codex"] {
        // Replaces the program that the example runs. The replacement prints its arguments and the contents
        // of files among them.
        let fake = place.path().join(name);
        let script = "#!/bin/sh\necho \"$@\"\nfor word in \"$@\"; do if [ -f \"$word\" ]; then ls -l \"$word\"; cat \"$word\"; fi; done\n";
        fs::write(&fake, script).expect("a file");
        fs::set_permissions(&fake, fs::Permissions::from_mode(0o755)).expect("a program");
        let said = std::process::Command::new("sh")
            .arg(examples.join(format!("{name}.sh")))
            .env("PATH", format!("{}:/usr/bin:/bin", place.path().display()))
            .envs([
                ("TANDEM_URL", "http://127.0.0.1:1"),
                ("TANDEM_TOKEN", "not-for-every-eye"),
                ("TMPDIR", place.path().to_str().expect("UTF-8")),
            ])
            .output()
            .expect("a shell");
        let text = String::from_utf8_lossy(&said.stdout).into_owned();
        let line = text.lines().next().unwrap_or_default();
        assert!(
            said.status.success() && line.contains("mcp") && !line.contains("not-for-every-eye"),
            "{text}"
        );
        assert!(
            name != "claude" || text.contains("Bearer not-for-every-eye") && text.contains("-rw-------"),
            "{text}"
        );
        let left = fs::read_dir(place.path()).expect("a folder").count();
        assert_eq!(left, if name == "claude" { 1 } else { 2 }, "nothing is left behind");
    }
}
