//! Ownership of a folder, the episodes in it, and the processes that play in it.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tandem_episodes::{Variation, players, tasks};
use tandem_tools_spec::Protocol;

use super::super::tests::{plan, played, result};
use super::super::*;
use crate::policies::{EpisodeOutput, PlayError, PlayOutcome, Policy};
use crate::results::PolicyCard;

/// Returns the run of `plan` in `folder`, with the first `count` of its episodes played.
fn with_episodes<'a>(plan: &'a EvaluationPlan, folder: &'a Path, count: usize) -> EvaluationRun<'a> {
    let run = EvaluationRun::begin(plan, folder).unwrap();
    for spec in &run.work[..count] {
        let path = folder.join(EPISODES).join(format!("{}-{}.json", spec.task.id, spec.seed));
        std::fs::write(path, serde_json::to_string(&played(&run.cache, spec)).unwrap()).unwrap();
    }
    run
}

#[test]
fn another_run_is_refused_with_what_differs_and_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let [handover, pouring] = ["handover", "pouring"].map(|id| tasks::find(id).unwrap());
    let own = plan(vec![handover.clone()], vec![1, 2, 3]);
    drop(with_episodes(&own, folder.path(), 2));
    let before = std::fs::read(folder.path().join("episodes/handover-1.json")).unwrap();
    let refused = |other: EvaluationPlan| {
        let error = EvaluationRun::begin(&other, folder.path()).map(drop).unwrap_err();
        assert!(matches!(error, EvaluationError::OtherRun(_)), "{error}");
        error.to_string()
    };
    type PlanChange = fn(EvaluationPlan<'static>) -> EvaluationPlan<'static>;
    for (says, change) in [
        (
            "policy is \"idle\", and was \"expert\"",
            (|plan| EvaluationPlan { player: players::find("idle").unwrap(), ..plan }) as PlanChange,
        ),
        ("seeds are 2-4, and were 1-3", |plan| EvaluationPlan { seeds: vec![2, 3, 4], ..plan }),
        ("protocol is \"benchmark\", and was \"agentic\"", |plan| EvaluationPlan {
            protocol: Protocol::Benchmark,
            ..plan
        }),
        ("thinking_limit_s is 60, and was nothing", |plan| EvaluationPlan {
            thinking_limit_s: Some(60),
            ..plan
        }),
        ("variation.spread is 2, and was nothing", |plan| {
            let variation = Variation { spread: tasks::Spread::Double, ..plan.variation };
            EvaluationPlan { variation, ..plan }
        }),
    ] {
        let told = refused(change(own.clone()));
        assert!(told.contains(says), "{told}");
        assert!(told.contains("with 2 episodes, which are left as they are"), "{told}");
        assert!(told.contains("--out") && told.contains("--overwrite"), "{told}");
        assert!(!told.contains("--resume-with-new-build"), "another policy is no other build: {told}");
    }
    let told = refused(EvaluationPlan { tasks: vec![pouring.clone()], ..own.clone() });
    assert!(told.contains("tasks are pouring, and were handover"), "{told}");
    assert!(told.contains("further ones, which are added to it (--shard I/N"), "{told}");
    assert_eq!(std::fs::read(folder.path().join("episodes/handover-1.json")).unwrap(), before);

    // The same run continues, and so does a run with additional tasks or seeds.
    let kept = |plan: &EvaluationPlan| {
        let KeptEpisodes { kept, to_play, .. } = EvaluationRun::begin(plan, folder.path()).unwrap().kept();
        (kept, to_play)
    };
    assert_eq!(kept(&own), (2, 1));
    let more = EvaluationPlan { tasks: vec![pouring, handover], seeds: (0..5).collect(), ..own.clone() };
    assert_eq!(kept(&more), (2, 8));
    let told = refused(own);
    assert!(told.contains("tasks are handover, and were handover, pouring"), "{told}");
}

#[test]
fn what_a_build_before_there_was_an_identity_has_played_is_not_replaced_by_another_run() {
    let folder = tempfile::tempdir().unwrap();
    let own = plan(vec![tasks::find("handover").unwrap()], vec![1, 2, 3]);
    drop(with_episodes(&own, folder.path(), 2));
    std::fs::remove_file(folder.path().join("run.json")).unwrap();
    let idle = EvaluationPlan { player: players::find("idle").unwrap(), ..own.clone() };
    let told = EvaluationRun::begin(&idle, folder.path()).map(drop).unwrap_err().to_string();
    assert!(told.contains("policy is \"idle\", and was \"expert\""), "{told}");
    assert_eq!(EvaluationRun::begin(&own, folder.path()).unwrap().kept().kept, 2);
    assert!(folder.path().join("run.json").exists());

    // A folder without episodes can be taken over without loss.
    let empty = tempfile::tempdir().unwrap();
    drop(EvaluationRun::begin(&own, empty.path()).unwrap());
    assert_eq!(EvaluationRun::begin(&idle, empty.path()).unwrap().kept().to_play, 3);
    drop(with_episodes(&idle, empty.path(), 1));
    assert_eq!(
        EvaluationRun::begin(&idle, empty.path()).unwrap().kept().kept,
        1,
        "it is the second one's now"
    );
}

#[test]
fn results_of_another_build_are_kept_and_marked() {
    let folder = tempfile::tempdir().unwrap();
    let own = plan(vec![tasks::find("handover").unwrap()], vec![1, 2, 3]);
    let run = with_episodes(&own, folder.path(), 1);
    let older = PlayedEpisode { build: "0.0.1+older".into(), ..played(&run.cache, &run.work[0]) };
    drop(run);
    let path = folder.path().join("episodes/handover-1.json");
    std::fs::write(&path, serde_json::to_string(&older).unwrap()).unwrap();
    let identity = folder.path().join("run.json");
    let text = std::fs::read_to_string(&identity).unwrap();
    std::fs::write(&identity, text.replace(tandem_episodes::build().unwrap(), "0.0.1+older")).unwrap();

    let told = EvaluationRun::begin(&own, folder.path()).map(drop).unwrap_err().to_string();
    assert!(told.contains("the build is ") && told.contains("and was 0.0.1+older"), "{told}");
    for way in ["--out", "--resume-with-new-build", "--overwrite"] {
        assert!(told.contains(way), "{told}");
    }
    let on = EvaluationPlan { existing: ExistingRun::ResumeWithNewBuild, ..own.clone() };
    let run = EvaluationRun::begin(&on, folder.path()).unwrap();
    let kept = KeptEpisodes { kept: 1, of_other_builds: 1, to_play: 2, unreadable: 0 };
    assert_eq!(run.kept(), kept);
    assert_eq!(run.so_far().other_builds, [("0.0.1+older".to_owned(), 1)].into());
    drop(run);
    // From now on, the folder belongs to a run of this build, which also lists the other build.
    assert_eq!(EvaluationRun::begin(&own, folder.path()).unwrap().kept(), kept);
}

#[test]
fn a_run_is_deleted_where_that_is_asked_for_and_nobody_plays_it() {
    let folder = tempfile::tempdir().unwrap();
    let own = plan(vec![tasks::find("handover").unwrap()], vec![1, 2, 3]);
    std::fs::write(folder.path().join("notes.txt"), "mine").unwrap();
    let run = with_episodes(&own, folder.path(), 2);
    let player = players::find("idle").unwrap();
    let over = EvaluationPlan { player, existing: ExistingRun::Overwrite, ..own.clone() };
    let told = EvaluationRun::begin(&over, folder.path()).map(drop).unwrap_err();
    assert!(matches!(told, EvaluationError::InUse { .. }), "{told}");
    assert_eq!(is_being_played(folder.path()), Some(true));
    drop(run);
    assert_eq!(is_being_played(folder.path()), Some(false));
    assert_eq!(EvaluationRun::begin(&over, folder.path()).unwrap().kept().to_play, 3);
    assert!(!folder.path().join("episodes/handover-1.json").exists());
    assert!(folder.path().join("notes.txt").exists());

    // A folder that does not contain a run is not deleted.
    let foreign = tempfile::tempdir().unwrap();
    std::fs::create_dir(foreign.path().join("episodes")).unwrap();
    std::fs::write(foreign.path().join("episodes/Cargo.toml"), "").unwrap();
    drop(EvaluationRun::begin(&over, foreign.path()).unwrap());
    assert!(foreign.path().join("episodes/Cargo.toml").exists());
}

/// A policy that counts the episodes it plays.
#[derive(Debug, Default)]
struct CountingPolicy(AtomicUsize);

impl Policy for CountingPolicy {
    fn card(&self) -> PolicyCard {
        "counting".into()
    }

    fn play_episode(&self, spec: &EpisodeSpec, _: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        self.0.fetch_add(1, Ordering::Relaxed);
        // Long enough for the other processes to reach this episode.
        std::thread::sleep(Duration::from_millis(20));
        let result = result(&spec.task.id, spec.seed, vec![("p1".into(), Some(4.2))]);
        Ok(PlayOutcome { result, thought: Default::default(), stopped: None })
    }
}

#[test]
fn runs_side_by_side_in_one_folder_play_each_episode_once() {
    let folder = tempfile::tempdir().unwrap();
    let policy = CountingPolicy::default();
    let own = EvaluationPlan {
        player: &policy,
        jobs: 2,
        ..plan(vec![tasks::find("handover").unwrap()], (0..12).collect())
    };
    let evaluations: Vec<Evaluation> = std::thread::scope(|scope| {
        let runs: Vec<_> =
            (0..3).map(|_| scope.spawn(|| evaluate(&own, folder.path(), &|_| {}).unwrap())).collect();
        runs.into_iter().map(|run| run.join().unwrap()).collect()
    });
    assert_eq!(policy.0.into_inner(), 12);
    for evaluation in &evaluations {
        assert_eq!(evaluation.episodes, evaluations[0].episodes);
        assert_eq!((evaluation.episodes.len(), evaluation.left_out.len()), (12, 0));
    }
    let left: Vec<PathBuf> =
        std::fs::read_dir(folder.path().join(EPISODES)).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(left.iter().all(|path| path.extension().is_some_and(|e| e == "json")), "{left:?}");
}
