//! Every task that has an expert is solved by it, within the benchmark protocol's steps, on real physics.

use std::thread::available_parallelism;

use tandem_episodes::evaluation::{Plan, evaluate};
use tandem_episodes::players::{self, experts};
use tandem_episodes::tasks::Task;
use tandem_episodes::{Controller, RobotFile};
use tandem_tools_spec::Protocol;

#[test]
fn every_task_with_an_expert_is_solved_in_order_and_nobody_falls() {
    let solved: Vec<&Task> = experts::solved().collect();
    let plan = Plan {
        player: players::find("expert").expect("a player"),
        protocol: Protocol::Benchmark,
        robot: RobotFile::default(),
        locomotion: Controller::Balance,
        tasks: solved.clone(),
        seeds: vec![3],
        jobs: available_parallelism().map_or(1, usize::from),
        record: false,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let played = evaluate(&plan, folder.path(), &|_| {}).expect("worlds can be built").episodes;
    assert_eq!(played.len(), solved.len());
    for (episode, task) in played.iter().zip(solved) {
        let result = &episode.result;
        let times_s: Vec<f64> = result.phases.0.iter().filter_map(|(_, time_s)| *time_s).collect();
        assert_eq!((result.task.as_str(), times_s.len()), (task.id, task.phases.len()), "{episode:?}");
        assert!(times_s.is_sorted() && times_s[0] > 0.0, "{episode:?}");
        assert_eq!(result.falls, 0, "{episode:?}");
        assert!(result.env_steps <= task.benchmark_steps, "{episode:?}");
    }
}
