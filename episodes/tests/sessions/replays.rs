//! Tests of verification: intact recordings are reproduced, and changed numbers are detected.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

use crate::common::*;
use crate::recordings::interrupted;
use tandem_episodes::players::{self, InProcess, LocalEpisode as _, PlayerError};
use tandem_episodes::replay::{Verdict, Verification, verify};
use tandem_episodes::{
    Clock, EpisodeSpec, Phase, PhaseStart, Recorder, Recording, Sensing, SensorModel, Session, Start,
    Variation, recover,
    tasks::{self, Spread},
};
use tandem_tools_spec::{
    DRIVE_ROW_LEN, EndReason, Finish, GetStatus, JointDrives, Observe, Protocol, SendJointDrives, Wait,
};

fn verified(path: &Path) -> Verification {
    verify(&Recording::read(path).unwrap()).unwrap()
}

/// Records the expert of a task and returns the path; `None` without an expert.
fn demonstration(task: &str, folder: &Path) -> Option<PathBuf> {
    let spec = spec(task, 3, Protocol::Benchmark);
    let mut episode = InProcess::new(Session::start(&spec, Some(folder)).unwrap());
    let played = players::find("expert").unwrap().play(&spec, &mut episode);
    episode.session.close();
    match played {
        Err(PlayerError::NoExpert { .. }) => None,
        _ => Some(folder.join(Recorder::FILE_NAME)),
    }
}

#[test]
fn every_task_is_verified_and_goes_on_where_each_phase_begins() {
    for task in tasks::cohub() {
        let folder = tempfile::tempdir().unwrap();
        let Some(recording) = demonstration(&task.id, folder.path()) else { continue };
        let found = verified(&recording);
        let steps = Recording::read(&recording).unwrap().state_hashes().count();
        assert_eq!((found.outcome, found.steps), (Verdict::Same, steps), "{}", task.id);
        assert_eq!((found.unanswered_steps, found.other_build), (0, None), "{}", task.id);

        // The recorded commands from this phase on, repeated, lead to the same end.
        let recorded = Recording::read(&recording).unwrap().result.unwrap();
        let reached = recorded.phases.0.iter().filter(|(_, time_s)| time_s.is_some()).count();
        for index in 0..task.phases.len().min(reached + 1) {
            let phase = Phase::number(index);
            let start = Start::Phase(PhaseStart { recording: recording.clone(), phase: phase.clone() });
            let spec = EpisodeSpec { start, ..spec(&task.id, 3, Protocol::Benchmark) };
            let mut episode = InProcess::new(Session::start(&spec, None).unwrap());
            let begun = episode.session.result();
            assert_eq!((begun.env_steps, begun.tool_calls), (0, 0), "the whole budget is ahead");
            assert_eq!(episode.session.reached_phases(), index, "{} {phase}", task.id);
            players::find("demonstration").unwrap().play(&spec, &mut episode).unwrap();
            let result = episode.session.close();
            assert_eq!(
                (&result.state_hash, &result.phases),
                (&recorded.state_hash, &recorded.phases),
                "{} {phase}",
                task.id
            );
        }
    }
}

/// Setpoints of motors are made again from the recorded calls.
#[test]
fn driven_motors_are_verified() {
    let folder = tempfile::tempdir().unwrap();
    let spec = spec("handover", 5, Protocol::Benchmark);
    let mut session = Session::start(&spec, Some(folder.path())).unwrap();
    let rows = vec![vec![0.5; 4 * DRIVE_ROW_LEN], vec![0.25; DRIVE_ROW_LEN]];
    let driven = SendJointDrives { robots: vec![JointDrives { robot: "B".into(), rows }] };
    command(&mut session, driven.into());
    wait(&mut session, 5);
    play(&mut session);
    session.close();
    let found = verified(&folder.path().join(Recorder::FILE_NAME));
    assert_eq!((found.outcome, found.unanswered_steps), (Verdict::Same, 0));
}

/// Sensor noise is drawn from the episode's seed: the same seed yields the same noise, and another seed
/// different noise.
#[test]
fn noise_is_the_same_again() {
    let sensing = Sensing { sensors: SensorModel::G1, ..Sensing::default() };
    let noisy = |seed: u32| EpisodeSpec { sensing, ..spec("handover", seed, Protocol::Benchmark) };
    let folder = tempfile::tempdir().unwrap();
    let mut session = Session::start(&noisy(5), Some(folder.path())).unwrap();
    let read = |session: &mut Session| state(session, "A").joint_positions_rad;
    let first = read(&mut session);
    play(&mut session);
    assert_eq!(session.close().departures[2..], ["assistance: full", "sensors: g1"]);
    assert_eq!(verified(&folder.path().join(Recorder::FILE_NAME)).outcome, Verdict::Same);

    let begun = |spec: EpisodeSpec| read(&mut Session::start(&spec, None).unwrap());
    assert_eq!(begun(noisy(5)), first);
    assert_ne!(begun(noisy(6)), first);
    // Only objects depend on the seed.
    let exact = |seed: u32| begun(spec("handover", seed, Protocol::Benchmark));
    assert_eq!(exact(5), exact(6));
}

/// Slow noise on commands is drawn from the seed and is reproducible. The label is the policy's own
/// command. Without the option, there is no noise.
#[test]
fn what_is_disturbed_is_the_same_again_and_its_label_is_what_was_told() {
    let stand = |seed: u32, disturb: f32, folder: &Path| {
        let variation = Variation { disturb, spread: Spread::Double, variety: 0 };
        let spec = EpisodeSpec { variation, ..spec("handover", seed, Protocol::Benchmark) };
        let mut session = Session::start(&spec, Some(folder)).unwrap();
        let rest = session.present().robots[0].command;
        wait(&mut session, 25);
        assert_eq!(session.present().robots[0].command, rest, "it was told to hold still");
        session.close()
    };
    let mut differ = 0;
    for seed in 5..9 {
        let [plain, disturbed] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let undisturbed = stand(seed, 0.0, plain.path());
        let result = stand(seed, 2.0, disturbed.path());
        differ += usize::from(undisturbed.state_hash != result.state_hash);
        assert_eq!(undisturbed.departures[2..], ["assistance: full", "spread: 2"]);
        assert_eq!(result.departures[2..], ["assistance: full", "spread: 2", "disturbed: 2"]);
        assert_eq!(verified(&disturbed.path().join(Recorder::FILE_NAME)).outcome, Verdict::Same);
    }
    assert!((1..=4).contains(&differ), "most episodes are disturbed: {differ} of 4");
}

/// Records three commands of A with a second of thinking. The policy's clock runs out after `thinking_s`
/// more.
fn agentic(folder: &Path, thinking_s: u64) -> PathBuf {
    let policy_clock_ns = Arc::new(AtomicU64::new(0));
    let read = policy_clock_ns.clone();
    let clock: Clock = Box::new(move || Duration::from_nanos(read.load(Relaxed)));
    let spec = spec("handover", 5, Protocol::Agentic);
    let mut session = Session::start_with_clock(&spec, Some(folder.into()), clock).unwrap();
    policy_clock_ns.fetch_add(333_333_333, Relaxed);
    session.call(Observe::of_all().into()).unwrap();
    policy_clock_ns.fetch_add(666_666_667, Relaxed);
    command(&mut session, raise_hand(25));
    wait(&mut session, 3);
    policy_clock_ns.fetch_add(thinking_s * 1_000_000_000, Relaxed);
    let _ = session.call(Wait { steps: 25 }.into());
    session.call(GetStatus::default().into()).unwrap();
    session.call(Finish {}.into()).unwrap();
    folder.join(Recorder::FILE_NAME)
}

#[test]
fn the_clock_is_charged_again_as_it_was() {
    for (thinking_s, ended, steps) in
        [(10, EndReason::Finished, 300 + 53), (1799, EndReason::WallClockExhausted, 300 + 28)]
    {
        let folder = tempfile::tempdir().unwrap();
        let path = agentic(folder.path(), thinking_s);
        let recording = Recording::read(&path).unwrap();
        let result = recording.result.clone().unwrap();
        assert_eq!((result.ended, result.env_steps), (ended, steps));
        let calls = recording.tool_calls().unwrap();
        assert_eq!(calls[1].thought, Duration::from_secs(1), "{thinking_s}");
        let found = verify(&recording).unwrap();
        assert_eq!((found.outcome, found.steps), (Verdict::Same, steps as usize + 1));
    }
}

/// Copies a recording with `change` applied to the JSON of the tool calls and of the result.
fn changed(path: &Path, change: impl Fn(&str) -> String) -> PathBuf {
    let bytes = std::fs::read(path).unwrap();
    let copy = path.with_file_name("changed.mcap");
    let mut writer = mcap::Writer::new(std::fs::File::create(&copy).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let mut message = message.unwrap();
        if message.channel.topic == "/tool_calls" {
            let text = String::from_utf8(message.data.to_vec()).unwrap();
            message.data = change(&text).into_bytes().into();
        }
        writer.write(&message).unwrap();
    }
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    for index in &summary.metadata_indexes {
        let mut record = mcap::read::metadata(&bytes, index).unwrap();
        if record.name == "result" {
            // Removes the checksum, since early recordings had none; otherwise the change would be
            // detected by it.
            record.metadata.remove("crc32").expect("a checksum");
            record.metadata.values_mut().for_each(|text| *text = change(text));
        }
        writer.write_metadata(&record).unwrap();
    }
    writer.finish().unwrap();
    copy
}

#[test]
fn a_changed_number_is_found_at_its_step() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = Session::start(&spec("handover", 5, Protocol::Benchmark), Some(folder.path())).unwrap();
    wait(&mut session, 7);
    command(&mut session, raise_hand(25));
    wait(&mut session, 10);
    command(&mut session, squat(0.70));
    session.close();
    let path = folder.path().join(Recorder::FILE_NAME);
    assert_eq!(verified(&path).outcome, Verdict::Same);
    let check = |from: &str, to: &str, step: u64, number: usize, tool: &str| {
        let copy = changed(&path, |text| text.replace(from, to));
        let Verdict::State(found) = verified(&copy).outcome else { panic!("{from} -> {to} is not found") };
        assert_eq!((found.control_step, found.call), (step, Some((number, tool.into()))), "{from} -> {to}");
    };
    // Another wrist target differs from the command's first step on; so does another height.
    check("0.28,-0.24,0.22", "0.28,-0.24,0.2200001", 8, 2, "move_wrists");
    check("\"pelvis_height_m\\\":0.7", "\"pelvis_height_m\\\":0.7000001", 43, 4, "walk");
    // A shorter wait moves the following command forward.
    check("{\\\"steps\\\":7}", "{\\\"steps\\\":6}", 7, 2, "move_wrists");
    // A longer last wait has states that were never recorded.
    check("{\\\"steps\\\":10}", "{\\\"steps\\\":11}", 43, 3, "wait");
}

/// The replay counts the information given to the policy again, including that given to a policy in this
/// process, which receives no reply.
#[test]
fn a_result_that_hides_what_its_policy_was_told_differs() {
    use tandem_tools_spec::ExtraInformation::{JointVelocities, ThirdPerson};
    let folder = tempfile::tempdir().unwrap();
    let own = spec("handover", 5, Protocol::Benchmark);
    let mut episode = InProcess::new(Session::start(&own, Some(folder.path())).unwrap());
    state(&mut episode.session, "A");
    let look = Observe { short: Some(true), ..Observe::of_all() };
    episode.observe(&look, &[JointVelocities, ThirdPerson]).unwrap();
    episode.carry_out(Wait { steps: 3 }.into()).unwrap();
    wait(&mut episode.session, 2);
    let result = episode.session.close();
    let by_robot = |a: u32, b: u32| BTreeMap::from([("A".to_owned(), a), ("B".to_owned(), b)]);
    assert_eq!(result.extra_information_replies["joint_velocities"], by_robot(2, 1));
    assert_eq!(result.extra_information_replies["odometry"], by_robot(2, 1));
    let path = folder.path().join(Recorder::FILE_NAME);
    assert_eq!(verified(&path).outcome, Verdict::Same);
    let calls = Recording::read(&path).unwrap().tool_calls().unwrap();
    let shown: Vec<_> = calls.into_iter().map(|call| call.shown).collect();
    assert_eq!(shown, [None, Some(vec![JointVelocities, ThirdPerson]), Some(vec![]), None]);
    for (from, to) in [
        (r#""joint_velocities":{"A":2,"B":1}"#, r#""joint_velocities":{"A":1,"B":1}"#),
        (r#","third_person":{"A":1,"B":1}"#, ""),
        (r#""third_person","#, ""),
        (r#""shown":["joint_velocities","third_person"]"#, r#""shown":["third_person"]"#),
    ] {
        let copy = changed(&path, |text| text.replace(from, to));
        let outcome = verified(&copy).outcome;
        assert!(
            matches!(outcome, Verdict::Result { what: "extra information", .. }),
            "{from} -> {to}: {outcome:?}"
        );
    }
}

#[test]
fn an_interrupted_recording_is_verified_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let partial = interrupted(folder.path(), 2);
    let found = verified(&recover(&partial).unwrap().path);
    assert_eq!((found.outcome, found.steps, found.calls), (Verdict::Same, 11, 2));
}

#[test]
fn a_start_at_a_phase_is_recorded_and_verified_without_the_demonstration() {
    let folder = tempfile::tempdir().unwrap();
    let recording = demonstration("pouring", folder.path()).unwrap();
    let begin = |phase: &str| Start::Phase(PhaseStart { recording: recording.clone(), phase: phase.into() });
    // It also works under another protocol: the budget is the new episode's own.
    let own = EpisodeSpec { start: begin("p2"), ..spec("pouring", 3, Protocol::Agentic) };
    let again = folder.path().join("again");
    let mut session = Session::start(&own, Some(&again)).unwrap();
    wait(&mut session, 20);
    let result = session.close();
    assert_eq!((result.env_steps, result.tool_calls), (20, 1));
    assert!(result.phases.reached_s("p1").is_some() && result.phases.reached_s("p2").is_none());

    let refused = |start: Start, seed: u32| {
        let spec = EpisodeSpec { start, ..spec("pouring", seed, Protocol::Agentic) };
        Session::start(&spec, None).map(drop).unwrap_err().to_string()
    };
    let text = refused(begin("p7"), 3);
    assert!(text.contains("no checkpoint where p7 begins"), "{text}");
    let text = refused(begin("p2"), 4);
    assert!(text.contains("made of task pouring seed 3") && text.contains("pouring seed 4"), "{text}");

    std::fs::remove_file(&recording).unwrap();
    let found = verified(&again.join(Recorder::FILE_NAME));
    assert_eq!((found.outcome, found.steps), (Verdict::Same, 21));
    let text = refused(begin("p2"), 3);
    assert!(text.contains("cannot read the recording"), "{text}");
}
