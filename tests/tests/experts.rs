//! Every task that has an expert is solved by it on real physics, some within the benchmark protocol's steps.

use std::thread::available_parallelism;

use tandem_episodes::evaluation::{Plan, Shard, Starts, evaluate};
use tandem_episodes::players::{self, experts};
use tandem_episodes::tasks::Task;
use tandem_episodes::{Controller, RendererKind, RobotFile};
use tandem_tools_spec::{Disclosure, Hints, Protocol};

/// Tasks whose experts keep within the benchmark protocol's steps; the others take the time of the agentic protocol.
const IN_TIME: [&str; 4] = ["handover", "pouring", "frame_hang", "co_pouring"];

/// Seeds on which nobody tuned anything.
const SEEDS: [u32; 3] = [3, 6100, 6101];

/// Plays the experts of `tasks`: phases in order, and nobody falls.
fn solve(protocol: Protocol, tasks: Vec<&'static Task>) {
    let plan = Plan {
        player: players::find("expert").expect("a player"),
        protocol,
        scene: None,
        robot: RobotFile::default(),
        locomotion: Controller::Balance,
        disclosure: Disclosure::Live,
        hints: Hints::On,
        renderer: RendererKind::Cpu,
        tasks: tasks.clone(),
        seeds: SEEDS.into(),
        starts: Starts::Task,
        shard: Shard::WHOLE,
        jobs: available_parallelism().map_or(1, usize::from),
        record: false,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let played = evaluate(&plan, folder.path(), &|_| {}).expect("worlds can be built").episodes;
    assert_eq!(played.len(), tasks.len() * SEEDS.len());
    for episode in &played {
        let task = tasks.iter().find(|task| task.id == episode.result.task).expect("a task of the plan");
        let result = &episode.result;
        let times_s: Vec<f64> = result.phases.0.iter().filter_map(|(_, time_s)| *time_s).collect();
        assert_eq!((result.task.as_str(), times_s.len()), (task.id, task.phases.len()), "{episode:?}");
        assert!(times_s.is_sorted() && times_s[0] > 0.0, "{episode:?}");
        assert_eq!(result.falls, 0, "{episode:?}");
    }
}

#[test]
fn experts_that_stand_solve_their_tasks_in_time() {
    solve(Protocol::Benchmark, experts::solved().filter(|task| IN_TIME.contains(&task.id)).collect());
}

#[test]
fn experts_that_walk_solve_their_tasks() {
    solve(Protocol::Agentic, experts::solved().filter(|task| !IN_TIME.contains(&task.id)).collect());
}
