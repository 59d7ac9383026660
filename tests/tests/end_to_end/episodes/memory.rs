//! Episodes leave no memory behind.

use std::fs;

use serde_json::json;
use tandem_tests::TestServer;

/// Resident memory of this process, which is the server's, too.
fn resident_kb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").expect("the state of this process");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("its memory");
    line.trim().trim_end_matches(" kB").parse().expect("a number")
}

/// Starts this many episodes, plays each a little, and closes them.
fn play(server: &TestServer, episodes: usize) {
    for _ in 0..episodes {
        let id = server.episode("benchmark");
        server.tool(&id, "wait", &json!({ "steps": 2 })).ok();
        server.tool(&id, "get_robot_state", &json!({ "robot": "A" })).ok();
        server.tool(&id, "wait", &json!({ "steps": 0 })).refused(422, &[]);
        server.delete(&format!("/v1/episodes/{id}")).ok();
        // What was recorded is not what is measured, and names are looked for one by one.
        fs::remove_dir_all(server.folder(&id)).expect("the episode's folder");
    }
}

fn check(episodes: usize) {
    let server = TestServer::start();
    // What is allocated once: assets, the allocator's own arenas, threads of the server.
    play(&server, 20);
    let before_kb = resident_kb();
    play(&server, episodes);
    let after_kb = resident_kb();
    println!("{episodes} episodes: {before_kb} kB before, {after_kb} kB after");
    assert!(after_kb * 10 <= before_kb * 11, "{before_kb} kB became {after_kb} kB");
}

#[test]
#[ignore = "some minutes"]
fn five_hundred_episodes_leave_no_memory_behind() {
    check(500);
}
