//! Tests of a policy that communicates in XPolicyLab's frames: its observations, and the execution of its
//! responses by the robots.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use rmpv::Value;
use tandem_policies::{PolicyMap, PolicyProtocol, RemotePolicy};
use tandem_tools_spec::EndReason;

use super::{
    openpi_server::entry,
    plans::{last_angles_rad, plan, play},
    xpolicylab_server::{XPolicyLabServer, floats, map, read_floats},
};

/// Index of the left wrist's last joint among the 43 joints of a state; `LAST_OF_ARM` is its index among the
/// 7 joints of an arm.
const LEFT_WRIST: usize = 21;
const LAST_OF_ARM: usize = 6;
const ROWS: usize = 50;
const PARTS: [&str; 4] =
    ["left_arm_joint_state", "left_ee_joint_state", "right_arm_joint_state", "right_ee_joint_state"];

fn policy(server: &XPolicyLabServer) -> RemotePolicy {
    let preset = PolicyMap::find("xpolicylab").expect("a preset");
    RemotePolicy::new(PolicyProtocol::XPolicyLab, vec![server.url()], preset)
}

/// Keeps every robot at its first measured state, except for A's left wrist.
fn turning(first: &Mutex<BTreeMap<String, Vec<Vec<f32>>>>, observation: &Value) -> Value {
    let words = entry(observation, "instruction").as_str().expect("a text");
    let state = entry(observation, "state");
    let felt: Vec<Vec<f32>> = PARTS.map(|part| read_floats(entry(state, part))).to_vec();
    let is_trial = felt.iter().flatten().all(|value| *value == 0.0);
    let mut first = first.lock().expect("no panic");
    let mut told = if is_trial { felt } else { first.entry(words.into()).or_insert(felt).clone() };
    if words.contains("Take the bottle") {
        told[0][LAST_OF_ARM] = 0.3;
    }
    let row: Vec<(&str, Value)> = PARTS.into_iter().zip(told.iter().map(|values| floats(values))).collect();
    map(&[("actions", Value::Array(vec![map(&row); ROWS])), ("latency_ms", Value::F64(1.5))])
}

#[test]
fn an_xpolicylab_policy_is_asked_trial_by_trial() {
    let first = Mutex::default();
    let server = XPolicyLabServer::start(move |observation| Ok(turning(&first, observation)));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let policy = policy(&server);
    let evaluation = play(&plan(&policy, vec![1], true), folder.path());
    let [played] = &evaluation.episodes[..] else { panic!("{evaluation:?}") };
    assert_eq!((played.result.ended, played.result.env_steps), (EndReason::StepBudgetExhausted, 1000));
    assert_eq!(played.policy.name, format!("xpolicylab:{}", server.url()));
    let turned_rad = last_angles_rad(folder.path(), "handover-1", LEFT_WRIST)[0];
    assert!((turned_rad - 0.3).abs() < 0.03, "{turned_rad}");

    // A trial with zeros, after which the model is reset, then twenty observations of each of two robots.
    let mut expected = vec!["hello", "prepare_case", "reset", "infer", "trial_end", "reset"];
    expected.extend(["infer"; 40]);
    expected.extend(["trial_end", "close"]);
    // The last messages arrive after the episode has ended.
    while server.asked().len() < expected.len() {
        std::thread::yield_now();
    }
    assert_eq!(server.asked(), expected);
    let frames = server.frames.lock().expect("no panic");
    let ids: BTreeSet<&str> = frames.iter().filter_map(|frame| entry(frame, "message_id").as_str()).collect();
    assert_eq!(ids.len(), frames.len(), "every message has a name of its own");
    let case = entry(entry(&frames[1], "payload"), "action_case_id");
    assert_eq!(case.as_str(), Some("handover"));
    let trial = entry(entry(&frames[5], "payload"), "trial_id");
    for (number, frame) in frames[6..46].iter().enumerate() {
        assert_eq!((entry(frame, "trial_id"), entry(frame, "step").as_u64()), (trial, Some(number as u64)));
        let observation = entry(entry(frame, "payload"), "observation");
        assert_eq!(entry(observation, "data_format_version").as_str(), Some("v1.0"));
        let color = entry(entry(entry(observation, "vision"), "cam_head"), "color");
        assert_eq!(entry(color, "shape").to_string(), "[240, 320, 3]");
        assert!(entry(color, "data").as_slice().expect("bytes").iter().any(|byte| *byte > 60));
    }
    assert_ne!(trial, entry(&frames[3], "trial_id"), "the trial with zeros is another");
}

/// B's server begins to compute after A's server has responded, and continues until A's server has received a
/// heartbeat.
#[test]
fn a_server_that_has_answered_hears_heartbeats_while_another_thinks() {
    let (first_of_a, first_of_b) = (Mutex::default(), Mutex::default());
    let of_a = XPolicyLabServer::start(move |observation| Ok(turning(&first_of_a, observation)));
    let (heard, looks) = (of_a.frames.clone(), AtomicUsize::new(0));
    let beats = move || {
        let frames = heard.lock().expect("no panic");
        frames.iter().filter(|frame| entry(frame, "message_type").as_str() == Some("heartbeat")).count()
    };
    let of_b = XPolicyLabServer::start(move |observation| {
        // The first observation is the trial with zeros.
        while looks.load(Ordering::Relaxed) == 1 && beats() == 0 {
            thread::sleep(Duration::from_millis(20));
        }
        looks.fetch_add(1, Ordering::Relaxed);
        Ok(turning(&first_of_b, observation))
    });
    let preset = PolicyMap::find("xpolicylab").expect("a preset");
    let policy = RemotePolicy::new(PolicyProtocol::XPolicyLab, vec![of_a.url(), of_b.url()], preset);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let evaluation = play(&plan(&policy, vec![1], false), folder.path());
    let [played] = &evaluation.episodes[..] else { panic!("{evaluation:?}") };
    assert_eq!((played.result.ended, played.result.env_steps), (EndReason::StepBudgetExhausted, 1000));
    let asked = of_a.asked();
    let beat = asked.iter().position(|kind| kind == "heartbeat").expect("a heartbeat");
    assert_eq!(asked[beat - 1], "infer", "{asked:?}");
    assert_eq!(asked[beat + 1], "infer", "the trial goes on: {asked:?}");
}

#[test]
fn what_an_xpolicylab_server_says_of_its_failure_is_told() {
    let (first, requests) = (Mutex::default(), AtomicUsize::new(0));
    let server = XPolicyLabServer::start(move |observation| match requests.fetch_add(1, Ordering::Relaxed) {
        3 => Err("CUDA out of memory"),
        _ => Ok(turning(&first, observation)),
    });
    let folder = tempfile::tempdir().expect("a temporary folder");
    let policy = policy(&server);
    let evaluation = play(&plan(&policy, vec![1], false), folder.path());
    let [played] = &evaluation.episodes[..] else { panic!("{evaluation:?}") };
    let note = played.note.as_deref().expect("a note");
    assert!(note.ends_with("failed: infer_failed: CUDA out of memory"), "{note}");
}
