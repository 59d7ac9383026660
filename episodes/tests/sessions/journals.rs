//! Tests of episodes restored from their journals: states, counts, clocks and results are the same as
//! without an interruption.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

use crate::common::*;
use serde_json::json;
use tandem_episodes::live::{LiveEvent, Onlookers};
use tandem_episodes::{
    BringBack, Clock, EpisodeSpec, JournalEntry, OperatorCall, Recorder, RunFolder, Session,
};
use tandem_tools_spec::{
    Call, EndReason, ExtraInformation, JointChunk, Note, Observe, Protocol, Say, SendJointChunk, ToolCall,
    Wait,
};

/// A receiver without viewers.
struct Nobody;

impl Onlookers for Nobody {
    fn any(&self) -> bool {
        false
    }

    fn wants_step(&self, _: u64) -> bool {
        false
    }

    fn tell(&self, _: LiveEvent) {}
}

/// A clock that the test advances.
#[derive(Clone, Default)]
struct Hands(Arc<AtomicU64>);

impl Hands {
    fn clock(&self) -> Clock {
        let hands = self.0.clone();
        Box::new(move || Duration::from_millis(hands.load(Relaxed)))
    }

    fn pass(&self, ms: u64) {
        self.0.fetch_add(ms, Relaxed);
    }
}

fn call(tool: &str, arguments: serde_json::Value) -> Call {
    Call::parse(tool, arguments).unwrap()
}

/// Makes a request of every kind, some of them refused.
fn ask_everything(session: &mut Session, hands: &Hands) {
    hands.pass(700);
    command(session, raise_hand(25));
    let rows = vec![row(session, "B"); 5];
    command(session, SendJointChunk { robots: vec![JointChunk { robot: "B".into(), rows }] }.into());
    hands.pass(40);
    let look = Observe { robots: Some(vec!["A".into()]), ..Observe::of_all() };
    session.call(look.clone().into()).unwrap();
    session.observe(&look, &[ExtraInformation::ThirdPerson]).unwrap();
    hands.pass(5_000);
    let walk = json!({ "robot": "A", "vx_m_s": 0.1, "vy_m_s": 0.0, "yaw_rate_rad_s": 0.1 });
    let plan = json!({ "commands": [
        { "tool": "walk", "arguments": { "steps": 20, "robots": [walk] } }, { "tool": "wait", "arguments": { "steps": 5 } },
    ] });
    session.ask(None, call("send_plan", plan)).unwrap();
    session.ask(None, call("wait", json!({ "steps": 3, "observe": { "robots": ["B"] } }))).unwrap();
    session.ask(None, call("wait", json!({ "steps": 3, "expected_step": 1 }))).unwrap_err();
    session.call(Wait { steps: 500 }.into()).unwrap_err();
    session.note(None, Note { text: "I have looked.".into(), ..Note::default() }).unwrap();
    session.refused_before(None, "wiat", "{}", "no such tool");
    let operator =
        |robot: &str, steps| OperatorCall::new(robot, ToolCall::from(Wait { steps }).into()).unwrap();
    session.read_command(operator("A", 500)).unwrap_err();
    let commands =
        [("A", 4), ("B", 7)].map(|(robot, steps)| session.read_command(operator(robot, steps)).unwrap());
    session.together(commands.into()).unwrap();
    session.ask(Some("B"), ToolCall::from(Say { text: "Ready.".into() }).into()).unwrap();
}

/// Returns the entries after a round trip through JSON, as another process reads them.
fn copied(entries: &[JournalEntry]) -> Vec<JournalEntry> {
    serde_json::from_str(&serde_json::to_string(entries).unwrap()).unwrap()
}

fn bring_back(spec: &EpisodeSpec, entries: &[JournalEntry], hands: &Hands, thinking_ms: u64) -> Session {
    bring_back_into(None, spec, entries, hands, thinking_ms)
}

fn bring_back_into(
    folder: Option<RunFolder>,
    spec: &EpisodeSpec,
    entries: &[JournalEntry],
    hands: &Hands,
    thinking_ms: u64,
) -> Session {
    let back = BringBack {
        spec: spec.clone(),
        folder,
        entries: copied(entries),
        clock: hands.clock(),
        thinking: Duration::from_millis(thinking_ms),
        onlookers: Box::new(Nobody),
    };
    Session::bring_back(back).unwrap()
}

/// Returns a session's status, result and thinking time, without the time that physics took.
fn said(session: &mut Session) -> serde_json::Value {
    let mut told = json!([session.status(), session.result(), session.thought().as_millis()]);
    let result = told[1].as_object_mut().unwrap();
    result.retain(|name, _| name != "realtime_factor");
    told
}

#[test]
fn an_episode_is_brought_back_as_it_stood() {
    let hands = Hands::default();
    let spec = spec("handover", 2100, Protocol::Agentic);
    let mut session = Session::start_with_clock(&spec, None, hands.clock()).unwrap();
    session.keep_journal();
    ask_everything(&mut session, &hands);
    let mut entries = session.take_journal().unwrap();
    assert!(session.take_journal().unwrap().is_empty());
    assert_eq!(entries.last().unwrap().control_step(), None, "nobody has moved since");

    let mut again = bring_back(&spec, &entries, &hands, 0);
    assert_eq!(said(&mut again), said(&mut session));
    assert_eq!(again.state_hash(), session.state_hash());
    // Both continue, and are restored again.
    hands.pass(900);
    for session in [&mut session, &mut again] {
        command(session, raise_hand(25));
    }
    entries.extend(again.take_journal().unwrap());
    let mut once_more = bring_back(&spec, &entries, &hands, 0);
    assert_eq!(said(&mut once_more), said(&mut session));
    assert_eq!(once_more.state_hash(), session.state_hash());
}

/// Returns the topic, the time in ns and the content of every message in a recording.
fn recorded(folder: &Path) -> Vec<(String, u64, Vec<u8>)> {
    let bytes = std::fs::read(folder.join(Recorder::FILE_NAME)).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    messages
        .map(|message| (message.channel.topic.clone(), message.log_time, message.data.into_owned()))
        .collect()
}

/// Images that only the recording needs are rendered later, and are identical.
#[test]
fn the_recording_is_made_again_with_its_pictures() {
    let hands = Hands::default();
    let spec = spec("handover", 2104, Protocol::Agentic);
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    let mut session =
        Session::start_with_clock(&spec, Some(RunFolder::from(&*first)), hands.clock()).unwrap();
    session.keep_journal();
    ask_everything(&mut session, &hands);
    let entries = session.take_journal().unwrap();
    let mut again = bring_back_into(Some(RunFolder::from(&*second)), &spec, &entries, &hands, 0);
    // An observation at the same moment as an earlier one, answered after the restoration.
    let look = Observe::of_all();
    let [seen, seen_again] = [&mut session, &mut again].map(|session| {
        let seen = session.observe(&look, &[]).unwrap();
        seen.robots.into_iter().map(|robot| robot.view.depth_m().to_vec()).collect::<Vec<_>>()
    });
    assert!(seen == seen_again && !seen[0].is_empty());
    session.close();
    again.close();
    let (before, after) = (recorded(&first), recorded(&second));
    let pictures = before.iter().filter(|(topic, ..)| topic.ends_with("/egocentric")).count();
    assert!(pictures > 2, "{pictures}");
    for (one, other) in before.iter().zip(&after) {
        assert!(one == other, "{} at {}, {} at {}", one.0, one.1, other.0, other.1);
    }
    assert_eq!(before.len(), after.len());
}

#[test]
fn the_clock_goes_on_from_what_was_thought_and_what_ended_stays_ended() {
    let hands = Hands::default();
    let spec = spec("handover", 2101, Protocol::Agentic);
    let mut session = Session::start_with_clock(&spec, None, hands.clock()).unwrap();
    session.keep_journal();
    hands.pass(1_000_000);
    wait(&mut session, 2);
    let mut entries = session.take_journal().unwrap();

    // A server's absence for a day costs nothing; before it, the policy had been thinking for 100 s.
    hands.pass(86_400_000);
    let mut again = bring_back(&spec, &entries, &hands, 100_000);
    hands.pass(699_000);
    wait(&mut again, 2);
    assert_eq!(again.thought(), Duration::from_secs(1_799));
    hands.pass(1_000);
    again.call(Wait { steps: 2 }.into()).unwrap_err();
    assert_eq!(again.ended(), Some(EndReason::WallClockExhausted));
    entries.extend(again.take_journal().unwrap());
    assert_eq!(entries.last().unwrap().ended, Some(EndReason::WallClockExhausted));
    assert_eq!(bring_back(&spec, &entries, &hands, 0).ended(), Some(EndReason::WallClockExhausted));

    session.end(EndReason::Abandoned);
    entries.truncate(1);
    entries.extend(session.take_journal().unwrap());
    assert_eq!(bring_back(&spec, &entries, &hands, 0).ended(), Some(EndReason::Abandoned));
}

#[test]
fn another_state_is_found_out() {
    let hands = Hands::default();
    let spec = spec("handover", 2102, Protocol::Agentic);
    let mut session = Session::start_with_clock(&spec, None, hands.clock()).unwrap();
    session.keep_journal();
    command(&mut session, raise_hand(25));
    let entries = session.take_journal().unwrap();
    let other = EpisodeSpec { seed: 2103, ..spec };
    let back = BringBack {
        spec: other,
        folder: None,
        entries,
        clock: hands.clock(),
        thinking: Duration::ZERO,
        onlookers: Box::new(Nobody),
    };
    let error = Session::bring_back(back).err().expect("it is not the same");
    assert!(error.to_string().contains("325"), "{error}");
}
