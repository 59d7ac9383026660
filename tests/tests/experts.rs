//! Every task is solved by its expert, within the benchmark protocol's steps, on real physics.

use tandem_episodes::evaluation::InProcess;
use tandem_episodes::experts::perform;
use tandem_episodes::{LocomotionChoice, Session, tasks};
use tandem_tools_spec::Protocol;

/// Plays a task and checks that all phases were reached in order and that nobody fell.
fn solve(id: &str, seed: u32) {
    let task = tasks::find(id).expect("a task");
    let session = Session::start(task, seed, Protocol::Benchmark, &LocomotionChoice::Balance, None)
        .expect("the world can be built");
    let mut arena = InProcess(session);
    let outcome = perform(task, &mut arena);
    let result = arena.0.close().expect("nothing is written");
    let times_s: Vec<f64> = result.phases.0.iter().filter_map(|(_, time_s)| *time_s).collect();
    assert_eq!(times_s.len(), 3, "{id}, seed {seed}: {:?}, {outcome:?}", result.phases);
    assert!(times_s.is_sorted() && times_s[0] > 0.0, "{times_s:?}");
    assert_eq!(result.falls, 0);
    assert!(result.env_steps <= task.benchmark_steps);
}

#[test]
fn handover() {
    solve("handover", 3);
}

#[test]
fn pouring() {
    solve("pouring", 3);
}

#[test]
fn frame_hang() {
    solve("frame_hang", 3);
}

#[test]
fn co_pouring() {
    solve("co_pouring", 3);
}
