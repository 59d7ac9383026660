//! The server under test, and the tests' HTTP client.

use std::{net::SocketAddr, path::PathBuf, sync::Arc, time::Duration};

use serde_json::{Value, json};
use tandem::{
    hosting::Guests,
    http::Server,
    settings::{Layer, Settings},
};
use ureq::{Agent, SendBody, http};

/// A response of the server, successful or not.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub headers: http::HeaderMap,
    pub body: Value,
}

impl Answer {
    /// Returns the body of a response, which must be a success.
    #[track_caller]
    pub fn ok(self) -> Value {
        assert!((200..300).contains(&self.status), "{self:?}");
        self.body
    }

    /// Returns the value of a header, or an empty string if it is absent.
    pub fn header(&self, name: &str) -> &str {
        self.headers.get(name).and_then(|value| value.to_str().ok()).unwrap_or_default()
    }

    /// Checks a refusal: problem details with this status and a text that contains each of `says`.
    #[track_caller]
    pub fn refused(&self, status: u16, says: &[&str]) {
        assert_eq!(
            (self.status, self.header("content-type")),
            (status, "application/problem+json"),
            "{self:?}"
        );
        assert_eq!(self.body["status"], json!(status), "{self:?}");
        let detail = self.body["detail"].as_str().unwrap_or_default();
        for part in says {
            assert!(detail.contains(part), "{detail:?} does not say {part:?}");
        }
    }
}

/// A server that records into a temporary folder and hosts up to two episodes.
pub struct TestServer {
    server: Option<Server>,
    settings: Arc<Settings>,
    pub address: SocketAddr,
    pub runs: tempfile::TempDir,
    agent: Agent,
}

impl TestServer {
    pub fn start() -> TestServer {
        TestServer::with(Layer::default())
    }

    /// Starts a server like [`TestServer::start`], with further settings.
    pub fn with(flags: Layer) -> TestServer {
        TestServer::with_guests(flags, Guests::default())
    }

    /// Starts a server like [`TestServer::with`], with guests.
    pub fn with_guests(flags: Layer, guests: Guests) -> TestServer {
        let runs = tempfile::tempdir().expect("a temporary folder");
        let flags = Layer {
            listen: Some("127.0.0.1:0".parse().expect("an address")),
            runs: Some(runs.path().into()),
            max_episodes: flags.max_episodes.or(Some(2)),
            ..flags
        };
        let settings = Settings::resolve(flags, None).expect("settings without a file");
        let server = Server::start_for(settings.clone(), guests).expect("a free port");
        let timeout = Some(Duration::from_secs(60));
        let agent =
            Agent::config_builder().http_status_as_error(false).timeout_global(timeout).build().new_agent();
        TestServer { address: server.address(), server: Some(server), settings, runs, agent }
    }

    /// Returns the fragment (after `#`) of the viewers' link.
    pub fn watch_key(&self) -> String {
        let link = self.server.as_ref().expect("a running server").watch_link();
        link.split_once('#').expect("a link with a key").1.into()
    }

    /// Stops the server in the same way as SIGTERM.
    pub fn stop(&mut self) {
        let left = self.server.take().expect("a running server").stop();
        assert!(left.is_empty(), "{left:?} did not end");
    }

    /// Stops the server in the same way as SIGTERM, and starts another with the same folder of runs.
    pub fn restart(&mut self, guests: Guests) {
        let left = self.server.take().expect("a running server").stop_keeping();
        assert!(left.is_empty(), "{left:?} did not stop");
        let server = Server::start_for(self.settings.clone(), guests).expect("a free port");
        self.address = server.address();
        self.server = Some(server);
    }

    /// Starts an episode of Handover and returns its id.
    #[track_caller]
    pub fn episode(&self, protocol: &str) -> String {
        let started =
            self.post("/v1/episodes", &json!({ "task": "handover", "seed": 0, "protocol": protocol })).ok();
        started["episode_id"].as_str().expect("an id").into()
    }

    /// Returns the folder into which an episode is recorded.
    pub fn folder(&self, id: &str) -> PathBuf {
        self.runs.path().join(id)
    }

    pub fn tool(&self, id: &str, tool: &str, args: &Value) -> Answer {
        self.post(&format!("/v1/episodes/{id}/tools/{tool}"), args)
    }

    /// Returns the headers and the text of a page that is not JSON.
    #[track_caller]
    pub fn page(&self, path: &str) -> (http::HeaderMap, String) {
        let page =
            self.agent.get(format!("http://{}{path}", self.address)).header("accept", "text/html, */*;q=0.8");
        let mut page = page.call().expect("a page");
        assert_eq!(page.status(), 200, "{path}");
        (page.headers().clone(), page.body_mut().read_to_string().expect("a text"))
    }

    pub fn post(&self, path: &str, body: &Value) -> Answer {
        self.send("POST", path, Some("application/json"), body.to_string().as_bytes())
    }

    pub fn get(&self, path: &str) -> Answer {
        self.send("GET", path, None, b"")
    }

    pub fn delete(&self, path: &str) -> Answer {
        self.send("DELETE", path, None, b"")
    }

    /// Posts like [`TestServer::post`], with further headers.
    pub fn post_with(&self, path: &str, headers: &[(&str, &str)], body: &Value) -> Answer {
        let headers = [&[("content-type", "application/json")], headers].concat();
        json_answer(self.ask("POST", path, &headers, body.to_string().as_bytes()))
    }

    /// Calls a tool with this caller's token.
    pub fn tool_as(&self, token: &str, id: &str, tool: &str, args: &Value) -> Answer {
        let path = format!("/v1/episodes/{id}/tools/{tool}");
        self.post_with(&path, &[("authorization", &format!("Bearer {token}"))], args)
    }

    /// Returns the raw response to a request: status, headers and bytes.
    pub fn ask(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        body: &[u8],
    ) -> (u16, http::HeaderMap, Vec<u8>) {
        let mut request =
            http::Request::builder().method(method).uri(format!("http://{}{path}", self.address));
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let answer = match body.is_empty() {
            true => self.agent.run(request.body(SendBody::none()).expect("a request")),
            false => self.agent.run(request.body(body).expect("a request")),
        };
        let mut answer = answer.unwrap_or_else(|error| panic!("{method} {path}: {error}"));
        let bytes = answer.body_mut().with_config().limit(50_000_000).read_to_vec().expect("a body");
        (answer.status().as_u16(), answer.headers().clone(), bytes)
    }

    /// Sends arbitrary bytes with any content type.
    pub fn send(&self, method: &str, path: &str, content_type: Option<&str>, body: &[u8]) -> Answer {
        // MCP requires this header, and REST accepts it.
        let accept = ("accept", "application/json, text/event-stream");
        let content_type = content_type.map(|kind| ("content-type", kind));
        let headers: Vec<(&str, &str)> = [accept].into_iter().chain(content_type).collect();
        json_answer(self.ask(method, path, &headers, body))
    }
}

fn json_answer((status, headers, bytes): (u16, http::HeaderMap, Vec<u8>)) -> Answer {
    let text = String::from_utf8_lossy(&bytes);
    let body = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
    Answer { status, headers, body }
}
