//! Tests of recordings read back: every step is identical, and phases can be scored from the steps alone.

mod damage;
mod forged;

use crate::common::*;
use std::path::{Path, PathBuf};
use tandem_episodes::players::{self, InProcess};

use tandem_episodes::{FAILED_STEP_FILE, Recorder, Recording, Session, recover, tasks};
use tandem_tools_spec::{EndReason, Finish, Observe, Protocol};

#[test]
fn recorded_steps_are_the_steps_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let spec = spec("co_pouring", 3, Protocol::Benchmark);
    let of_another = folder.path().join(FAILED_STEP_FILE);
    std::fs::write(&of_another, "an earlier episode's").unwrap();
    let mut session = Session::start(&spec, Some(folder.path())).unwrap();
    assert!(!of_another.exists());
    let mut present = vec![session.present().clone()];
    for _ in 0..5 {
        wait(&mut session, 1);
        present.push(session.present().clone());
    }
    command(&mut session, raise_hand(5));
    let last = session.present().clone();
    let result = session.close();

    let recording = Recording::read(&folder.path().join(Recorder::FILE_NAME)).unwrap();
    assert_eq!((&recording.spec, recording.locomotion.as_str()), (&spec, "balance"));
    let steps: Vec<_> = recording.steps().map(Result::unwrap).collect();
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

/// Plays every expert, then scores its recording without a world.
#[test]
fn a_recording_scored_again_reaches_the_phases_that_the_episode_reached() {
    for task in tasks::cohub().iter().filter(|task| players::experts::solves(task)) {
        let folder = tempfile::tempdir().unwrap();
        let spec = spec(&task.id, 3, Protocol::Agentic);
        let mut episode = InProcess::new(Session::start(&spec, Some(folder.path())).unwrap());
        players::find("expert").unwrap().play(&spec, &mut episode).unwrap();
        let result = episode.session.close();
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
    assert!(text.contains("notes.mcap is no whole recording"), "{text}");
    assert!(text.ends_with("it is no MCAP file; give an episode.mcap"), "{text}");
}

#[test]
fn an_episode_that_cannot_be_recorded_is_played_all_the_same() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let folder = file.path().join("run");
    let mut session = Session::start(&spec("handover", 3, Protocol::Benchmark), Some(&folder)).unwrap();
    let reason = session.recording_failed().unwrap().to_owned();
    assert!(reason.contains("Not a directory") && reason.contains("give a folder on a disk"), "{reason}");
    assert_eq!(wait(&mut session, 5).executed_steps, 5);
    let result = session.close();
    assert_eq!((result.env_steps, result.recording_failed), (5, Some(reason)));
}

#[test]
fn a_moment_is_pictured_once() {
    let folder = tempfile::tempdir().unwrap();
    let spec = spec("handover", 3, Protocol::Benchmark);
    let mut session = Session::start(&spec, Some(folder.path())).unwrap();
    let look = |session: &mut Session, robots: Option<Vec<String>>| {
        session.call(Observe { robots, ..Observe::of_all() }.into()).unwrap();
    };
    look(&mut session, Some(vec!["A".into()]));
    (0..5).for_each(|_| look(&mut session, None));
    wait(&mut session, 1);
    (0..5).for_each(|_| look(&mut session, Some(vec!["B".into()])));
    session.call(Finish {}.into()).unwrap();

    let bytes = std::fs::read(folder.path().join(Recorder::FILE_NAME)).unwrap();
    let pictures_s = |topic: &str| -> Vec<f64> {
        let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
        messages.filter(|m| m.channel.topic == topic).map(|m| m.log_time as f64 / 1e9).collect()
    };
    assert_eq!((pictures_s("/A/egocentric"), pictures_s("/B/egocentric")), (vec![0.0], vec![0.0, 0.02]));
}

/// Returns the file left on disk if the process is killed one second after `calls` waits of 5 steps.
pub fn interrupted(folder: &Path, calls: u32) -> PathBuf {
    let spec = spec("handover", 3, Protocol::Benchmark);
    let mut session = Session::start(&spec, Some(folder)).unwrap();
    (0..calls).for_each(|_| drop(wait(&mut session, 5)));
    let partial = folder.join("episode.mcap.partial");
    std::thread::sleep(std::time::Duration::from_secs(1));
    let bytes = std::fs::read(&partial).unwrap();
    drop(session);
    std::fs::write(&partial, bytes).unwrap();
    partial
}

#[test]
fn an_interrupted_recording_is_recovered_up_to_the_last_reply() {
    let folder = tempfile::tempdir().unwrap();
    let partial = interrupted(folder.path(), 3);
    let text = Recording::read(&partial).map(drop).unwrap_err().to_string();
    assert!(text.contains("tandem recover") && text.contains("episode.mcap.partial"), "{text}");

    // The source file is never written to, whatever the outcome.
    let bytes = std::fs::read(&partial).unwrap();
    let on_the_way = folder.path().join("episode.mcap.recovering");
    for taken in [&on_the_way, &folder.path().join(Recorder::FILE_NAME)] {
        std::fs::create_dir(taken).unwrap();
        recover(&partial).unwrap_err();
        assert!(std::fs::read(&partial).unwrap() == bytes, "with {}", taken.display());
        std::fs::remove_dir(taken).unwrap();
    }
    let recovered = recover(&partial).unwrap();
    assert!(std::fs::read(&partial).unwrap() == bytes && !on_the_way.exists());
    assert_eq!((recovered.path.clone(), recovered.last_s), (folder.path().join(Recorder::FILE_NAME), 0.3));
    let recording = Recording::read(&recovered.path).unwrap();
    assert_eq!((recording.steps().count(), recording.tool_calls().unwrap().len()), (16, 3));
    assert_eq!((recording.spec.seed, recording.result.clone()), (3, None));
    assert_eq!(recording.score().unwrap().reached().count(), 0);
    let text = recover(&partial).unwrap_err().to_string();
    assert!(text.contains("episode.mcap exists"), "{text}");
}

#[test]
fn a_torn_end_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let partial = interrupted(folder.path(), 2);
    let bytes = std::fs::read(&partial).unwrap();
    let whole = recover(&partial).unwrap();
    for left_bytes in [bytes.len() - 1, bytes.len() - 100, bytes.len() * 3 / 4] {
        std::fs::remove_file(&whole.path).unwrap();
        std::fs::write(&partial, &bytes[..left_bytes]).unwrap();
        let recovered = recover(&partial).unwrap();
        assert!(recovered.left_out.is_some() && recovered.messages <= whole.messages, "{recovered:?}");
        Recording::read(&whole.path).unwrap().steps().for_each(|step| drop(step.unwrap()));
    }
    for (name, content, says) in [
        ("episode.mcap", &b""[..], "does not end in .partial"),
        ("empty.mcap.partial", b"", "holds no message"),
        ("notes.mcap.partial", b"not MCAP", "holds no message"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        let text = recover(&path).unwrap_err().to_string();
        assert!(text.contains(says) && text.contains(name), "{text}");
    }
}

/// Four steps of Pouring, written by a version that stored each step whole, in JSON.
#[test]
fn recordings_of_earlier_versions_are_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/sessions/recordings/whole_steps.mcap");
    let recording = Recording::read(&path).unwrap();
    assert_eq!((recording.spec.task.id.as_str(), recording.spec.seed), ("pouring", 2000));
    let steps: Vec<_> = recording.steps().map(Result::unwrap).collect();
    assert_eq!(steps.iter().map(|step| step.control_step).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    let heights_m = steps.iter().map(|step| step.object("cup").unwrap().world_from_object.translation.z);
    assert!(heights_m.into_iter().all(|height_m| (0.7..1.2).contains(&height_m)));
    let hashes: Vec<_> = recording.state_hashes().map(|hash| hash.unwrap().1).collect();
    assert_eq!(
        (hashes.len(), hashes.last()),
        (5, recording.result.as_ref().and_then(|result| result.state_hash.as_ref()))
    );
    assert!(!recording.score().unwrap().complete());
}
