//! Tests of the cache, the notes and the counts.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use tandem_episodes::{
    Controller, EpisodeSpec, Instructions, Phase, PhaseStart, RobotFile, Start, Variation, players,
    tasks::{self, Task},
    write_result,
};
use tandem_sim::render::{CameraModel, RendererKind};
use tandem_sim::{Sensing, dynamics::Diverged};
use tandem_tools_spec::{Assistance, Disclosure, EndReason, Hints, PhaseTimes, Protocol, ResultReply};

use super::*;
use crate::policies::{EpisodeOutput, PlayError, PlayOutcome, Policy};
use crate::results::{PhaseLevel, PolicyCard, episode_note, missed_phase_note};

pub(super) fn result(task: &str, seed: u32, phases: Vec<(String, Option<f64>)>) -> ResultReply {
    ResultReply {
        task: task.into(),
        seed: Some(seed),
        protocol: Protocol::Benchmark,
        phases: PhaseTimes(phases),
        success: None,
        ended: EndReason::Finished,
        env_steps: 812,
        tool_calls: 61,
        requests: None,
        thinking_s: 0.0,
        operators: Vec::new(),
        falls: 0,
        realtime_factor: 3.5,
        state_hash: Some("00c0ffee00c0ffee".into()),
        simulator_failure: None,
        assistance: Assistance::Full,
        extra_information: vec![],
        extra_information_replies: Default::default(),
        joints_clamped_share: None,
        departures: vec![],
        recording_failed: None,
        usage: None,
    }
}

/// Returns an episode that was played under `cache`'s rules.
pub(super) fn played(cache: &EpisodeCache, spec: &EpisodeSpec) -> PlayedEpisode {
    PlayedEpisode {
        policy: cache.plan.player.card(),
        spec: spec.clone(),
        locomotion: cache.locomotion.clone(),
        build: cache.build.into(),
        result: result(&spec.task.id, spec.seed, vec![("p1".into(), Some(4.2))]),
        thought_s: 1.5,
        note: None,
        keep_failed: false,
        attempts: Vec::new(),
        ended_at: None,
    }
}

#[test]
fn the_first_phase_that_was_missed_is_noted() {
    let note = |times: [Option<f64>; 3]| {
        let phases = ["p1", "p2", "p3"].into_iter().map(String::from).zip(times).collect();
        missed_phase_note(&result("handover", 7, phases), None)
    };
    let second = note([Some(4.2), None, None]);
    assert_eq!(second.as_deref(), Some("p2 was not reached in 812 steps"));
    assert_eq!(note([Some(4.2), Some(5.0), Some(6.0)]), None);

    // If only one phase counts, no other phase is reported as missed.
    let times = [Some(4.2), Some(5.0), None].into_iter().enumerate();
    let result = result("handover", 7, times.map(|(i, time_s)| (Phase::number(i), time_s)).collect());
    assert_eq!(missed_phase_note(&result, Some(1)), None);
    assert_eq!(missed_phase_note(&result, Some(2)).as_deref(), Some("p3 was not reached in 812 steps"));

    // If the simulator failed, the note reports that.
    assert_eq!(episode_note(&result, Some(2)), missed_phase_note(&result, Some(2)));
    let failed = ResultReply { simulator_failure: Some("in step 813, physics diverged".into()), ..result };
    assert_eq!(
        episode_note(&failed, Some(2)).as_deref(),
        Some("the simulator failed in step 813, physics diverged")
    );
}

pub(super) fn plan(tasks: Vec<Task>, seeds: Vec<u32>) -> EvaluationPlan<'static> {
    EvaluationPlan {
        player: players::find("expert").unwrap(),
        protocol: Protocol::Agentic,
        scene: None,
        robot: RobotFile::default(),
        locomotion: Controller::Balance,
        sensing: Sensing::default(),
        renderer: RendererKind::Cpu,
        camera: CameraModel::Ideal,
        assistance: Assistance::Full,
        disclosure: Disclosure::Live,
        hints: Hints::On,
        instructions: Instructions::default(),
        variation: Variation::default(),
        stress: None,
        thinking_limit_s: None,
        tasks,
        seeds,
        starts: Starts::Task,
        shard: Shard::WHOLE,
        jobs: 1,
        record: false,
        files: KeptFiles::default(),
        retries: EvaluationPlan::DEFAULT_RETRIES,
        seed_key: None,
        existing: ExistingRun::Refuse,
    }
}

#[test]
fn shares_are_fair_and_together_the_whole() {
    let whole = plan(tasks::cohub().to_vec(), (0..10).collect());
    let (all, _) = whole.episodes();
    assert_eq!(all.len(), 10 * tasks::cohub().len());
    let mut joined = Vec::new();
    for index in 0..3 {
        let (share, _) = EvaluationPlan { shard: Shard { index, of: 3 }, ..whole.clone() }.episodes();
        assert!(share.len().abs_diff(all.len() / 3) <= 1, "{index}: {}", share.len());
        for task in tasks::cohub() {
            let of_task = share.iter().filter(|spec| spec.task == *task).count();
            assert!((3..=4).contains(&of_task), "{index}: {of_task} of {}", task.id);
        }
        joined.extend(share);
    }
    joined.sort_by_key(|spec| (tasks::cohub().iter().position(|task| *task == spec.task), spec.seed));
    assert_eq!(joined, all);
}

#[test]
fn episodes_from_phases_need_demonstrations() {
    let folder = tempfile::tempdir().unwrap();
    let recordings =
        ["episodes/pouring-1", "pouring-2", "pouring-seed3"].map(|name| folder.path().join(name));
    for recording in &recordings {
        std::fs::create_dir_all(recording).unwrap();
        std::fs::write(recording.join("episode.mcap"), "").unwrap();
    }
    let starts = Starts::Phases {
        demonstrations: folder.path().into(),
        phases: vec!["p3".into(), "p1".into()],
        training: false,
    };
    let plan = EvaluationPlan { starts, ..plan(vec![tasks::find("pouring").unwrap()], vec![1, 2, 3, 4]) };
    let (episodes, left_out) = plan.episodes();
    let begun = |spec: &EpisodeSpec| match &spec.start {
        Start::Phase(PhaseStart { recording, phase }) => {
            (spec.seed, recording.parent().map(PathBuf::from).unwrap(), phase.clone())
        }
        other => panic!("{other:?}"),
    };
    let expected =
        |index: usize, phase: &str| (index as u32 + 1, recordings[index].clone(), phase.to_owned());
    let all = (0..3).flat_map(|index| [expected(index, "p1"), expected(index, "p3")]).collect::<Vec<_>>();
    assert_eq!(episodes.iter().map(begun).collect::<Vec<_>>(), all);
    assert_eq!(left_out, ["p1", "p3"].map(|phase| format!("pouring seed 4 {phase}: no demonstration")));
}

/// The benchmark begins each phase once in each of 50 demonstrations, and never in demonstrations of the
/// validation split.
#[test]
fn phases_begin_in_the_demonstrations_for_training() {
    let folder = tempfile::tempdir().unwrap();
    let demonstrate = |name: String| {
        let recording = folder.path().join("episodes").join(name);
        std::fs::create_dir_all(&recording).unwrap();
        std::fs::write(recording.join("episode.mcap"), "").unwrap();
    };
    // One episode of Pouring has failed and was not kept. Handover has two episodes.
    (2000..2061).filter(|seed| *seed != 2003).for_each(|seed| demonstrate(format!("pouring-{seed}")));
    ["handover-7", "handover-11", "pouring-x"].into_iter().for_each(|name| demonstrate(name.into()));
    std::fs::create_dir_all(folder.path().join("episodes/handover-3")).unwrap();
    let starts =
        Starts::Phases { demonstrations: folder.path().into(), phases: vec!["p2".into()], training: true };
    let tasks = ["pouring", "handover", "co_carry"].map(|id| tasks::find(id).unwrap());
    let plan = EvaluationPlan { starts, ..plan(tasks.into(), vec![1]) };
    let (episodes, left_out) = plan.episodes();
    let seeds = |id: &str| {
        episodes.iter().filter(|spec| spec.task.id == id).map(|spec| spec.seed).collect::<Vec<_>>()
    };
    assert_eq!(seeds("pouring"), (2000..2051).filter(|seed| *seed != 2003).collect::<Vec<_>>());
    assert_eq!((seeds("handover"), seeds("co_carry"), left_out.len()), (vec![7, 11], vec![], 0));
    assert!(
        episodes
            .iter()
            .all(|spec| matches!(&spec.start, Start::Phase(PhaseStart { phase, .. }) if phase == "p2"))
    );
}

#[test]
fn phases_on_their_own_are_averaged_by_who_works_on_them() {
    let plan = plan(Vec::new(), Vec::new());
    let cache = EpisodeCache {
        plan: &plan,
        folder: PathBuf::new(),
        locomotion: "balance".into(),
        build: "test",
        builds: vec!["test".into()],
    };
    let from = |id: &str, seed: u32, phase: usize, reached: bool| {
        let start = PhaseStart { recording: "demonstration".into(), phase: Phase::number(phase) };
        let spec = plan.spec(&tasks::find(id).unwrap(), seed, Start::Phase(start));
        let times = vec![(Phase::number(phase), reached.then_some(4.2))];
        PlayedEpisode { result: result(id, seed, times), ..played(&cache, &spec) }
    };
    // Handover has one collaborative phase, p2; all phases of CoPouring are collaborative.
    let mut episodes = vec![from("handover", 0, 0, true), from("handover", 1, 0, true)];
    episodes.extend((0..4).map(|seed| from("handover", seed, 1, seed == 0)));
    episodes.extend((0..4).map(|seed| from("co_pouring", seed, 2, seed < 3)));
    episodes.push(from("handover", 0, 2, false));
    let level = PhaseLevel::of(episodes.iter()).unwrap();
    let rates: Vec<_> =
        level.phases.iter().map(|rate| (&*rate.task, &*rate.number, rate.reached, rate.episodes)).collect();
    let handover = [("handover", "p1", 2, 2), ("handover", "p2", 1, 4), ("handover", "p3", 0, 1)];
    assert_eq!(rates, [&handover[..], &[("co_pouring", "p3", 3, 4)]].concat());
    assert_eq!(
        (level.two_robots.non_collaborative_share, level.two_robots.collaborative_share),
        (Some(0.5), Some(0.5))
    );
    assert_eq!(level.two_robots.drop_share, Some(0.0));
    assert_eq!(level.three_robots, None);
    // Tasks for three robots have separate means.
    episodes.push(from("big_table", 0, 0, true));
    episodes.push(from("big_table", 0, 1, false));
    let with_three = PhaseLevel::of(episodes.iter()).unwrap();
    assert_eq!(with_three.two_robots, level.two_robots);
    let three = with_three.three_robots.unwrap();
    assert_eq!((three.non_collaborative_share, three.collaborative_share), (None, Some(0.5)));
    let whole = played(&cache, &plan.spec(&tasks::find("handover").unwrap(), 0, Start::Task));
    assert_eq!(PhaseLevel::of([whole].iter()), None);
}

#[test]
fn only_the_same_episode_of_the_same_build_is_taken_from_an_earlier_run() {
    let folder = tempfile::tempdir().unwrap();
    let task = tandem_episodes::tasks::find("pouring").unwrap();
    let plan = plan(vec![task.clone()], vec![7]);
    let spec = plan.spec(&task, 7, Start::Task);
    let build = tandem_episodes::build().unwrap();
    let cache = EpisodeCache {
        plan: &plan,
        folder: folder.path().into(),
        locomotion: "balance".into(),
        build,
        builds: vec![build.into()],
    };
    let kept_after = |text: &str| {
        std::fs::write(folder.path().join("pouring-7.json"), text).unwrap();
        cache.load(&spec)
    };
    assert_eq!(cache.load(&spec), None, "nothing was played");
    let same = played(&cache, &spec);
    let text = serde_json::to_string(&same).unwrap();
    assert_eq!(kept_after(&text), Some(same.clone()));
    assert_eq!(kept_after(&text[..text.len() / 2]), None, "a torn file");
    type Change = fn(&mut PlayedEpisode);
    for (what, change) in [
        ("task", (|played| played.result.task = "handover".into()) as Change),
        ("seed", |played| played.result.seed = Some(8)),
        ("protocol", |played| played.spec.protocol = Protocol::Benchmark),
        ("assistance", |played| played.spec.assistance = Assistance::Paper),
        ("disclosure", |played| played.spec.disclosure = Disclosure::End),
        ("hints", |played| played.spec.hints = Hints::Off),
        ("sensing", |played| played.spec.sensing = Sensing::TRUTH),
        ("camera", |played| played.spec.camera = CameraModel::D435i),
        ("start", |played| played.spec.start = Start::Checkpoint("other".into())),
        ("robot", |played| played.spec.robot = RobotFile::Embedded("other".into())),
        ("policy", |played| played.policy = "idle".into()),
        ("settings", |played| played.policy.settings = Some(serde_json::json!({ "execute": 25 }))),
        ("extra information", |played| played.policy.extra_information.push("third_person".into())),
        ("controller", |played| played.locomotion.push('0')),
        ("build", |played| played.build.push('0')),
    ] {
        let mut other = same.clone();
        change(&mut other);
        assert_eq!(kept_after(&serde_json::to_string(&other).unwrap()), None, "another {what}");
    }

    // An episode that was played without a recording cannot serve as a demonstration.
    let recorded = EvaluationPlan { record: true, ..plan.clone() };
    let collector = EpisodeCache { plan: &recorded, ..cache };
    std::fs::write(folder.path().join("pouring-7.json"), &text).unwrap();
    assert_eq!(collector.load(&spec), None, "no recording");
    std::fs::create_dir(folder.path().join("pouring-7")).unwrap();
    write_result(&same.result, &folder.path().join("pouring-7")).unwrap();
    assert_eq!(collector.load(&spec), None, "a result without its recording");
    std::fs::write(folder.path().join("pouring-7/episode.mcap"), "").unwrap();
    let other = ResultReply { state_hash: Some("0badc0ffee".into()), ..same.result.clone() };
    write_result(&other, &folder.path().join("pouring-7")).unwrap();
    assert_eq!(collector.load(&spec), None, "another episode's recording");
    write_result(&same.result, &folder.path().join("pouring-7")).unwrap();
    assert_eq!(collector.load(&spec), Some(same));
}

/// A policy that can play no episode.
#[derive(Debug)]
struct Unplayable(fn() -> PlayError);

impl Policy for Unplayable {
    fn card(&self) -> PolicyCard {
        "unplayable".into()
    }

    fn play_episode(&self, _: &EpisodeSpec, _: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        Err((self.0)())
    }
}

/// A policy that crashes in every episode.
#[derive(Debug, Default)]
struct FailingPolicy(AtomicU32);

impl Policy for FailingPolicy {
    fn card(&self) -> PolicyCard {
        "failing".into()
    }

    fn play_episode(&self, spec: &EpisodeSpec, _: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        let number = self.0.fetch_add(1, Ordering::Relaxed) + 1;
        let phases = vec![("p1".into(), None), ("p2".into(), None), ("p3".into(), None)];
        let result = ResultReply { ended: EndReason::PolicyFailed, ..result("handover", spec.seed, phases) };
        let stopped = Some(format!("crash {number}"));
        Ok(PlayOutcome { result, thought: Duration::from_secs(1), stopped })
    }
}

/// A policy that always crashes is retried as often as the plan allows, and all attempts are kept.
#[test]
fn a_policy_that_fails_itself_again_and_again_has_failed() {
    let folder = tempfile::tempdir().unwrap();
    let player = FailingPolicy::default();
    let plan = EvaluationPlan { player: &player, ..plan(vec![tasks::find("handover").unwrap()], vec![1]) };
    let run = |retries: u32| {
        let evaluation =
            evaluate(&EvaluationPlan { retries, ..plan.clone() }, folder.path(), &|_| {}).unwrap();
        let (played, task) = (evaluation.episodes[0].clone(), evaluation.tasks["handover"].clone());
        let notes: Vec<String> =
            played.into_attempts().into_iter().filter_map(|attempt| attempt.note).collect();
        (task.episodes, task.policy_failed, notes.join(", "))
    };
    assert_eq!(run(2), (0, 1, "crash 1".into()));
    assert_eq!(run(2), (0, 1, "crash 1, crash 2".into()));
    assert_eq!(run(2), (1, 0, "crash 1, crash 2, crash 3".into()), "it counts as a failure");
    assert_eq!(run(2), (1, 0, "crash 1, crash 2, crash 3".into()), "and is kept");
    assert_eq!(run(0), (1, 0, "crash 1, crash 2, crash 3".into()));
    assert_eq!(run(3), (1, 0, "crash 1, crash 2, crash 3, crash 4".into()), "whoever asks for more has more");
}

#[test]
fn what_was_played_before_is_kept_where_no_other_episode_can_be() {
    let folder = tempfile::tempdir().unwrap();
    let play = |why: fn() -> PlayError| {
        let player = Unplayable(why);
        let plan = EvaluationPlan {
            player: &player,
            ..plan(vec![tasks::find("handover").unwrap()], vec![1, 2, 3, 4])
        };
        let build = tandem_episodes::build().unwrap();
        let cache = EpisodeCache {
            plan: &plan,
            folder: folder.path().into(),
            locomotion: "balance".into(),
            build,
            builds: vec![build.into()],
        };
        let (work, mut left_out) = plan.episodes();
        for spec in &work[1..3] {
            let path = folder.path().join(format!("handover-{}.json", spec.seed));
            std::fs::write(path, serde_json::to_string(&played(&cache, spec)).unwrap()).unwrap();
        }
        workers::play_all(&cache, &work, &mut left_out, &|_| {}).map(|episodes| (episodes.len(), left_out))
    };
    // A player that does not support a task plays no episodes of it.
    let player = players::find("no_words").unwrap();
    let refused = player.play_episode(
        &EpisodeSpec::new(&tasks::find("handover").unwrap(), 1, Protocol::Benchmark),
        EpisodeOutput { folder: folder.path(), record: false, pages: false },
    );
    let Err(PlayError::NotReady(reason)) = refused else { panic!("it cannot play that") };
    assert!(reason.contains("the seed chooses nothing in task \"handover\""), "{reason}");
    let absent = play(|| PlayError::Absent("nobody".into())).unwrap_err();
    assert!(matches!(absent, EvaluationError::PolicyAbsent { kept: 2, planned: 4, .. }), "{absent}");

    let (episodes, left_out) = play(|| {
        let source = Diverged { tree: "A".into(), link: "pelvis".into(), speed: 1e9 };
        PlayError::Episode(EpisodeError::Diverged { step: 3, source })
    })
    .unwrap();
    assert_eq!((episodes, left_out.len()), (2, 2));
    assert!(left_out[1].starts_with("handover seed 4: the simulator failed before"), "{left_out:?}");
}

fn failed(cache: &EpisodeCache, spec: &EpisodeSpec, ended: EndReason, reached: usize) -> PlayedEpisode {
    let times = (0..3).map(|index| (Phase::number(index), (index < reached).then_some(4.2)));
    let result = ResultReply { ended, ..result(&spec.task.id, spec.seed, times.collect()) };
    PlayedEpisode { result, ..played(cache, spec) }
}

#[test]
fn what_failed_itself_is_counted_apart_and_played_again() {
    let folder = tempfile::tempdir().unwrap();
    let handover = tasks::find("handover").unwrap();
    let plan = plan(vec![handover.clone()], vec![1, 2, 3, 4, 5]);
    let build = tandem_episodes::build().unwrap();
    let cache = EpisodeCache {
        plan: &plan,
        folder: folder.path().into(),
        locomotion: "balance".into(),
        build,
        builds: vec![build.into()],
    };
    let keeping_plan = EvaluationPlan { retries: 0, ..plan.clone() };
    let keeping = EpisodeCache { plan: &keeping_plan, ..cache.clone() };
    let spec = |seed: u32| plan.spec(&handover, seed, Start::Task);
    let outcomes = [
        (EndReason::Finished, 2),
        (EndReason::PolicyFailed, 2),
        (EndReason::SimulatorFailed, 1),
        // A phase that was reached before the failure still counts as reached.
        (EndReason::PolicyFailed, 3),
        (EndReason::Abandoned, 0),
    ];
    let episodes: Vec<PlayedEpisode> = (1..)
        .zip(outcomes)
        .map(|(seed, (ended, reached))| failed(&cache, &spec(seed), ended, reached))
        .collect();
    for episode in &episodes {
        let path = folder.path().join(format!("handover-{}.json", episode.spec.seed));
        std::fs::write(path, serde_json::to_string(episode).unwrap()).unwrap();
    }
    let kept = |cache: &EpisodeCache| -> Vec<u32> {
        (1..=5).filter(|seed| cache.load(&spec(*seed)).is_some()).collect()
    };
    assert_eq!((kept(&cache), kept(&keeping)), (vec![1, 4, 5], vec![1, 2, 4, 5]));

    let summary = summary::summarise(&cache, episodes.clone(), Vec::new()).tasks["handover"].clone();
    assert_eq!((summary.episodes, summary.policy_failed, summary.simulator_failed), (3, 1, 1));
    assert_eq!((summary.p1, summary.p2, summary.p3, summary.mean_env_steps), (2, 2, 1, 812.0));
    let counted: Vec<PlayedEpisode> = (1..=5)
        .map(|seed| keeping.load(&spec(seed)).unwrap_or_else(|| episodes[seed as usize - 1].clone()))
        .collect();
    let summary = summary::summarise(&keeping, counted, Vec::new()).tasks["handover"].clone();
    assert_eq!((summary.episodes, summary.policy_failed, summary.simulator_failed), (4, 0, 1));
    let nothing = summary::summarise(&cache, vec![episodes[1].clone()], Vec::new()).tasks["handover"].clone();
    assert_eq!((nothing.episodes, nothing.policy_failed, nothing.mean_env_steps), (0, 1, 0.0));
}
