//! SIGTERM while an episode starts.

use std::{process::Command, thread};

use serde_json::json;

use crate::{Delays, Server, partials};

#[test]
fn a_server_that_is_stopped_while_an_episode_starts_ends() {
    let mut delays = Delays(1);
    for round in 0..20 {
        let runs = tempfile::tempdir().expect("a temporary folder");
        let mut server = Server::start(runs.path());
        let id = server.id().to_string();
        let delay = delays.next(1000);
        let answer = thread::scope(|scope| {
            let starting =
                scope.spawn(|| server.post("/v1/episodes", &json!({ "task": "handover", "seed": round })));
            thread::sleep(delay);
            assert!(Command::new("kill").args(["-TERM", &id]).status().expect("kill").success());
            starting.join().expect("the client")
        });
        let status = server.ended();
        assert!(status.success(), "after {delay:?}: {status}");
        assert!(partials(runs.path()).is_empty(), "after {delay:?}: {answer:?}");
    }
}
