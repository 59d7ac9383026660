//! Tests of checkpoints in memory and on disk: an episode continues from its own checkpoint bit for bit,
//! and other episodes are refused.

use std::path::Path;

use crate::common::*;
use tandem_episodes::{Checkpoint, EpisodeSpec, Sensing, Session, Start};
use tandem_tools_spec::{Assistance, Hints, Protocol, StatusReply};

#[test]
fn an_episode_taken_up_from_a_checkpoint_goes_on_as_it_did() {
    let mut session = handover(5);
    command(&mut session, raise_hand(25));
    let checkpoint = session.checkpoint().unwrap();
    let (hash_then, status_then) = (session.state_hash(), status(&mut session));
    play(&mut session);
    let end = (session.state_hash(), status(&mut session));

    let mut other = handover(5);
    for resumed in [&mut session, &mut other] {
        resumed.resume(&checkpoint).unwrap();
        assert_eq!((resumed.state_hash(), status(resumed)), (hash_then.clone(), status_then.clone()));
        play(resumed);
        assert_eq!((resumed.state_hash(), status(resumed)), end);
    }
}

/// Writes the checkpoint of an episode after one command. Returns how the episode continued.
fn written(path: &Path) -> (String, StatusReply) {
    let mut session = handover(5);
    command(&mut session, raise_hand(25));
    session.checkpoint().unwrap().write(path).unwrap();
    play(&mut session);
    (session.state_hash(), status(&mut session))
}

/// Returns the error of an episode `spec` that starts at the checkpoint in `path`.
fn refusal(spec: EpisodeSpec, path: &Path) -> String {
    let spec = EpisodeSpec { start: Start::Checkpoint(path.into()), ..spec };
    match Session::start(&spec, None) {
        Ok(_) => panic!("{spec:?} goes on from a checkpoint that is not its own"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn an_episode_begun_at_a_checkpoint_on_disk_goes_on_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("handover.checkpoint");
    let end = written(&path);
    let spec =
        EpisodeSpec { start: Start::Checkpoint(path.clone()), ..spec("handover", 5, Protocol::Benchmark) };
    let mut session = Session::start(&spec, None).unwrap();
    assert_eq!(session.present().control_step, 25);
    play(&mut session);
    assert_eq!((session.state_hash(), status(&mut session)), end);

    let names: Vec<_> =
        std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["handover.checkpoint"], "no partial file stays behind");
}

#[test]
fn checkpoints_of_other_episodes_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("handover.checkpoint");
    written(&path);
    for other in [
        spec("pouring", 5, Protocol::Benchmark),
        spec("handover", 6, Protocol::Benchmark),
        spec("handover", 5, Protocol::Agentic),
    ] {
        let wanted = format!(
            "task {} seed {} under the {} protocol",
            other.task.id,
            other.seed,
            other.protocol.name()
        );
        let text = refusal(other, &path);
        assert!(text.contains("made of task handover seed 5 under the benchmark protocol"), "{text}");
        assert!(text.contains(&format!("this one is {wanted}")), "{text}");
    }
}

/// A robot's state estimate is part of the checkpoint.
#[test]
fn a_checkpoint_is_no_start_for_robots_that_know_themselves_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("handover.checkpoint");
    written(&path);
    let text =
        refusal(EpisodeSpec { sensing: Sensing::TRUTH, ..spec("handover", 5, Protocol::Benchmark) }, &path);
    assert!(text.contains("state estimate estimator") && text.contains("state estimate truth"), "{text}");
}

/// A policy remembers the texts that it has read, and results depend on them.
#[test]
fn a_checkpoint_is_no_start_for_policies_that_are_told_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("handover.checkpoint");
    written(&path);
    let own = || spec("handover", 5, Protocol::Benchmark);
    let text = refusal(own().assisted(Assistance::Paper), &path);
    assert!(text.contains("assistance full") && text.contains("assistance paper"), "{text}");
    let text = refusal(EpisodeSpec { hints: Hints::Off, ..own() }, &path);
    assert!(text.contains("hints on") && text.contains("hints off"), "{text}");

    let begun = EpisodeSpec { start: Start::Checkpoint(path), ..own() };
    let shown = Session::start(&begun, None).unwrap().result().extra_information;
    assert!(shown.iter().any(|what| what == "odometry"), "what the command before showed: {shown:?}");
}

#[test]
fn checkpoints_of_other_builds_and_damaged_ones_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("handover.checkpoint");
    written(&path);
    let own = spec("handover", 5, Protocol::Benchmark);
    let whole = std::fs::read(&path).unwrap();
    let line = whole.iter().position(|byte| *byte == b'\n').unwrap();
    let header: serde_json::Value = serde_json::from_slice(&whole[..line]).unwrap();
    let mut flipped = whole.clone();
    flipped[line + 1000] ^= 1;
    let mut other_build = header.clone();
    other_build["build"] = "0.0.1+beef".into();
    let mut other_build = other_build.to_string().into_bytes();
    other_build.extend(&whole[line..]);
    for (bytes, expected) in [
        (&whole[..line / 2], "is no checkpoint of an episode"),
        (&whole[..line], "is torn"),
        (&whole[..whole.len() - 1], "is torn"),
        (&flipped[..], "is torn"),
        (&other_build[..], "was made by build 0.0.1+beef of task handover seed 5"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let text = Checkpoint::read(&path).map(drop).unwrap_err().to_string();
        assert!(text.contains(expected) && text.contains("handover.checkpoint"), "{text}");
    }
    let text = refusal(own, &folder.path().join("nowhere"));
    assert!(text.contains("cannot read the checkpoint") && text.contains("nowhere"), "{text}");
}
