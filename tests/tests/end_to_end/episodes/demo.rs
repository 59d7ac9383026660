//! A test of the main use, `tandem demo`: the expert plays Handover over HTTP, and the run's folder
//! documents it.

use std::{fs, path::Path, thread};

use serde_json::Value;
use tandem::{commands::demo, settings::Layer};
use tandem_episodes::RendererKind;
use tandem_tools_spec::ResultReply;

fn play(runs: &Path) -> ResultReply {
    let seeds = "0".parse().expect("a seed");
    let flags = Layer { renderer: Some(RendererKind::Cpu), ..Layer::default() };
    demo::play_all(runs, seeds, flags).expect("an episode").remove(0)
}

#[test]
fn the_expert_hands_over_and_does_it_again_bit_for_bit() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let again = tempfile::tempdir().expect("a temporary folder");
    let (first, second) = thread::scope(|scope| {
        let second = scope.spawn(|| play(again.path()));
        (play(runs.path()), second.join().expect("the second episode"))
    });

    let times_s: Vec<f64> = first.phases.0.iter().filter_map(|(_, time_s)| *time_s).collect();
    assert!(times_s.len() == 3 && times_s.is_sorted(), "{first:?}");
    assert_eq!(first.falls, 0);
    assert!(demo::passed(std::slice::from_ref(&first)));
    assert_eq!((&first.state_hash, &first.phases), (&second.state_hash, &second.phases));

    let folder = runs.path().join("handover-seed0");
    let size = |file: &str| fs::metadata(folder.join(file)).map_or(0, |data| data.len());
    for (file, least_bytes) in [("episode.mcap", 1_000_000), ("strip.png", 50_000), ("report.html", 50_000)] {
        assert!(size(file) >= least_bytes, "{file}: {} bytes", size(file));
    }
    let written = fs::read_to_string(folder.join("result.json")).expect("result.json");
    let written: Value = serde_json::from_str(&written).expect("JSON");
    assert_eq!(written["state_hash"], serde_json::json!(first.state_hash));
    assert_eq!(written["phases"]["p3"].as_f64(), first.phases.reached_s("p3"));
}

#[test]
fn four_of_five_pass() {
    let result = |p3_s: Option<f64>| -> ResultReply {
        serde_json::from_value(serde_json::json!({
            "task": "handover", "seed": 0, "protocol": "agentic", "phases": { "p3": p3_s }, "ended": "finished",
            "env_steps": 0, "tool_calls": 0, "falls": 0, "realtime_factor": 0.0, "state_hash": "",
        }))
        .expect("a result")
    };
    let results = |placed: usize, played: usize| -> Vec<ResultReply> {
        (0..played).map(|index| result((index < placed).then_some(1.0))).collect()
    };
    for (placed, played, expected) in
        [(1, 1, true), (0, 1, false), (8, 10, true), (7, 10, false), (4, 5, true)]
    {
        assert_eq!(demo::passed(&results(placed, played)), expected, "{placed} of {played}");
    }
}
