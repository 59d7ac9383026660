//! Evaluations: the number of jobs changes nothing, and an interrupted run goes on where it stopped.

use std::sync::atomic::{AtomicU32, Ordering};

use tandem_episodes::evaluation::{Plan, Played, evaluate};
use tandem_episodes::{Controller, RendererKind, RobotFile, players, tasks};
use tandem_tools_spec::Protocol;

fn plan(jobs: usize, seeds: Vec<u32>) -> Plan {
    let handover = tasks::find("handover").expect("a task");
    Plan {
        player: players::find("expert").expect("a player"),
        protocol: Protocol::Benchmark,
        robot: RobotFile::default(),
        locomotion: Controller::Balance,
        renderer: RendererKind::Cpu,
        tasks: vec![handover],
        seeds,
        jobs,
        record: false,
    }
}

/// State hashes without the times that a machine took.
fn hashes(episodes: &[Played]) -> Vec<(u32, &str)> {
    episodes.iter().map(|episode| (episode.result.seed, episode.result.state_hash.as_str())).collect()
}

#[test]
fn jobs_change_nothing_and_kept_episodes_are_not_played_again() {
    let [one, two] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
    let alone = evaluate(&plan(1, vec![1, 2]), one.path(), &|_| {}).expect("it is played");
    let parallel = evaluate(&plan(2, vec![1, 2]), two.path(), &|_| {}).expect("it is played");
    assert_eq!(hashes(&alone.episodes), hashes(&parallel.episodes));
    assert_ne!(alone.episodes[0].result.state_hash, alone.episodes[1].result.state_hash);
    assert_eq!(alone.tasks["handover"].p3, 2);

    // A kept episode comes back with the figures of the machine that played it; a lost one is played again.
    std::fs::remove_file(one.path().join("episodes/handover-2.json")).expect("the file was written");
    let finished = AtomicU32::new(0);
    let count = |_: &Played| {
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
