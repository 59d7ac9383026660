//! Tasks of files beside the same tasks in Rust, and what is kept of a file.

use tandem_episodes::evaluation::{EvaluationPlan, ExistingRun, KeptFiles, Shard, Starts, evaluate};
use tandem_episodes::players;
use tandem_episodes::tasks::{self, Task};
use tandem_episodes::{Controller, Instructions, RendererKind, RobotFile, Sensing, Variation, read_task};
use tandem_tools_spec::{Assistance, PhaseTimes, Protocol};

/// As the book names them.
const SEEDS: [u32; 5] = [2000, 2001, 2002, 2003, 2004];

/// Phases and the hash of the last state, for each seed, as the task's expert plays.
fn played(task: &'static Task) -> Vec<(PhaseTimes, Option<String>)> {
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
        tasks: vec![task],
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

/// What `docs/src/task-files.md` says of them.
#[test]
fn a_task_of_a_file_is_scored_as_the_same_task_in_rust() {
    for id in ["handover", "big_table"] {
        let path = format!("{}/../gateway/examples/tasks/{id}.toml", env!("CARGO_MANIFEST_DIR"));
        let of_file = read_task(path.as_ref()).unwrap_or_else(|error| panic!("{error}"));
        let in_rust = tasks::find(id).expect("a task");
        assert_ne!(of_file, in_rust);
        let same = |spread| {
            SEEDS.iter().all(|seed| of_file.start_poses(*seed, spread) == in_rust.start_poses(*seed, spread))
        };
        assert!(same(tasks::Spread::Single), "{id}");
        let words = |task: &Task| {
            (task.instruction, task.phases.iter().map(|phase| phase.description).collect::<Vec<_>>())
        };
        assert_eq!(words(of_file), words(in_rust));
        assert_eq!(played(of_file), played(in_rust), "{id}");
    }
}
