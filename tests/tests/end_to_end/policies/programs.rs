//! Tests of agents as programs. The program is this test binary, started again to run `agent` below.

use std::{env, fs, io::Read, path::Path, time::Duration};

use serde_json::{Value, json};
use tandem::drivers::Program;
use tandem_evaluation::results::{Exclusion, PlayedEpisode};
use tandem_evaluation::{
    evaluation::{Evaluation, EvaluationPlan, evaluate},
    reports::{EvaluationReport, ReportFormat, ReportPictures, load},
};
use tandem_tools_spec::{Driving, EndReason, Operators};

use super::plans::{plan, play};

const LONG: Duration = Duration::from_secs(100);

/// Returns the command line that starts `agent` below in this role.
fn agent_command(role: &str) -> String {
    let binary = env::current_exe().expect("this binary");
    format!(
        "ROLE={role} RUST_BACKTRACE=0 '{}' --exact policies::programs::agent --ignored --nocapture",
        binary.display()
    )
}

#[test]
#[ignore = "the program that the tests here start"]
fn agent() {
    let variable = |name: &str| env::var(format!("TANDEM_{name}"));
    let (Ok(url), Ok(id), Ok(start), Ok(token)) =
        (variable("URL"), variable("EPISODE"), variable("START"), variable("TOKEN"))
    else {
        return;
    };
    let mut brief = String::new();
    std::io::stdin().read_to_string(&mut brief).expect("a brief");
    println!("{brief}");
    let start: Value = serde_json::from_slice(&fs::read(start).expect("a file")).expect("JSON");
    assert_eq!((&start["episode_id"], start["action_row"].as_array().map(Vec::len)), (&json!(id), Some(35)));
    let episode = format!("{url}/v1/episodes/{id}");
    let token = format!("Bearer {token}");
    assert!(ureq::get(&episode).call().is_err(), "nobody is let in without the token");
    let tool = |name: &str, args: Value| -> Result<Value, ureq::Error> {
        let request = ureq::post(format!("{episode}/tools/{name}")).header("authorization", &token);
        let reply: Value = request.send_json(args)?.body_mut().read_json()?;
        println!("heard after {name}: {}", reply["heard"]);
        Ok(reply)
    };
    tool("wait", json!({ "steps": 10 })).expect("it waits");
    match env::var("ROLE").as_deref() {
        Ok("finish") => drop(tool("finish", json!({})).expect("it finishes")),
        Ok("operate") => operate(&variable("ROBOT").expect("a robot"), &tool),
        Ok("delete") => {
            drop(ureq::delete(&episode).header("authorization", &token).call().expect("it is deleted"));
        }
        Ok("leave") => eprintln!("it is too hard"),
        Ok("ask_too_much") => drop(tool("wait", json!({ "steps": 1_000_000 })).expect("it waits long")),
        Ok("crash") if env::var("TANDEM_ROBOT").as_deref() != Ok("A") => {
            panic!("the planner has no plan");
        }
        // The partner of a program that crashes later. This partner exits early.
        Ok("leave_partner") if env::var("TANDEM_ROBOT").as_deref() == Ok("A") => {}
        Ok("leave_partner") => {
            tool("wait", json!({ "steps": 5 })).expect("it waits alone");
            panic!("the planner has no plan");
        }
        // The partner of a program that crashes.
        Ok("crash") => while tool("wait", json!({ "steps": 5 })).is_ok() {},
        Ok("hang") => std::thread::sleep(LONG),
        Ok("kill") => {
            let own = std::process::id().to_string();
            std::process::Command::new("kill").args(["-KILL", &own]).status().expect("kill");
            std::thread::sleep(LONG);
        }
        role => panic!("{role:?} is no role"),
    }
}

/// Acts as the program of one robot.
fn operate(robot: &str, tool: &dyn Fn(&str, Value) -> Result<Value, ureq::Error>) {
    let partner = if robot == "A" { "B" } else { "A" };
    assert!(tool("get_robot_state", json!({ "robot": robot })).is_ok());
    assert!(tool("get_robot_state", json!({ "robot": partner })).is_err(), "{partner} is another's");
    tool("say", json!({ "text": format!("I am {robot}.") })).expect("it may talk");
    tool("wait", json!({ "steps": 5 })).expect("both wait");
    tool("finish", json!({})).expect("it finishes");
}

fn program(command: &str, limit: Duration) -> Program {
    Program::new(command.into(), Driving::default(), limit).expect("settings")
}

fn play_one(command: &str, limit: Duration, folder: &Path) -> PlayedEpisode {
    let mut evaluation = play(&plan(&program(command, limit), vec![1], false), folder);
    evaluation.episodes.remove(0)
}

#[test]
fn a_program_plays_and_its_words_are_kept() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let agent = program(&agent_command("finish"), LONG);
    let plan = plan(&agent, vec![1, 2], true);
    let evaluation = play(&plan, folder.path());
    assert_eq!(evaluation.episodes.len(), 2, "{:?}", evaluation.left_out);
    for (played, name) in evaluation.episodes.iter().zip(["handover-1", "handover-2"]) {
        assert_eq!((played.result.ended, played.result.tool_calls), (EndReason::Finished, 2));
        assert_eq!(played.note.as_deref(), Some("p1 was not reached in 10 steps"));
        assert!(played.thought_s > 0.0);
        let kept = |file: &str| {
            let path = folder.path().join("episodes").join(name).join(file);
            fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        };
        let brief = kept("brief.txt");
        assert!(kept("stdout.txt").contains(&brief), "it has heard its brief");
        for says in [
            "You direct the humanoid robots A, B",
            "Task: ",
            "Robot B: ",
            "/mcp",
            "1000 control steps",
            "as much time",
        ] {
            assert!(brief.contains(says), "{says:?} in {brief}");
        }
        let result: Value = serde_json::from_str(&kept("result.json")).expect("JSON");
        assert_eq!(result["state_hash"], json!(played.result.state_hash));
    }
    let again = play(&plan, folder.path());
    assert_eq!(again.episodes, evaluation.episodes, "what was played is kept");
    let longer = program(&agent_command("finish"), LONG * 2);
    let other = evaluate(&super::plans::plan(&longer, vec![1, 2], true), folder.path(), &|_| {});
    let refused = other.expect_err("another limit is another policy").to_string();
    assert!(refused.contains("policy_settings.limit_s is 200"), "{refused}");
}

#[test]
fn each_robot_may_have_a_program_of_its_own() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let driving = Driving { operators: Some(Operators::PerRobot), patience_s: None, talk: Some(true) };
    let programs = Program::new(agent_command("operate"), driving, LONG).expect("settings");
    let evaluation = play(&plan(&programs, vec![1], false), folder.path());
    let played = &evaluation.episodes[0];
    assert_eq!((played.result.ended, played.result.env_steps), (EndReason::Finished, 15));
    assert_eq!(played.note.as_deref(), Some("p1 was not reached in 15 steps"));
    for (robot, partner) in [("A", "B"), ("B", "A")] {
        let kept = |file: &str| {
            let path = folder.path().join("episodes/handover-1").join(robot).join(file);
            fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        };
        let (brief, said) = (kept("brief.txt"), kept("stdout.txt"));
        assert!(brief.starts_with(&format!("You direct the humanoid robot {robot} in")), "{brief}");
        assert!(brief.contains(&format!("Others direct {partner}")) && brief.contains("tool say"), "{brief}");
        assert!(said.contains(&brief) && said.contains(&format!("I am {partner}.")), "{said}");
        assert!(!kept("start.json").contains("token"));
    }
}

#[test]
fn a_program_may_end_its_episode_in_any_way() {
    for (role, steps, says) in [
        ("delete", 10, "p1 was not reached in 10 steps"),
        ("leave", 10, "the program ended after 1 call, before its episode did (exit status: 0)"),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let played = play_one(&agent_command(role), LONG, folder.path());
        assert_eq!((played.result.ended, played.result.env_steps), (EndReason::Finished, steps));
        let note = played.note.expect("a note");
        assert!(note.starts_with(says), "{note}");
    }
}

/// HTTP clients report only the status of a refusal.
#[test]
fn a_program_that_dies_of_a_refusal_is_told_why_it_was_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let played = play_one(&agent_command("ask_too_much"), LONG, folder.path());
    let note = played.note.expect("a note");
    let (_, refusal) = note.split_once("(exit status: 101); the last call that was refused: ").expect(&note);
    assert!(refusal.contains("steps") && refusal.contains("; its last words: "), "{note}");
}

#[test]
fn a_program_that_never_calls_is_left_out() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let left_out = |command: &str, limit: Duration| {
        let evaluation = play(&plan(&program(command, limit), vec![1], false), folder.path());
        assert_eq!((evaluation.episodes.len(), evaluation.tasks.len()), (0, 0), "{command}");
        evaluation.left_out.join(", ")
    };
    assert_eq!(
        left_out("echo out of ideas >&2; echo; exit 3", LONG),
        "handover seed 1: the program ended without a call, before its episode did (exit status: 3); its last words: out of ideas"
    );
    let text = left_out("/no/such/program", LONG);
    assert!(text.contains("exit status: 127") && text.contains("/no/such/program"), "{text}");
    assert!(left_out("true", LONG).contains("without a call"));
    let short = Duration::from_millis(300);
    assert_eq!(
        left_out("sleep 1000", short),
        "handover seed 1: the program was stopped without a call, when its 0.3 s were over"
    );
}

#[test]
fn a_program_that_crashes_is_listed_apart_and_played_again() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let flag = folder.path().join("repaired");
    let sound = agent_command("finish");
    for (role, limit, says) in [
        ("crash", LONG, "(exit status: 101); its last words: "),
        ("kill", LONG, "after 1 call, before its episode did (signal: 9"),
        ("hang", Duration::from_secs(12), "the program was stopped after 1 call, when its 12 s were over"),
    ] {
        let command = format!(
            "if [ -e '{}' ]; then exec {sound}; fi; exec env {}",
            flag.display(),
            agent_command(role)
        );
        let sound_from_now_on = program(&command.replace("exec ROLE", "exec env ROLE"), limit);
        let plan = plan(&sound_from_now_on, vec![1, 2], false);
        let evaluation = play(&plan, folder.path());
        let handover = &evaluation.tasks["handover"];
        assert_eq!((handover.episodes, handover.policy_failed, handover.p1), (0, 2, 0));
        for played in &evaluation.episodes {
            assert_eq!(played.result.ended, EndReason::PolicyFailed);
            assert_eq!(played.exclusion(), Some(Exclusion::PolicyFailed));
            let note = played.note.as_deref().unwrap_or_default();
            assert!(note.contains(says), "{note}");
        }
        let recorded = folder.path().join("episodes/handover-1/result.json");
        assert!(fs::read_to_string(recorded).expect("a result").contains("\"policy_failed\""));

        // With `retries: 0` the failed episodes count, and no episode is played again.
        let kept = play(&EvaluationPlan { retries: 0, ..plan.clone() }, folder.path());
        assert_eq!((kept.tasks["handover"].episodes, kept.tasks["handover"].policy_failed), (2, 0));
        let hashes = |evaluation: &Evaluation| {
            let all = evaluation.episodes.iter();
            all.map(|played| (played.result.state_hash.clone(), played.thought_s)).collect::<Vec<_>>()
        };
        assert_eq!(hashes(&kept), hashes(&evaluation));
        let report = EvaluationReport::of(&load(&[folder.path().into()]).expect("episodes"));
        assert!((report.policies[0].episodes, report.policies[0].excluded.len()) == (2, 0), "{report:?}");

        fs::write(&flag, "").expect("a file");
        let again = play(&plan, folder.path());
        assert_eq!((again.tasks["handover"].episodes, again.tasks["handover"].policy_failed), (2, 0));
        assert!(again.episodes.iter().all(|played| played.result.ended == EndReason::Finished));
        for played in &again.episodes {
            let [earlier] = &played.attempts[..] else { panic!("{played:?}") };
            assert_eq!(earlier.ended, EndReason::PolicyFailed, "a crash leaves a trace");
            assert!(earlier.note.as_deref().is_some_and(|note| note.contains(says)), "{earlier:?}");
        }
        fs::remove_file(&flag).expect("the file");
        fs::remove_dir_all(folder.path().join("episodes")).expect("a folder");
    }
}

#[test]
fn a_crash_of_one_of_two_programs_is_named() {
    for role in ["crash", "leave_partner"] {
        check_named_crash(role);
    }
}

/// Checks the result of an episode in which B's program crashes and A's program has this role.
fn check_named_crash(role: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let driving = Driving { operators: Some(Operators::PerRobot), patience_s: Some(1.0), talk: None };
    let programs = Program::new(agent_command(role), driving, LONG).expect("settings");
    let evaluation = play(&plan(&programs, vec![1], false), folder.path());
    let played = &evaluation.episodes[0];
    assert_eq!(
        (played.result.ended, played.exclusion()),
        (EndReason::PolicyFailed, Some(Exclusion::PolicyFailed))
    );
    let note = played.note.as_deref().unwrap_or_default();
    assert!(note.starts_with("B: the program ended at control step "), "{note}");
    assert!(note.contains("(exit status: 101); its last words: ") && note.contains("plan"), "{note}");
    assert!(!note.contains("A: "), "{note}");
    let report = EvaluationReport::of(&load(&[folder.path().into()]).expect("episodes"));
    assert_eq!(report.policies[0].excluded[0].why, note);
    assert!(
        report
            .write(ReportFormat::Html, &ReportPictures::default())
            .expect("a page")
            .contains("B: the program ended at control step")
    );
}

#[cfg(unix)]
#[test]
fn a_program_is_stopped_with_all_that_it_started() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let pids = folder.path().join("pids");
    // A program that ignores termination requests and has a long-lived child.
    let command =
        format!("trap '' TERM; sleep 1000 & echo $! > '{}'; while :; do sleep 1; done", pids.display());
    let left_out = |command: &str, limit: Duration| {
        play(&plan(&program(command, limit), vec![1], false), folder.path()).left_out.join(", ")
    };
    let text = left_out(&command, Duration::from_millis(300));
    assert!(text.ends_with("was stopped without a call, when its 0.3 s were over"), "{text}");
    // A child process left behind by a program that ends.
    let text = left_out(&format!("sleep 1000 & echo $! >> '{}'", pids.display()), LONG);
    assert!(text.contains("the program ended without a call"), "{text}");
    let text = fs::read_to_string(&pids).expect("it was written");
    let pids: Vec<&str> = text.lines().collect();
    assert_eq!(pids.len(), 2);
    for pid in pids {
        // A process that has ended remains a zombie until its new parent reaps it.
        let state = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
        assert!(state.is_empty() || state.contains(") Z "), "{state}");
    }
}
