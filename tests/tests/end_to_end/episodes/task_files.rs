//! Tests of users' task files against the equivalent built-in tasks, and of the stored copy of a file.

use tandem_episodes::players;
use tandem_episodes::tasks::{self, Task};
use tandem_episodes::{
    CameraModel, Controller, Instructions, RendererKind, RobotFile, Sensing, Variation, read_task,
};
use tandem_evaluation::evaluation::{EvaluationPlan, ExistingRun, KeptFiles, Shard, Starts, evaluate};
use tandem_tools_spec::{Assistance, PhaseTimes, Protocol};

/// Seeds named in the book.
const SEEDS: [u32; 5] = [2000, 2001, 2002, 2003, 2004];

/// Returns the phase times and the final state hash for each seed, with the task's expert.
fn played(task: &Task) -> Vec<(PhaseTimes, Option<String>)> {
    let plan = EvaluationPlan {
        player: players::find("expert").expect("a player"),
        protocol: Protocol::Benchmark,
        scene: None,
        robot: RobotFile::default(),
        locomotion: Controller::Balance,
        sensing: Sensing::default(),
        assistance: Assistance::Paper,
        disclosure: Assistance::Paper.disclosure(),
        hints: Assistance::Paper.hints(),
        instructions: Instructions::default(),
        variation: Variation::default(),
        stress: None,
        thinking_limit_s: None,
        renderer: RendererKind::Cpu,
        camera: CameraModel::Ideal,
        tasks: vec![task.clone()],
        seeds: SEEDS.into(),
        starts: Starts::Task,
        shard: Shard::WHOLE,
        jobs: 2,
        record: false,
        files: KeptFiles::default(),
        retries: EvaluationPlan::DEFAULT_RETRIES,
        seed_key: None,
        existing: ExistingRun::Refuse,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let episodes = evaluate(&plan, folder.path(), &|_| {}).expect("worlds can be built").episodes;
    assert_eq!(episodes.len(), SEEDS.len());
    episodes.into_iter().map(|played| (played.result.phases, played.result.state_hash)).collect()
}

/// A user's copy of a task with an added comment is a different task, with the same course and score.
#[test]
fn a_copy_of_a_task_is_scored_as_the_task_itself() {
    for id in ["handover", "big_table"] {
        let own = tasks::find(id).expect("a task");
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("copy.toml");
        std::fs::write(&path, format!("# A copy.\n{}", own.source.text)).expect("a file");
        let of_file = read_task(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_ne!(of_file, own);
        assert!(own.is_benchmark() && !of_file.is_benchmark());
        let same = |spread| {
            SEEDS.iter().all(|seed| of_file.start_poses(*seed, spread) == own.start_poses(*seed, spread))
        };
        assert!(same(tasks::Spread::Single), "{id}");
        let words = |task: &Task| {
            let phases = task.phases.iter().map(|phase| phase.description.clone());
            (task.instruction.clone(), phases.collect::<Vec<_>>())
        };
        assert_eq!(words(&of_file), words(&own));
        assert_eq!(played(&of_file), played(&own), "{id}");
    }
}
