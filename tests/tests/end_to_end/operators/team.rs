//! Shared helpers of the operators' tests: an episode with an operator for each robot.

use serde_json::{Value, json};
use tandem_episodes::{Recorder, Recording, replay};
use tandem_tests::{Answer, TestServer};

/// An episode with operators, and its server.
pub struct Team {
    pub server: TestServer,
    pub id: String,
    pub tokens: [String; 2],
}

impl Team {
    /// Starts Handover, seed 0, with these fields in addition to the task.
    pub fn start(fields: Value) -> Team {
        Team::on(TestServer::start(), 0, fields)
    }

    /// Starts an episode with operators on `server`, with this seed.
    pub fn on(server: TestServer, seed: u32, fields: Value) -> Team {
        let mut body =
            json!({ "task": "handover", "seed": seed, "protocol": "benchmark", "operators": "per_robot" });
        body.as_object_mut().expect("an object").extend(fields.as_object().cloned().unwrap_or_default());
        let started = server.post("/v1/episodes", &body).ok();
        let tokens = ["A", "B"].map(|robot| {
            let entries = started["operators"].as_array().into_iter().flatten();
            let own = entries.into_iter().find(|entry| entry["robot"] == robot).expect("an operator");
            own["token"].as_str().expect("a token").to_owned()
        });
        let id = started["episode_id"].as_str().expect("an id").into();
        Team { server, id, tokens }
    }

    /// Calls a tool as the operator of robot number `robot`.
    pub fn ask(&self, robot: usize, tool: &str, args: Value) -> Answer {
        self.server.tool_as(&self.tokens[robot], &self.id, tool, &args)
    }

    /// Sends a command of each operator at the same time.
    pub fn both(&self, a: (&str, Value), b: (&str, Value)) -> [Answer; 2] {
        std::thread::scope(|scope| {
            let other = scope.spawn(|| self.ask(1, b.0, b.1));
            [self.ask(0, a.0, a.1), other.join().expect("the other's answer")]
        })
    }

    /// Ends the episode and verifies its recording.
    pub fn verified(&self) -> (Value, Recording) {
        let result = self.server.delete(&format!("/v1/episodes/{}", self.id)).ok();
        let path = self.server.folder(&self.id).join(Recorder::FILE_NAME);
        let recording = Recording::read(&path).expect("a whole recording");
        let verified = replay::verify(&recording).expect("a replay");
        assert_eq!(verified.outcome, replay::Verdict::Same);
        (result, recording)
    }
}
