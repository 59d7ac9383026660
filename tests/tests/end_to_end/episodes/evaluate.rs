//! Tests of evaluations: the number of jobs does not change results, and an interrupted run continues.

use std::sync::atomic::{AtomicU32, Ordering};

use serde_json::json;
use tandem_episodes::replay::{Verdict, verify};
use tandem_episodes::{
    CameraModel, Controller, EpisodeSpec, Instructions, Recording, RendererKind, RobotFile, Sensing,
    Variation, players, tasks,
};
use tandem_evaluation::evaluation::{
    EpisodeEvent, EvaluationPlan, ExistingRun, KeptFiles, Shard, Starts, evaluate,
};
use tandem_evaluation::policies::OpenLoop;
use tandem_evaluation::reports::{EvaluationReport, load};
use tandem_evaluation::results::PlayedEpisode;
use tandem_tools_spec::{Assistance, Disclosure, EndReason, Hints, Protocol};
use tempfile::TempDir;

fn plan(jobs: usize, seeds: Vec<u32>) -> EvaluationPlan<'static> {
    let handover = tasks::find("handover").expect("a task");
    EvaluationPlan {
        player: players::find("expert").expect("a player"),
        protocol: Protocol::Benchmark,
        scene: None,
        robot: RobotFile::default(),
        locomotion: Controller::Balance,
        sensing: Sensing::default(),
        assistance: Assistance::Full,
        disclosure: Disclosure::Live,
        hints: Hints::On,
        instructions: Instructions::default(),
        variation: Variation::default(),
        stress: None,
        thinking_limit_s: None,
        renderer: RendererKind::Cpu,
        camera: CameraModel::Ideal,
        tasks: vec![handover],
        seeds,
        starts: Starts::Task,
        shard: Shard::WHOLE,
        jobs,
        record: false,
        files: KeptFiles::default(),
        retries: EvaluationPlan::DEFAULT_RETRIES,
        seed_key: None,
        existing: ExistingRun::Refuse,
    }
}

#[test]
fn what_policies_are_told_is_recorded_and_not_mixed() {
    let folders = [(); 3].map(|()| tempfile::tempdir().expect("a temporary folder"));
    let [one, two, three] = folders.each_ref();
    let play = |folder: &TempDir,
                assistance: Assistance,
                disclosure: Disclosure,
                hints: Hints,
                name: &str| {
        let plan = EvaluationPlan { assistance, disclosure, hints, ..plan(1, vec![1]) };
        let mut evaluation = evaluate(&plan, folder.path(), &|_| {}).expect("it is played");
        assert_eq!(evaluation.full_name(), name);
        let told = evaluation.episodes.remove(0);
        let text = std::fs::read_to_string(folder.path().join("results.json")).expect("it was written");
        let results: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
        assert_eq!(results["assistance"], json!(assistance));
        let EpisodeSpec { assistance: of_spec, disclosure: of_phases, hints: of_texts, .. } = told.spec;
        assert_eq!((of_spec, of_phases, of_texts), (assistance, disclosure, hints));
        assert_eq!(told.result.assistance, assistance);
        assert!(told.result.departures.starts_with(&told.spec.departures()), "{:?}", told.result.departures);
        told
    };
    let (full, paper) = (Assistance::Full, Assistance::Paper);
    let live = play(one, full, Disclosure::Live, Hints::On, "expert + assistance: full");
    assert_eq!((live.result.ended, live.note), (EndReason::TaskComplete, None));
    let told = play(two, paper, Disclosure::End, Hints::Off, "expert");
    assert_eq!((told.result.ended, told.note), (EndReason::Finished, None), "it is played anew");
    assert_eq!(told.result.phases, live.result.phases, "an expert needs nothing of what only `full` tells");
    assert_eq!(told.result.extra_information, [""; 0]);
    let name = "expert + phases told: never + hints: on";
    let never = play(three, paper, Disclosure::Never, Hints::On, name);
    assert_eq!(never.result.phases, live.result.phases, "results have every phase");
    // A run with other assistance needs a separate folder.
    let mixed = evaluate(&EvaluationPlan { assistance: paper, ..plan(1, vec![1]) }, one.path(), &|_| {});
    let refused = mixed.expect_err("another run is there").to_string();
    assert!(refused.contains("assistance is \"paper\", and was \"full\""), "{refused}");
}

/// Returns seeds and state hashes, without the machine's timings.
fn hashes(episodes: &[PlayedEpisode]) -> Vec<(u32, Option<&str>)> {
    episodes.iter().map(|episode| (episode.spec.seed, episode.result.state_hash.as_deref())).collect()
}

#[test]
fn jobs_change_nothing_and_kept_episodes_are_not_played_again() {
    let [one, two] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
    let alone = evaluate(&plan(1, vec![1, 2]), one.path(), &|_| {}).expect("it is played");
    let parallel = evaluate(&plan(2, vec![1, 2]), two.path(), &|_| {}).expect("it is played");
    assert_eq!(hashes(&alone.episodes), hashes(&parallel.episodes));
    assert_ne!(alone.episodes[0].result.state_hash, alone.episodes[1].result.state_hash);
    assert_eq!(alone.tasks["handover"].p3, 2);

    // A stored episode keeps the timings of the machine that played it. A missing episode is played again.
    std::fs::remove_file(one.path().join("episodes/handover-2.json")).expect("the file was written");
    let finished = AtomicU32::new(0);
    let count = |_: EpisodeEvent| {
        finished.fetch_add(1, Ordering::Relaxed);
    };
    let resumed = evaluate(&plan(1, vec![1, 2]), one.path(), &count).expect("it is played");
    assert_eq!(resumed.episodes[0], alone.episodes[0]);
    assert_eq!(hashes(&resumed.episodes), hashes(&alone.episodes));
    assert_eq!(finished.load(Ordering::Relaxed), 2);

    let text = std::fs::read_to_string(one.path().join("results.json")).expect("it was written");
    let results: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
    assert_eq!(results["tasks"]["handover"]["episodes"], 2);
    assert!(results["episodes"][0]["phases"]["p3"].is_number());
}

#[test]
fn phases_are_played_on_their_own_by_shares_and_joined_by_a_report() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [demos, out] = ["demos", "out"].map(|name| folder.path().join(name));
    evaluate(&EvaluationPlan { record: true, ..plan(1, vec![1]) }, &demos, &|_| {}).expect("it is played");
    let phases = ["p1", "p2", "p3"].map(String::from).to_vec();
    let starts = Starts::Phases { demonstrations: demos, phases, training: false };
    let mut left_out = 0;
    for index in 0..2 {
        let plan = EvaluationPlan {
            player: players::find("demonstration").expect("a player"),
            starts: starts.clone(),
            shard: Shard { index, of: 2 },
            ..plan(1, vec![1, 2])
        };
        let evaluation = evaluate(&plan, &out, &|_| {}).expect("it is played");
        assert!(evaluation.tasks.is_empty() && !evaluation.episodes.is_empty());
        left_out += evaluation.left_out.len();
        assert!(out.join(format!("results-{index}-of-2.json")).exists());
    }
    assert_eq!(left_out, 3, "nobody has demonstrated seed 2");
    let report = EvaluationReport::of(&load(&[out]).expect("episodes"));
    let level = report.policies[0].phase_level.as_ref().expect("phases on their own");
    let reached: Vec<_> =
        level.phases.iter().map(|rate| (&*rate.number, rate.reached, rate.episodes)).collect();
    assert_eq!(reached, [("p1", 1, 1), ("p2", 1, 1), ("p3", 1, 1)]);
    assert_eq!((level.two_robots.collaborative_share, level.two_robots.drop_share), (Some(1.0), Some(0.0)));
}

/// Replaying the commands of one seed on another is open-loop control, not a policy. A report includes its
/// success rate.
#[test]
fn a_demonstration_is_replayed_without_a_look_on_other_seeds_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [demos, out] = ["demos", "out"].map(|name| folder.path().join(name));
    let files = KeptFiles { pages: false, only_successful: true };
    let collected = EvaluationPlan { record: true, files, ..plan(1, vec![1]) };
    evaluate(&collected, &demos, &|_| {}).expect("it is played");
    let kept = |name: &str| demos.join("episodes/handover-1").join(name).exists();
    assert!(kept("episode.mcap") && !kept("strip.png") && !kept("report.html"));

    let blind = OpenLoop::read(&demos).expect("a demonstration");
    let replayed = EvaluationPlan { player: &blind, ..plan(1, vec![1, 2]) };
    let evaluation = evaluate(&replayed, &out, &|_| {}).expect("it is played");
    assert_eq!(
        evaluation.left_out,
        ["handover seed 1: it is what open-loop replays, which is for other seeds"]
    );
    let [episode] = &evaluation.episodes[..] else { panic!("{:?}", evaluation.episodes) };
    assert_eq!((episode.spec.seed, episode.policy.name.as_str()), (2, "open-loop"));
    assert!(episode.reached(0), "what stands nearly where it stood is grasped blindly: {episode:?}");
    let report = EvaluationReport::of(&load(&[out]).expect("episodes"));
    let floor = report.floors.iter().find(|floor| floor.task == "handover").expect("its floor");
    assert!(floor.players.iter().any(|rate| rate.player == "open-loop" && rate.measured == "in this report"));
}

/// Only the result of a failed episode is stored, and the episode is not played again.
#[test]
fn only_what_succeeded_is_kept_where_that_is_wished() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let files = KeptFiles { pages: true, only_successful: true };
    let idle = players::find("idle").expect("a player");
    let plan = EvaluationPlan { player: idle, record: true, files, ..plan(1, vec![1]) };
    evaluate(&plan, folder.path(), &|_| {}).expect("it is played");
    assert!(folder.path().join("episodes/handover-1.json").exists());
    assert!(!folder.path().join("episodes/handover-1").exists());
    let again = evaluate(&plan, folder.path(), &|event| assert!(matches!(event, EpisodeEvent::Kept(_))));
    assert_eq!(again.expect("it was played").tasks["handover"].p3, 0);
}

/// With variety, demonstrations on one seed differ, succeed, and are reproducible. Without variety the expert
/// is unchanged.
#[test]
fn demonstrations_vary_as_they_are_asked_to() {
    let play = |variety: u8, disturb: f32| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let variation = Variation { variety, disturb, ..Variation::default() };
        let plan = EvaluationPlan { variation, record: true, ..plan(1, vec![2000]) };
        let played = evaluate(&plan, folder.path(), &|_| {}).expect("it is played");
        let recording = folder.path().join("episodes/handover-2000/episode.mcap");
        let verified = verify(&Recording::read(&recording).expect("a recording")).expect("it is read");
        assert_eq!(verified.outcome, Verdict::Same);
        assert_eq!(played.tasks["handover"].p3, 1, "variety {variety}, disturbed {disturb}");
        played.episodes[0].result.state_hash.clone()
    };
    let [plain, varied, again] = [0, 1, 1].map(|variety| play(variety, 0.0));
    assert_eq!(varied, again);
    assert_ne!(plain, varied);
    assert_eq!(play(1, 1.0), play(1, 1.0));
}
