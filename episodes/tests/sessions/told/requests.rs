//! Tests against bypasses: information withheld from a plain call is also withheld from an observation
//! within a command, from operators, and under repeated requests.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

use serde_json::{Value, json};
use tandem_episodes::live::{LiveEvent, Onlookers};
use tandem_episodes::{OperatorCall, Session};
use tandem_tools_spec::{Assistance, Call, CheckReach, EndReason, Protocol, Tool as _, ToolCall};

use crate::common::*;

fn paper() -> Session {
    let spec = spec("handover", 0, Protocol::Agentic).assisted(Assistance::Paper);
    Session::start(&spec, None).unwrap()
}

fn call(tool: &str, args: Value) -> Call {
    Call::parse(tool, args).unwrap()
}

#[test]
fn a_look_inside_a_command_shows_no_more_than_one_alone() {
    let mut session = paper();
    for frame in ["start", "level"] {
        let look = json!({ "frame": frame });
        let alone = session.ask(None, call("observe", look.clone())).unwrap_err().to_string();
        assert!(alone.contains("pelvis frame alone"), "{alone}");
        let counted = session.result().tool_calls;
        let inside = call("wait", json!({ "steps": 1, "observe": look.clone() }));
        let refused = session.ask(None, inside.clone()).unwrap_err().to_string();
        assert_eq!((refused, session.result().tool_calls), (alone.clone(), counted), "it does not count");
        let operators = OperatorCall::new("A", inside).unwrap();
        assert_eq!(session.read_command(operators).unwrap_err().to_string(), alone);
    }
    let plain = call("wait", json!({ "steps": 1, "observe": { "frame": "pelvis" } }));
    let seen = json!(session.ask(None, plain).unwrap().observation.unwrap().states);
    assert!(seen[0]["gravity_in_pelvis"].is_null() && seen[0]["pelvis_in_start"].is_null(), "{seen}");
    assert_eq!(session.result().extra_information, [""; 0]);
}

#[test]
fn an_operator_may_command_no_more_than_the_policy_of_all_robots() {
    let mut session = paper();
    let entry = |with: Value| {
        let mut entry = json!({ "robot": "A", "right_position_m": [0.28, -0.24, 0.22] });
        entry.as_object_mut().unwrap().extend(with.as_object().unwrap().clone());
        call("move_wrists", json!({ "steps": 5, "robots": [entry] }))
    };
    for with in [json!({ "frame": "start" }), json!({ "keep_waist": true }), json!({ "stand_fast": true })] {
        let one = session.ask(None, entry(with.clone())).unwrap_err().to_string();
        assert!(one.contains("leave"), "{one}");
        let counted = session.result().tool_calls;
        let operators = OperatorCall::new("A", entry(with)).unwrap();
        assert_eq!(session.read_command(operators).unwrap_err().to_string(), one);
        assert_eq!(session.result().tool_calls, counted + 1, "a refusal counts, as that of the policy's");
    }
    let allowed = session.read_command(OperatorCall::new("A", entry(json!({}))).unwrap()).unwrap();
    assert!(session.together(vec![allowed]).is_ok());
}

/// A receiver that lets time pass while a call is answered.
struct SlowAnswers(Arc<AtomicU64>);

impl Onlookers for SlowAnswers {
    fn any(&self) -> bool {
        true
    }

    fn wants_step(&self, _: u64) -> bool {
        false
    }

    fn tell(&self, event: LiveEvent) {
        if let LiveEvent::Entry(_) = event {
            self.0.fetch_add(100, Relaxed);
        }
    }
}

#[test]
fn a_policy_that_looks_while_it_thinks_pays_for_its_looks() {
    let now_s = Arc::new(AtomicU64::new(0));
    let read = now_s.clone();
    let clock = Box::new(move || Duration::from_secs(read.load(Relaxed)));
    let spec = spec("handover", 0, Protocol::Agentic);
    let mut session = Session::start_with_clock(&spec, None, clock).unwrap();
    session.set_onlookers(Box::new(SlowAnswers(now_s)));
    let left_s = |session: &Session| session.status().budget.wall_clock_left_s;
    assert_eq!(left_s(&session), Some(1800.0));
    wait(&mut session, 5);
    assert_eq!(left_s(&session), Some(1800.0), "nobody pays for what physics takes");
    for number in 1..=18 {
        session.ask(Some("A"), ToolCall::from(CheckReach::example()).into()).unwrap();
        assert_eq!(left_s(&session), Some(1800.0 - 100.0 * f64::from(number)), "look {number}");
    }
    assert!(session.ask(Some("A"), ToolCall::from(CheckReach::example()).into()).is_ok(), "looks never end");
    assert_eq!((session.ended(), session.result().thinking_s), (Some(EndReason::WallClockExhausted), 1800.0));
}
