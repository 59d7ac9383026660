//! Tests of two operator processes that play Handover in lockstep, each with one robot's half of the expert's
//! commands.

use std::{
    env,
    path::{Path, PathBuf},
    process::{Child, Command},
};

use serde_json::{Value, json};
use tandem::{commands::demo, settings::Layer};
use tandem_episodes::{Recorder, Recording, RendererKind};
use tandem_tools_spec::{ActCall, ResultReply};
use ureq::Agent;

use super::team::Team;

/// Environment variable with the parameters of an operator's process, as JSON.
const TASK: &str = "TANDEM_TEST_OPERATOR";

/// Returns the commands of the expert for all robots on seed 0 of Handover, and its result.
fn expert(runs: &Path) -> (Vec<(String, Value)>, ResultReply) {
    let seeds = "0".parse().expect("a seed");
    let flags = Layer { renderer: Some(RendererKind::Cpu), ..Layer::default() };
    let result = demo::play_all(runs, seeds, flags).expect("an episode").remove(0);
    let path = runs.join("handover-seed0").join(Recorder::FILE_NAME);
    let calls = Recording::read(&path).expect("a recording").tool_calls().expect("its calls");
    let commands = calls.into_iter().filter(|call| ActCall::TOOLS.contains(&call.tool.as_str()));
    (commands.map(|call| (call.tool, call.arguments)).collect(), result)
}

/// Returns the part of a command for `robot`. A robot that the command does not mention holds still.
fn half((tool, args): &(String, Value), robot: &str) -> (String, Value) {
    let steps = args["steps"]
        .as_u64()
        .unwrap_or_else(|| args["robots"][0]["rows"].as_array().map_or(0, |rows| rows.len() as u64));
    let mut own = args.clone();
    if let Value::Array(robots) = &mut own["robots"] {
        robots.retain(|entry| entry["robot"] == robot);
        if !robots.is_empty() {
            return (tool.clone(), own);
        }
    }
    ("wait".into(), json!({ "steps": steps }))
}

/// Starts a process that sends its half of `commands` as the operator of robot number `robot`.
fn operator(team: &Team, robot: usize, commands: &[(String, Value)], folder: &Path) -> Child {
    let half: Vec<(String, Value)> =
        commands.iter().map(|command| half(command, ["A", "B"][robot])).collect();
    let file = folder.join(format!("{robot}.json"));
    std::fs::write(&file, json!(half).to_string()).expect("a file");
    let url = format!("http://{}/v1/episodes/{}/tools", team.server.address, team.id);
    let task = json!({ "url": url, "token": team.tokens[robot], "commands": file });
    let mut process = Command::new(env::current_exe().expect("this program"));
    process.args(["--exact", "operators::processes::an_operator", "--ignored"]).env(TASK, task.to_string());
    process.spawn().expect("a process")
}

#[test]
#[ignore = "the process of an operator, which other tests start"]
fn an_operator() {
    let task: Value = serde_json::from_str(&env::var(TASK).expect("a task")).expect("JSON");
    let text = |field: &str| task[field].as_str().expect("a text").to_owned();
    let commands = std::fs::read_to_string(PathBuf::from(text("commands"))).expect("the commands");
    let commands: Vec<(String, Value)> = serde_json::from_str(&commands).expect("JSON");
    let agent = Agent::config_builder().build().new_agent();
    for (tool, args) in commands {
        let request = agent.post(format!("{}/{tool}", text("url")));
        let request = request.header("authorization", format!("Bearer {}", text("token")));
        request.send_json(args).unwrap_or_else(|error| panic!("{tool}: {error}"));
    }
}

#[test]
fn two_processes_with_half_the_expert_each_do_what_it_does_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let (commands, alone) = expert(folder.path());
    let team = Team::start(json!({ "protocol": "agentic", "patience_s": 60 }));
    let operators = [0, 1].map(|robot| operator(&team, robot, &commands, folder.path()));
    for mut operator in operators {
        let ended = operator.wait().expect("its end");
        assert!(ended.success(), "an operator was refused");
    }
    let (result, recording) = team.verified();
    assert_eq!(result["ended"], "task_complete");
    assert_eq!(result["state_hash"], json!(alone.state_hash), "side by side is as one");
    assert_eq!(recording.result.as_ref().map(|result| &result.phases), Some(&alone.phases));
    let calls = recording.tool_calls().expect("its calls");
    assert!(calls.len() == commands.len() && calls.iter().all(|call| call.tool == "together"));
}

#[test]
fn who_is_left_alone_is_told_and_the_recording_is_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let wait = || ("wait".to_owned(), json!({ "steps": 1 }));
    let commands: Vec<_> = std::iter::repeat_with(wait).take(1000).collect();
    let team = Team::start(json!({ "patience_s": 0.5 }));
    let mut other = operator(&team, 0, &commands, folder.path());
    let partner_did = || {
        let reply = team.ask(1, "wait", json!({ "steps": 1 })).ok();
        assert_eq!(reply["partners"][0]["robot"], "A", "{reply}");
        reply["partners"][0]["did"].as_str().expect("what it did").to_owned()
    };
    // The other process takes a while to start.
    while partner_did() != "acted" {}
    other.kill().expect("its end");
    other.wait().expect("its end");
    while partner_did() != "held_silent" {}
    let before = team.ask(1, "get_status", json!({})).ok()["env_steps"].clone();
    assert_eq!(partner_did(), "held_silent");
    let result = team.ask(1, "finish", json!({})).ok();
    assert_eq!(result["ended"], "finished", "nobody is left to be waited for: {result}");
    assert_eq!(result["env_steps"].as_u64(), before.as_u64().map(|steps| steps + 1));
    let (_, recording) = team.verified();
    let left = recording.steps().last().expect("a step").expect("a step");
    assert_eq!(Some(left.control_step), result["env_steps"].as_u64());
}
