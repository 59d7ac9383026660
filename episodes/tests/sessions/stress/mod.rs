//! Tests of stress: each axis changes only its own quantity, a higher level changes it more, and results are
//! reproducible.

use tandem_episodes::players::{self, InProcess};
use tandem_episodes::replay::{Verdict, verify};
use tandem_episodes::stress::{Stress, StressAxis, StressLevel};
use tandem_episodes::{EpisodeSpec, MomentStart, Recorder, Recording, Session, Start, tasks};
use tandem_tools_spec::{Protocol, ResultReply};

use crate::common::*;

const SEED: u32 = 2003;

fn under(task: &str, seed: u32, stress: Option<(StressAxis, StressLevel)>) -> EpisodeSpec {
    let stress = stress.map(|(axis, level)| Stress { axis, level });
    EpisodeSpec { stress, ..spec(task, seed, Protocol::Benchmark) }
}

/// Returns the result of Handover's expert, and the verdict on its recording.
fn expert(spec: &EpisodeSpec) -> (ResultReply, Verdict) {
    let folder = tempfile::tempdir().unwrap();
    let mut episode = InProcess::new(Session::start(spec, Some(folder.path())).unwrap());
    // Under stress the expert may give up.
    let _ = players::find("expert").unwrap().play(spec, &mut episode);
    let result = episode.session.close();
    let recording = Recording::read(&folder.path().join(Recorder::FILE_NAME)).unwrap();
    assert_eq!(recording.spec, *spec);
    (result, verify(&recording).unwrap().outcome)
}

/// Only the physical axes affect motion. Every axis is listed in the result, verified, and reproducible.
#[test]
fn every_axis_is_recorded_verified_and_the_same_again() {
    let (plain, _) = expert(&under("handover", SEED, None));
    for axis in StressAxis::ALL {
        let spec = under("handover", SEED, Some((axis, StressLevel::Two)));
        let [(result, verdict), (again, _)] = [expert(&spec), expert(&spec)];
        assert_eq!(verdict, Verdict::Same, "{}", axis.name());
        let named = format!("stress: {}-2", axis.name());
        assert!(result.departures.contains(&named), "{:?}", result.departures);
        assert_eq!(result.state_hash, again.state_hash, "{}", axis.name());
        let is_seen_or_read =
            matches!(axis, StressAxis::Camera | StressAxis::Light | StressAxis::Texture | StressAxis::Words);
        assert_eq!(result.state_hash == plain.state_hash, is_seen_or_read, "{}", axis.name());
    }
}

/// Returns robot A's first image and a view of the room.
fn pictures(stress: Option<(StressAxis, StressLevel)>) -> [Vec<u8>; 2] {
    let mut session = Session::start(&under("handover", SEED, stress), None).unwrap();
    let room = session.third_person();
    [session.eye(0, [320, 240]), room.rgb().to_vec()]
}

fn mean_difference(one: &[u8], other: &[u8]) -> f64 {
    let sum: u64 = one.iter().zip(other).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / one.len() as f64
}

#[test]
fn pictures_differ_ever_more_under_camera_light_and_texture_and_no_other_axis_touches_them() {
    let plain = pictures(None);
    for axis in StressAxis::ALL {
        let levels = StressLevel::ALL.map(|level| pictures(Some((axis, level))));
        let [eye, room] = [0, 1]
            .map(|picture| levels.each_ref().map(|seen| mean_difference(&seen[picture], &plain[picture])));
        let grows = |differences: &[f64; 3]| differences[0] > 0.0 && differences.is_sorted_by(|a, b| a < b);
        match axis {
            // Viewers see the room without the stress.
            StressAxis::Camera => assert!(grows(&eye) && room == [0.0; 3], "{eye:?} {room:?}"),
            StressAxis::Light | StressAxis::Texture => {
                assert!(grows(&eye) && grows(&room), "{}: {eye:?} {room:?}", axis.name());
            }
            StressAxis::Layout => assert!(eye.iter().chain(&room).all(|it| *it > 0.0), "{eye:?} {room:?}"),
            StressAxis::Mass
            | StressAxis::Friction
            | StressAxis::Sensors
            | StressAxis::Latency
            | StressAxis::Push
            | StressAxis::Words
            | StressAxis::Partner => assert_eq!([eye, room], [[0.0; 3]; 2], "{}", axis.name()),
        }
    }
}

/// Camera stress does not change the camera pose that the robots report.
#[test]
fn a_robot_takes_its_camera_to_be_where_its_file_has_it() {
    let told = |stress| {
        let session = Session::start(&under("handover", SEED, stress), None).unwrap();
        session.present().robots[0].sensed.pelvis_from_camera
    };
    assert_eq!(told(Some((StressAxis::Camera, StressLevel::Three))), told(None));
}

/// In every task objects are farther apart and distractors are added, which need not be touched; all of
/// them are at rest.
#[test]
fn distractors_stand_in_every_task_and_rest() {
    for task in tasks::cohub() {
        let mut most = 0;
        for (level, distance) in StressLevel::ALL.into_iter().zip([2, 3, 4]) {
            let spec = under(&task.id, SEED, Some((StressAxis::Layout, level)));
            assert_eq!(spec.spread().times(), distance);
            let mut session = Session::start(&spec, None).unwrap();
            let names: Vec<String> = (1..=3).map(|number| format!("distractor_{number}")).collect();
            let places_m = |session: &Session| {
                let found = names.iter().filter_map(|name| session.present().object(name));
                found.map(|state| state.world_from_object.translation).collect::<Vec<_>>()
            };
            let begun_m = places_m(&session);
            wait(&mut session, 50);
            for (begun_m, end_m) in begun_m.iter().zip(places_m(&session)) {
                assert!((end_m - *begun_m).length() < 0.01, "{} {level:?}: {begun_m} {end_m}", task.id);
            }
            assert!(begun_m.len() <= usize::from(level.number()) && begun_m.len() >= most, "{}", task.id);
            most = begun_m.len();
        }
        assert!(most >= 1, "{} has none", task.id);
    }
}

/// The noise is that of a G1, then twice and four times as strong, in every value.
#[test]
fn sensors_are_ever_noisier() {
    let read = |stress| {
        let session = Session::start(&under("handover", SEED, stress), None).unwrap();
        session.present().robots[0].sensed.joints.q_rad
    };
    let exact = read(None);
    let off = |level: StressLevel| {
        let q_rad = read(Some((StressAxis::Sensors, level)));
        let square: f64 = q_rad.iter().zip(&exact).map(|(q, exact)| f64::from(q - exact).powi(2)).sum();
        square.sqrt()
    };
    let [one, two, three] = StressLevel::ALL.map(off);
    assert!(
        one > 0.0 && (two / one - 2.0).abs() < 0.05 && (three / two - 2.0).abs() < 0.05,
        "{one} {two} {three}"
    );
}

/// Compares the largest displacement of idle robots with and without a push.
#[test]
fn robots_that_stand_are_pushed_ever_farther() {
    let places_m = |stress| {
        let mut session = Session::start(&under("handover", SEED, stress), None).unwrap();
        let mut places_m = Vec::new();
        for _ in 0..100 {
            wait(&mut session, 5);
            let robots = session.present().robots.iter();
            places_m.extend(robots.map(|robot| robot.truth.world_from_pelvis().translation));
        }
        places_m
    };
    let plain = places_m(None);
    let [one, two, three] = StressLevel::ALL.map(|level| {
        let pushed = places_m(Some((StressAxis::Push, level)));
        pushed.iter().zip(&plain).map(|(one, other)| (*one - *other).length()).fold(0.0, f32::max)
    });
    assert!(one > 0.001 && two > one && three > two, "{one} {two} {three}");
}

/// An episode continues from a checkpoint as before, including delayed commands.
#[test]
fn what_is_late_arrives_after_a_checkpoint_too() {
    for axis in [StressAxis::Latency, StressAxis::Partner, StressAxis::Push] {
        let spec = under("handover", SEED, Some((axis, StressLevel::Three)));
        let mut session = Session::start(&spec, None).unwrap();
        command(&mut session, raise_hand(25));
        let checkpoint = session.checkpoint().unwrap();
        let go_on = |session: &mut Session| {
            command(session, squat(0.70));
            (0..8).for_each(|_| drop(wait(session, 50)));
            session.state_hash()
        };
        let end = go_on(&mut session);
        let mut other = Session::start(&spec, None).unwrap();
        other.resume(&checkpoint).unwrap();
        assert_eq!(go_on(&mut other), end, "{}", axis.name());
        let mut plain = Session::start(&under("handover", SEED, None), None).unwrap();
        let error = plain.resume(&checkpoint).unwrap_err().to_string();
        assert!(error.contains(&format!("stress {}-3", axis.name())), "{error}");
    }
}

#[test]
fn policies_read_other_words() {
    let told = |stress| {
        let briefing = Session::start(&under("handover", SEED, stress), None).unwrap().briefing();
        let robots = briefing.instructions.into_iter().map(|entry| entry.instruction);
        std::iter::once(briefing.instruction).chain(robots).collect::<Vec<_>>()
    };
    let plain = told(None);
    for level in StressLevel::ALL {
        let words = told(Some((StressAxis::Words, level)));
        assert!(words.len() == 3 && words.iter().zip(&plain).all(|(one, other)| one != other), "{words:?}");
    }
    assert_eq!(told(Some((StressAxis::Push, StressLevel::Two))), plain);
}

/// An episode starts in the middle of another one, at its state, under any protocol, and is verified from
/// there.
#[test]
fn an_episode_begins_again_at_a_moment_of_another() {
    let folder = tempfile::tempdir().unwrap();
    let spec = under("handover", SEED, Some((StressAxis::Latency, StressLevel::One)));
    let mut episode = InProcess::new(Session::start(&spec, Some(folder.path())).unwrap());
    let _ = players::find("expert").unwrap().play(&spec, &mut episode);
    episode.session.close();
    let recording = folder.path().join(Recorder::FILE_NAME);
    let moment = MomentStart { recording: recording.clone(), control_step: 200, before_s: Some(3) };
    let again = EpisodeSpec { start: Start::Moment(moment), protocol: Protocol::Agentic, ..spec };
    let other = tempfile::tempdir().unwrap();
    let mut session = Session::start(&again, Some(other.path())).unwrap();
    let begun = session.present().control_step;
    assert!((190..=200).contains(&begun), "at the last call before: {begun}");
    let recorded = Recording::read(&recording).unwrap();
    let hash = recorded.state_hashes().map(Result::unwrap).find(|(step, _)| *step == begun).unwrap().1;
    assert_eq!(session.state_hash(), hash);
    assert_eq!((session.env_steps(), session.result().tool_calls), (0, 0), "the whole budget is ahead");
    wait(&mut session, 20);
    let result = session.close();
    assert!(result.departures.contains(&"begun again 3 s before it went wrong".to_string()), "{result:?}");
    let verified = verify(&Recording::read(&other.path().join(Recorder::FILE_NAME)).unwrap()).unwrap();
    assert_eq!(verified.outcome, Verdict::Same);
}
