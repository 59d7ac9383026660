//! Tests of episodes that fail: a failure ends only its episode, and the recording stays readable. The tests
//! control the clocks.

use std::{
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering::Relaxed},
        mpsc,
    },
    time::Duration,
};

use tandem_episodes::{Clock, EpisodeSpec, Recorder, Recording, tasks};
use tandem_tools_spec::{Briefing, EndReason, ManageReply, Protocol, StatusReply, ToolCall, ToolReply, Wait};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::{episode::Surroundings, hosted_episode::Beside, *};
use crate::settings::{Durability, Layer, Settings};

const IDLE: Duration = Duration::from_secs(900);

/// Returns the surroundings of an episode that is recorded in `folder` and has neither a team nor a journal.
pub fn alone(folder: &Path, place: OwnedSemaphorePermit) -> Surroundings {
    let memory = Arc::new(Beside::default());
    Surroundings { folder: folder.into(), place, metrics: Arc::default(), memory, journals: None }
}

async fn start(id: &str, folder: &Path, clock: Clock) -> (Arc<EpisodeThread>, Arc<Semaphore>, Briefing) {
    let spec = EpisodeSpec::new(&tasks::find("handover").unwrap(), 0, Protocol::Benchmark);
    let places = Arc::new(Semaphore::new(1));
    let permit = places.clone().try_acquire_owned().unwrap();
    let (episode, briefing) =
        EpisodeThread::start_with_clock(id, spec, alone(folder, permit), clock).await.unwrap();
    (Arc::new(episode), places, briefing)
}

fn wait() -> ToolCall {
    Wait { steps: 2 }.into()
}

async fn status(episode: &EpisodeThread) -> StatusReply {
    match episode.status().await.unwrap().reply {
        ToolReply::Manage(ManageReply::GetStatus(status)) => status,
        other => panic!("{other:?} is no status"),
    }
}

/// Creates a clock whose time is set from outside, in seconds.
fn hands() -> (Arc<AtomicU64>, Clock) {
    let hands_s = Arc::new(AtomicU64::new(0));
    let read = hands_s.clone();
    (hands_s, Box::new(move || Duration::from_secs(read.load(Relaxed))))
}

#[tokio::test]
async fn many_who_begin_to_look_on_take_no_place_of_calls() {
    let folder = tempfile::tempdir().unwrap();
    let (episode, _, _) = start("looked at", folder.path(), hands().1).await;
    let mut looking = tokio::task::JoinSet::new();
    for _ in 0..64 {
        let episode = episode.clone();
        looking.spawn(async move { episode.watch().await.map(drop) });
    }
    // All three watchers wait before the policy calls.
    tokio::task::yield_now().await;
    for _ in 0..3 {
        episode.call(wait()).await.unwrap();
    }
    while let Some(looked) = looking.join_next().await {
        looked.unwrap().unwrap();
    }
}

#[tokio::test]
async fn a_panic_ends_its_own_episode_and_no_other() {
    let [broken_folder, sound_folder] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let broken = Arc::new(AtomicBool::new(false));
    let (breaks, readings) = (broken.clone(), AtomicU64::new(0));
    let clock: Clock = Box::new(move || {
        // The clock panics only once, because closing the episode also reads it.
        assert!(!breaks.swap(false, Relaxed), "the clock is broken");
        Duration::from_millis(readings.fetch_add(1, Relaxed))
    });
    let (episode, places, _) = start("broken", broken_folder.path(), clock).await;
    let (other, _, _) = start("sound", sound_folder.path(), hands().1).await;
    episode.call(wait()).await.unwrap();
    let thought = episode.thought();
    assert!(!thought.is_zero());
    broken.store(true, Relaxed);
    let refused = episode.call(wait()).await.unwrap_err();
    assert!(refused.to_string().contains("the simulator failed in this episode"), "{refused}");
    assert!(episode.ended());
    assert!(matches!(episode.status().await, Err(HostingError::EpisodePanicked)));
    assert_eq!(episode.thought(), thought, "what is known is kept");

    let recording = Recording::read(&broken_folder.path().join(Recorder::FILE_NAME)).unwrap();
    assert_eq!(recording.steps().map(Result::unwrap).count(), 3);
    let result = episode.close().await.unwrap();
    assert_eq!((result.ended, result.env_steps), (EndReason::SimulatorFailed, 2));
    assert_eq!(result.simulator_failure.as_deref(), Some("by a panic: the clock is broken"));
    assert_eq!(places.available_permits(), 1);
    other.call(wait()).await.unwrap();
    assert_eq!((status(&other).await.ended, other.close().await.unwrap().env_steps), (None, 2));
}

#[tokio::test]
async fn an_episode_without_calls_is_ended_and_closed() {
    let folder = tempfile::tempdir().unwrap();
    let (hands_s, clock) = hands();
    let (episode, _, _) = start("idle", folder.path(), clock).await;
    hands_s.store(800, Relaxed);
    episode.call(wait()).await.unwrap();
    hands_s.store(1699, Relaxed);
    episode.end_if_abandoned(IDLE);
    assert_eq!(status(&episode).await.ended, None, "the last call was 899 s ago");
    hands_s.store(1700, Relaxed);
    episode.end_if_abandoned(IDLE);
    assert_eq!(status(&episode).await.ended, Some(EndReason::Abandoned));
    assert!(episode.ended(), "its place can be taken");

    let recording = Recording::read(&folder.path().join(Recorder::FILE_NAME)).unwrap();
    let result = episode.close().await.unwrap();
    assert_eq!((result.ended, result.tool_calls), (EndReason::Abandoned, 1), "looking on is no call");
    assert_eq!(recording.result, Some(result));
}

#[tokio::test]
async fn closing_ends_in_time_and_says_what_it_left() {
    let [runs, other_runs] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let flags = Layer { runs: Some(runs.path().into()), max_episodes: Some(1), ..Layer::default() };
    let table = EpisodeTable::new(Settings::resolve(flags, None).unwrap());
    let (go_on, stuck) = mpsc::channel::<()>();
    let hangs = Arc::new(AtomicBool::new(false));
    let hanging = hangs.clone();
    let clock: Clock = Box::new(move || {
        if hanging.load(Relaxed) {
            // Blocks until the test drops the other end.
            let _ = stuck.recv();
        }
        Duration::ZERO
    });
    let (episode, _, _) = start("stuck", runs.path(), clock).await;
    table.insert("stuck", episode.clone()).unwrap();
    let (other, _, _) = start("stuck", other_runs.path(), hands().1).await;
    let refused = table.insert("stuck", other.clone());
    assert!(matches!(refused, Err(HostingError::HeldAlready { .. })), "{refused:?}");
    assert!(Arc::ptr_eq(&table.get("stuck").unwrap(), &episode), "it stays whose the id was");
    other.close().await.unwrap();
    hangs.store(true, Relaxed);
    let call = tokio::spawn(async move { episode.call(wait()).await });
    tokio::task::yield_now().await;
    let left = table.close_all(Duration::from_millis(50), false).await;
    assert_eq!(left, [format!("stuck in {}", runs.path().display())]);
    drop(go_on);
    assert!(call.await.unwrap().is_ok(), "the call still finishes");
    let (late, _, _) = start("late", runs.path(), hands().1).await;
    let refused = table.insert("late", late.clone());
    assert!(matches!(refused, Err(HostingError::ShuttingDown)), "nothing is added after closing");
    late.close().await.unwrap();
}

/// Checks that a suspended episode gives the same answers as one that was never suspended.
#[tokio::test]
async fn an_episode_that_was_put_aside_is_as_it_was() {
    let runs = tempfile::tempdir().unwrap();
    let flags = Layer { runs: Some(runs.path().into()), max_episodes: Some(2), ..Layer::default() };
    let table = Arc::new(EpisodeTable::new(Settings::resolve(flags, None).unwrap()));
    let journals = LiveFolder::beside(runs.path(), "http://127.0.0.1:1".into(), Durability::Disk);
    table.keep_journals(journals.clone());
    let start = || serde_json::from_value(serde_json::json!({ "task": "handover", "seed": 2110 })).unwrap();
    let mut steps = Vec::new();
    for sleeps in [true, false] {
        let id = table.start(start()).await.unwrap().episode_id;
        let hosted = table.awake(&id).await.unwrap();
        hosted.call(&Caller::Host, wait().into(), Some("first")).await.unwrap();
        let first = hosted.call(&Caller::Host, wait().into(), Some("second")).await.unwrap();
        if sleeps {
            hosted.thread.put_aside();
            while !hosted.thread.sleeps() {
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
            assert!(!hosted.thread.ended());
        }
        assert_eq!(table.asleep(), if sleeps { vec![id.clone()] } else { Vec::new() });
        let again = table.awake(&id).await.unwrap();
        let again = again.call(&Caller::Host, wait().into(), Some("second")).await.unwrap();
        assert!(again.replayed && again.reply.step == first.reply.step);
        hosted.call(&Caller::Host, wait().into(), Some("third")).await.unwrap();
        let result = table.remove(&id).await.unwrap();
        assert_eq!((result.recording_failed.as_deref(), result.tool_calls), (None, 3));
        let recording = Recording::read(&runs.path().join(&id).join(Recorder::FILE_NAME)).unwrap();
        steps.push(recording.state_hashes().map(Result::unwrap).collect::<Vec<_>>());
    }
    assert_eq!(steps[0], steps[1]);
    assert!(journals.ids().is_empty());
}
