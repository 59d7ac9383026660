//! Tests with thousands of hostile calls: a refused call changes no state, reveals nothing about the
//! server, and ends no episode.

mod generate;

use std::sync::Arc;

use axum::{
    Router,
    body::{Body, to_bytes},
    http::{Request, StatusCode, header},
};
use hyper::service::Service as _;
use hyper_util::service::TowerToHyperService;
use serde_json::{Value, json};
use tandem_episodes::tasks;
use tandem_tools_spec::{Hints, ManageReply, Protocol, StartEpisode, ToolReply, ToolSpec, tool_specs};
use tokio::runtime::Runtime;

use super::{
    app::AppState,
    gate::{Gate, limits::Limits},
    router::router,
    watching::WatchKey,
};
use crate::{
    hosting::EpisodeTable,
    settings::{Layer, Settings},
};
use generate::{SplitMix64, allowed, bytes, spoil, text};

/// A server without a network, and the only episode that it holds.
struct Target {
    runtime: Runtime,
    router: TowerToHyperService<Router>,
    table: Arc<EpisodeTable>,
    specs: Vec<ToolSpec>,
    runs: tempfile::TempDir,
    id: String,
}

/// The response to a request.
struct RawReply {
    status: StatusCode,
    body: Value,
}

impl RawReply {
    /// Returns true if the request was refused over HTTP, by JSON-RPC, or as a tool's answer over MCP.
    fn refuses(&self) -> bool {
        !self.status.is_success() || self.body["error"].is_object() || self.body["result"]["isError"] == true
    }
}

impl Target {
    fn new() -> Target {
        let runs = tempfile::tempdir().unwrap();
        let flags = Layer { runs: Some(runs.path().into()), max_episodes: Some(1), ..Layer::default() };
        let settings = Settings::resolve(flags, None).unwrap();
        let table = Arc::new(EpisodeTable::new(settings.clone()));
        let key = WatchKey::random().unwrap();
        let app = AppState::new(table.clone(), settings.clone(), key);
        let gate = Gate::new(settings.clone(), [127, 0, 0, 1].into());
        let router = TowerToHyperService::new(router(app, gate, Limits::new(&settings)));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let specs = tool_specs(Hints::On);
        let mut target = Target { runtime, router, table, specs, runs, id: String::new() };
        target.start();
        target
    }

    fn start(&mut self) {
        let task = tasks::cohub()[0].id.clone();
        let args = StartEpisode { task, seed: 0, protocol: Some(Protocol::Benchmark), short: false };
        self.id = self.runtime.block_on(self.table.start(args)).unwrap().episode_id;
    }

    /// Returns the state hash and control steps of the episode, and true if it has ended.
    fn state(&self) -> (Option<String>, u32, bool) {
        let episode = self.table.get(&self.id).unwrap();
        match self.runtime.block_on(episode.status()).unwrap().reply {
            ToolReply::Manage(ManageReply::GetStatus(status)) => {
                (status.state_hash, status.env_steps, status.ended.is_some())
            }
            other => panic!("{other:?} is no status"),
        }
    }

    fn send(&self, request: Request<Body>) -> RawReply {
        self.runtime.block_on(async {
            let response = self.router.call(request).await.unwrap_or_else(|never| match never {});
            let status = response.status();
            let bytes = to_bytes(Body::new(response.into_body()), usize::MAX).await.unwrap();
            let body = serde_json::from_slice(&bytes).unwrap_or_default();
            RawReply { status, body }
        })
    }

    /// Generates a random request: its path and body.
    fn request(&self, random: &mut SplitMix64) -> (String, Vec<u8>) {
        let spec = random.of(&self.specs);
        let mut args = allowed(&spec.body_schema(50), random);
        for _ in 0..*random.of(&[0, 1, 1, 1, 1, 1, 2, 3]) {
            spoil(&mut args, random);
        }
        match random.below(20) {
            0 => ("/v1/episodes".into(), bytes(&args, random)),
            1 => (format!("/v1/episodes/{}/tools/x{}", self.id, random.below(9)), bytes(&args, random)),
            2 => (format!("/v1/episodes/nope{}/tools/{}", random.below(9), spec.name), bytes(&args, random)),
            3..=6 => ("/mcp".into(), bytes(&self.over_mcp(spec.name, args, random), random)),
            _ => (format!("/v1/episodes/{}/tools/{}", self.id, spec.name), bytes(&args, random)),
        }
    }

    fn over_mcp(&self, tool: &str, mut args: Value, random: &mut SplitMix64) -> Value {
        let name = if random.percent(90) { tool.to_owned() } else { text(random) };
        if let (true, Some(args)) = (random.percent(90), args.as_object_mut()) {
            args.insert("episode_id".into(), json!(self.id));
        }
        let method =
            *random.of(&["tools/call", "tools/call", "tools/call", "prompts/get", "tools/list", "x"]);
        let params = json!({ "name": name, "arguments": args });
        let mut message = json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params });
        if random.percent(10) {
            spoil(&mut message, random);
        }
        message
    }
}

/// Checks that a refusal has a message and reveals no secret.
fn check_refusal(target: &Target, answer: &RawReply, sent: &str) {
    let shown = answer.body.to_string();
    assert_ne!(answer.status, StatusCode::INTERNAL_SERVER_ERROR, "{sent}: {shown}");
    let runs = target.runs.path().to_string_lossy().into_owned();
    for secret in [&*runs, "panicked", ".rs:", "RUST_BACKTRACE"] {
        assert!(!shown.contains(secret), "{sent}: {shown} tells {secret:?}");
    }
    let says_something = shown.contains("detail") || shown.contains("message") || shown.contains("text");
    assert!(says_something, "{sent}: refused with {shown:?}");
    assert!(shown.len() < 4 * sent.len() + 4096, "{sent}: refused with {} bytes", shown.len());
}

/// Sends `calls` random requests and returns the number of refusals.
fn play(calls: usize, seed: u64) -> usize {
    let mut target = Target::new();
    let mut random = SplitMix64(seed);
    let mut before = target.state();
    let mut refused = 0;
    for number in 0..calls {
        let (path, body) = target.request(&mut random);
        let request = Request::post(&path)
            .header(header::HOST, "localhost")
            .header(header::CONTENT_TYPE, "application/json")
            .header(header::ACCEPT, "application/json, text/event-stream")
            .body(Body::from(body.clone()))
            .unwrap();
        let sent = format!("seed {seed}, call {number}: POST {path} {}", String::from_utf8_lossy(&body));
        let answer = target.send(request);
        if answer.refuses() {
            refused += 1;
            check_refusal(&target, &answer, &sent);
        }
        // An ended episode has made room for another.
        if target.table.get(&target.id).is_err() {
            target.id = answer.body["episode_id"].as_str().unwrap_or(&target.id).to_owned();
            assert!(target.table.get(&target.id).is_ok(), "{sent}: the episode is gone");
            before = target.state();
            continue;
        }
        let after = target.state();
        assert!(!answer.refuses() || after == before, "{sent}: refused, and yet {before:?} became {after:?}");
        before = after;
        if before.2 {
            target.start();
            before = target.state();
        }
    }
    refused
}

fn check(calls: usize, seed: u64) {
    let refused = play(calls, seed);
    assert!(refused * 2 > calls, "of {calls} calls only {refused} were hostile enough to be refused");
    assert!(refused < calls, "none of {calls} calls was taken");
}

#[test]
fn hostile_calls_change_nothing() {
    check(2_000, 0);
}

#[test]
#[ignore = "a minute or two"]
fn a_quarter_of_a_hundred_thousand_hostile_calls() {
    check(25_000, 1);
}

#[test]
#[ignore = "a minute or two"]
fn the_second_quarter() {
    check(25_000, 2);
}

#[test]
#[ignore = "a minute or two"]
fn the_third_quarter() {
    check(25_000, 3);
}

#[test]
#[ignore = "a minute or two"]
fn the_last_quarter() {
    check(25_000, 4);
}
