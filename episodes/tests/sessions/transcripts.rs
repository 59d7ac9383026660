//! Tests of transcripts: they include every call, counted or not, and notes, and have no other effect.

use std::path::Path;

use serde_json::{Value, json};
use tandem_episodes::replay::{Verdict, verify};
use tandem_episodes::{Recorder, Recording, Session, TranscriptEntry, recover};
use tandem_tools_spec::{Call, Note, NoteKind, Observe, Protocol, ResultReply, TokenCount};

use crate::common::*;

fn thought(text: &str) -> Note {
    Note {
        text: text.into(),
        kind: Some(NoteKind::Thought),
        tokens: Some(TokenCount { input: 1000, output: 50, cached: 600 }),
        usd: Some(0.01),
        model: Some("a-model".into()),
        seconds: Some(1.5),
        ..Note::default()
    }
}

/// Plays an episode with observations, a refused call and a plan. With `tells`, also sends notes and
/// calls that do not reach the episode.
fn play(session: &mut Session, tells: bool) {
    let note = |session: &mut Session, note: Note| {
        if tells {
            session.note(None, note).unwrap();
        }
    };
    note(session, thought("I look first."));
    session.call(Observe { robots: Some(vec!["A".into()]), ..Observe::of_all() }.into()).unwrap();
    if tells {
        session.refused_before(None, "move_wrists", "{\"steps\": \"five\"}", "steps: expected a number");
        let late = Call { expected_step: Some(900), ..Call::from(raise_hand(5)) };
        session.ask(None, late).unwrap_err();
    }
    note(session, thought("Now the hand."));
    command(session, raise_hand(5));
    session.call(raise_hand(26)).unwrap_err();
    let wait = json!({ "tool": "wait", "arguments": { "steps": 3 }, "expects": { "phase_reached": "p3" } });
    let plan = Call::parse("send_plan", json!({ "commands": [wait, wait] })).unwrap();
    session.ask(None, plan).unwrap();
    note(session, Note { text: "B waits.".into(), robot: Some("B".into()), ..Note::default() });
}

fn recorded(folder: &Path, tells: bool) -> (ResultReply, Recording) {
    let spec = spec("handover", 2003, Protocol::Agentic);
    let mut session = Session::start(&spec, Some(folder)).unwrap();
    play(&mut session, tells);
    let result = session.close();
    (result, Recording::read(&folder.join(Recorder::FILE_NAME)).unwrap())
}

/// Returns one line for each entry, with the number of a counted call.
fn told(recording: &Recording) -> Vec<String> {
    let word = |entry: &TranscriptEntry| match entry {
        TranscriptEntry::Call { number: Some(number), call, .. } => {
            format!("{number} {}{}", call.tool, if call.ok { "" } else { " refused" })
        }
        TranscriptEntry::Call { number: None, call, .. } => {
            format!("- {}{}", call.tool, if call.ok { "" } else { " refused" })
        }
        TranscriptEntry::Note { note, .. } => format!("note {}", note.text),
    };
    recording.transcript().unwrap().iter().map(word).collect()
}

#[test]
fn a_transcript_tells_all_that_was_asked_and_said_in_its_order() {
    let folder = tempfile::tempdir().unwrap();
    let (result, recording) = recorded(folder.path(), true);
    let expected = [
        "note I look first.",
        "1 observe",
        "- move_wrists refused",
        "- move_wrists refused",
        "note Now the hand.",
        "2 move_wrists",
        "3 move_wrists refused",
        "4 wait",
        "- send_plan",
        "note B waits.",
    ];
    assert_eq!(told(&recording), expected);
    let transcript = recording.transcript().unwrap();
    let call = |index: usize| match &transcript[index] {
        TranscriptEntry::Call { call, .. } => call,
        TranscriptEntry::Note { note, .. } => panic!("{note:?}"),
    };
    assert_eq!(call(1).pictures[0].robot, "A");
    assert_eq!(
        (call(2).arguments.as_str(), call(2).reply.as_str()),
        ("{\"steps\": \"five\"}", "steps: expected a number")
    );
    assert!(call(3).reply.contains("expected_step"), "{}", call(3).reply);
    let plan: Value = serde_json::from_str(&call(8).reply).unwrap();
    assert!(plan["stopped"].as_str().unwrap().contains("p3 has not been reached"), "{plan}");
    assert_eq!(
        (call(8).control_step, call(1).control_step + 8),
        (call(7).control_step, call(7).control_step)
    );
    let usage = result.usage.unwrap();
    assert_eq!(
        (usage.notes, usage.input_tokens, usage.output_tokens, usage.cached_tokens),
        (3, 2000, 100, 1200)
    );
    assert_eq!((usage.usd, usage.model_s, usage.models), (Some(0.02), Some(3.0), vec!["a-model".to_owned()]));
}

#[test]
fn what_is_told_changes_nothing_and_is_no_part_of_a_replay() {
    let (one, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (silent, _) = recorded(one.path(), false);
    let (told, recording) = recorded(other.path(), true);
    let facts = |result: &ResultReply| (result.state_hash.clone(), result.tool_calls, result.env_steps);
    assert_eq!(facts(&told), facts(&silent));
    assert_eq!((silent.usage, recording.tool_calls().unwrap().len()), (None, 4));
    let verification = verify(&recording).unwrap();
    assert_eq!((verification.outcome, verification.calls), (Verdict::Same, 4));
}

#[test]
fn notes_are_about_robots_that_there_are_and_come_before_the_end() {
    let mut session = handover(2003);
    let about = |robot: &str| Note { robot: Some(robot.into()), ..thought("Here.") };
    let refused = |session: &mut Session, own: Option<&str>, note: Note| {
        session.note(own, note).unwrap_err().to_string()
    };
    assert!(refused(&mut session, None, about("C")).contains("no robot \"C\" in this episode; have: A, B"));
    assert!(refused(&mut session, Some("A"), about("B")).contains("another operator's; yours is \"A\""));
    assert!(refused(&mut session, None, Note::default()).contains("it says nothing; give a text"));
    session.note(Some("B"), thought("I am B.")).unwrap();
    session.end(tandem_tools_spec::EndReason::Finished);
    assert!(refused(&mut session, None, thought("Too late.")).contains("the episode has ended"));
    assert_eq!(session.close().usage.unwrap().notes, 1);
}

/// A caller may send any text of any length.
#[test]
fn what_is_no_json_is_kept_as_a_text_and_cut() {
    let folder = tempfile::tempdir().unwrap();
    let mut session =
        Session::start(&spec("handover", 2003, Protocol::Benchmark), Some(folder.path())).unwrap();
    session.refused_before(None, "wait", "{\"steps\": ", "no JSON");
    session.refused_before(None, &"ü".repeat(90), &"ü".repeat(9000), "no tool");
    session.close();
    let recording = Recording::read(&folder.path().join(Recorder::FILE_NAME)).unwrap();
    let calls: Vec<(String, Value)> = recording
        .transcript()
        .unwrap()
        .into_iter()
        .map(|entry| match entry {
            TranscriptEntry::Call { call, .. } => (call.tool, serde_json::from_str(&call.arguments).unwrap()),
            TranscriptEntry::Note { note, .. } => panic!("{note:?}"),
        })
        .collect();
    assert_eq!(calls[0], ("wait".into(), json!("{\"steps\": ")));
    assert_eq!(calls[1].0, "ü".repeat(50));
    assert!(calls[1].1.as_str().unwrap().ends_with("ü... (18000 bytes)"), "{}", calls[1].1);
    assert_eq!(recording.tool_calls().unwrap(), []);
}

/// A plan that reaches the last step of an episode is recorded like any other.
#[test]
fn a_plan_that_ends_the_episode_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut session =
        Session::start(&spec("handover", 2003, Protocol::Benchmark), Some(folder.path())).unwrap();
    let wait = json!({ "tool": "wait", "arguments": { "steps": 50 } });
    let mut plans = 0;
    while session.ended().is_none() {
        let plan = Call::parse("send_plan", json!({ "commands": vec![wait.clone(); 20] })).unwrap();
        session.ask(None, plan).unwrap();
        plans += 1;
    }
    let result = session.close();
    let recording = Recording::read(&folder.path().join(Recorder::FILE_NAME)).unwrap();
    let told = told(&recording);
    assert_eq!(told.iter().filter(|entry| *entry == "- send_plan").count(), plans);
    assert_eq!(told.last().unwrap(), "- send_plan");
    assert_eq!(recording.result.clone().unwrap().tool_calls, result.tool_calls);
    assert_eq!(verify(&recording).unwrap().outcome, Verdict::Same);
}

#[test]
fn what_was_told_is_recovered() {
    let folder = tempfile::tempdir().unwrap();
    let mut session =
        Session::start(&spec("handover", 2003, Protocol::Agentic), Some(folder.path())).unwrap();
    play(&mut session, true);
    let partial = folder.path().join("episode.mcap.partial");
    std::thread::sleep(std::time::Duration::from_secs(1));
    let bytes = std::fs::read(&partial).unwrap();
    drop(session);
    std::fs::write(&partial, bytes).unwrap();
    let recording = Recording::read(&recover(&partial).unwrap().path).unwrap();
    assert_eq!((recording.result.clone(), told(&recording).len()), (None, 10));
    assert_eq!(verify(&recording).unwrap().outcome, Verdict::Same);
}
