//! Recordings read back: every step as it was, and phases scored again from the steps alone.

use crate::common::*;
use tandem_episodes::players::{self, InProcess};
use tandem_episodes::{Recorder, Recording, Session, tasks};
use tandem_tools_spec::{EndReason, Protocol};

#[test]
fn recorded_steps_are_the_steps_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let spec = spec("co_pouring", 3, Protocol::Benchmark);
    let mut session = Session::start(&spec, Some(folder.path())).unwrap();
    let mut present = vec![session.present().clone()];
    for _ in 0..5 {
        wait(&mut session, 1);
        present.push(session.present().clone());
    }
    command(&mut session, raise_hand(5));
    let last = session.present().clone();
    let result = session.close().unwrap();

    let recording = Recording::read(&folder.path().join(Recorder::FILE_NAME)).unwrap();
    assert_eq!((&recording.spec, recording.locomotion.as_str()), (&spec, "balance"));
    let steps: Vec<_> = recording.steps().unwrap().map(Result::unwrap).collect();
    assert_eq!(steps.iter().map(|step| step.control_step).collect::<Vec<_>>(), (0..=10).collect::<Vec<_>>());
    assert_eq!((&steps[..6], &steps[10]), (&present[..], &last));
    let calls = recording.tool_calls().unwrap();
    assert_eq!(
        calls.iter().map(|call| call.tool.as_str()).collect::<Vec<_>>(),
        ["wait"; 5].iter().copied().chain(["move_wrists"]).collect::<Vec<_>>()
    );
    assert_eq!((calls[0].arguments["steps"].as_u64(), calls[5].time_s), (Some(1), 0.2));
    assert_eq!(recording.result.unwrap().state_hash, result.state_hash);
}

/// Plays the expert of every task, then scores its recording without a world.
#[test]
fn a_recording_scored_again_reaches_the_phases_that_the_episode_reached() {
    for task in tasks::ALL {
        let folder = tempfile::tempdir().unwrap();
        let spec = spec(task.id, 3, Protocol::Benchmark);
        let mut episode = InProcess(Session::start(&spec, Some(folder.path())).unwrap());
        players::find("expert").unwrap().play(&spec, &mut episode).unwrap();
        let result = episode.0.close().unwrap();
        assert_eq!(result.ended, EndReason::TaskComplete, "{}", task.id);

        let recording = Recording::read(&folder.path().join(Recorder::FILE_NAME)).unwrap();
        let scores = recording.score().unwrap();
        let scored: Vec<f64> = scores.reached().map(|(_, time_s)| time_s).collect();
        let reached: Vec<f64> = result.phases.0.iter().filter_map(|(_, time_s)| *time_s).collect();
        assert_eq!((scored, scores.complete()), (reached.clone(), true), "{}", task.id);
        let noted = recording.phases().unwrap().iter().map(|phase| phase.time_s).collect::<Vec<_>>();
        assert_eq!(noted, reached, "{}", task.id);
    }
}

#[test]
fn what_is_no_recording_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notes.mcap");
    assert!(Recording::read(&path).map(drop).unwrap_err().to_string().contains("cannot read the recording"));
    std::fs::write(&path, "not MCAP").unwrap();
    let text = Recording::read(&path).map(drop).unwrap_err().to_string();
    assert!(text.contains("notes.mcap is no complete MCAP file"), "{text}");
}
