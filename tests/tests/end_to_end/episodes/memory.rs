//! Tests of the memory that episodes use, and of leaks.

use std::{env, fs, process::Command, thread};

use serde_json::json;
use tandem::settings::Layer;
use tandem_episodes::tasks;
use tandem_tests::TestServer;

/// Returns a memory figure of this process, which includes the server: `VmRSS` is the current size,
/// `VmHWM` the peak.
fn memory_kb(what: &str) -> u64 {
    let status = fs::read_to_string("/proc/self/status").expect("the state of this process");
    let line = status.lines().find_map(|line| line.strip_prefix(what)).expect("its memory");
    line.trim_matches([':', ' ', '\t']).trim_end_matches(" kB").parse().expect("a number")
}

/// Starts `episodes` episodes, plays a few steps of each, and closes them.
fn play(server: &TestServer, episodes: usize) {
    for _ in 0..episodes {
        let id = server.episode("benchmark");
        server.tool(&id, "wait", &json!({ "steps": 2 })).ok();
        server.tool(&id, "get_robot_state", &json!({ "robot": "A" })).ok();
        server.tool(&id, "wait", &json!({ "steps": 0 })).refused(422, &[]);
        server.delete(&format!("/v1/episodes/{id}")).ok();
        // The recording is removed, since neither it nor the search for a free name is to be measured.
        fs::remove_dir_all(server.folder(&id)).expect("the episode's folder");
    }
}

fn check(episodes: usize) {
    let server = TestServer::start();
    // Warms up allocations made once: assets, server threads, and the allocator's arenas, which a hundred
    // episodes fill.
    play(&server, 200);
    let before_kb = memory_kb("VmRSS");
    play(&server, episodes);
    let after_kb = memory_kb("VmRSS");
    println!("{episodes} episodes: {before_kb} kB before, {after_kb} kB after");
    assert!(after_kb * 10 <= before_kb * 11, "{before_kb} kB became {after_kb} kB");
}

#[test]
#[ignore = "some minutes"]
fn five_hundred_episodes_leave_no_memory_behind() {
    check(500);
}

/// Maximum memory per episode: the server's growth since before the first episode, divided by their number.
const EPISODE_KB: u64 = 12_000;
/// Memory allowance per CPU core that renders.
const CORE_KB: u64 = 40_000;
const EPISODES: usize = 21;
/// Environment variable set in a process that runs this test alone.
const ALONE: &str = "TANDEM_TESTS_MEMORY_ALONE";

#[test]
#[ignore = "a process of its own, which the test below starts"]
fn episodes_side_by_side() {
    if env::var_os(ALONE).is_none() {
        return;
    }
    let server = TestServer::with(Layer { max_episodes: Some(EPISODES as u32), ..Layer::default() });
    let before_kb = memory_kb("VmRSS");
    let start = |seed: usize, task: &tasks::Task| {
        let args = json!({ "task": task.id, "seed": seed, "protocol": "benchmark" });
        server.post("/v1/episodes", &args).ok()["episode_id"].as_str().expect("an id").to_owned()
    };
    let play = |id: &str| {
        for _ in 0..3 {
            server.tool(id, "wait", &json!({ "steps": 5 })).ok();
            server.tool(id, "observe", &json!({})).ok();
        }
    };
    let cast = || tasks::cohub().iter().cycle().take(EPISODES).enumerate();
    let ids: Vec<String> = cast().map(|(seed, task)| start(seed, task)).collect();
    ids.iter().for_each(|id| play(id));
    let each_kb = (memory_kb("VmRSS") - before_kb) / EPISODES as u64;
    println!("{EPISODES} episodes by turns: {before_kb} kB before, {each_kb} kB each");
    assert!(each_kb <= EPISODE_KB, "{each_kb} kB each");
    ids.iter().for_each(|id| drop(server.delete(&format!("/v1/episodes/{id}")).ok()));
    thread::scope(|scope| {
        for (seed, task) in cast() {
            scope.spawn(move || play(&start(seed, task)));
        }
    });
    let most_kb = memory_kb("VmHWM") - before_kb;
    println!("{EPISODES} episodes that start and play at once: at most {most_kb} kB");
    let cores = thread::available_parallelism().map_or(1, usize::from) as u64;
    assert!(most_kb <= EPISODES as u64 * EPISODE_KB + cores * CORE_KB, "at most {most_kb} kB");
}

/// Runs in a separate process, since other tests of this program also allocate memory.
#[test]
fn an_episode_takes_at_most_twelve_megabytes() {
    let mut alone = Command::new(env::current_exe().expect("this program"));
    alone
        .args(["--exact", "episodes::memory::episodes_side_by_side", "--ignored", "--nocapture"])
        .env(ALONE, "1");
    let output = alone.output().expect("this program again");
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success() && told.contains("1 passed"),
        "{told}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    println!("{told}");
}
