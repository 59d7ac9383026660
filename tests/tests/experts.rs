//! Every task is solved by its expert, within the benchmark protocol's steps, on real physics.

use std::thread::available_parallelism;

use tandem_episodes::evaluation::{Plan, Shard, Starts, evaluate};
use tandem_episodes::{Controller, RendererKind, RobotFile, players, tasks};
use tandem_tools_spec::{Disclosure, Hints, Protocol};

#[test]
fn every_task_is_solved_in_order_and_nobody_falls() {
    let plan = Plan {
        player: players::find("expert").expect("a player"),
        protocol: Protocol::Benchmark,
        robot: RobotFile::default(),
        locomotion: Controller::Balance,
        disclosure: Disclosure::Live,
        hints: Hints::On,
        renderer: RendererKind::Cpu,
        tasks: tasks::ALL.iter().collect(),
        seeds: vec![3],
        starts: Starts::Task,
        shard: Shard::WHOLE,
        jobs: available_parallelism().map_or(1, usize::from),
        record: false,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let played = evaluate(&plan, folder.path(), &|_| {}).expect("worlds can be built").episodes;
    assert_eq!(played.len(), tasks::ALL.len());
    for (episode, task) in played.iter().zip(tasks::ALL) {
        let result = &episode.result;
        let times_s: Vec<f64> = result.phases.0.iter().filter_map(|(_, time_s)| *time_s).collect();
        assert_eq!((result.task.as_str(), times_s.len()), (task.id, task.phases.len()), "{episode:?}");
        assert!(times_s.is_sorted() && times_s[0] > 0.0, "{episode:?}");
        assert_eq!(result.falls, 0, "{episode:?}");
        assert!(result.env_steps <= task.benchmark_steps, "{episode:?}");
    }
}
