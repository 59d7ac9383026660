//! Tests of a server with a token: callers without it receive no information, and no text of callers is
//! logged.

use std::{
    io,
    sync::{Arc, Mutex},
};

use serde_json::json;
use tandem::{settings::Layer, token::Token};
use tandem_tests::TestServer;
use tracing::Level;

const TOKEN: &str = "correct-horse-battery-staple";

fn server() -> TestServer {
    let token = Some(Token::parse(TOKEN, "a test").expect("a token"));
    TestServer::with(Layer { token, ..Layer::default() })
}

/// Routes of all kinds, including some that do not exist.
const ROUTES: [(&str, &str); 12] = [
    ("GET", "/"),
    ("GET", "/v1/episodes"),
    ("GET", "/healthz"),
    ("GET", "/v1/tasks"),
    ("GET", "/v1/openapi.json"),
    ("POST", "/v1/episodes"),
    ("GET", "/v1/episodes/handover-seed0"),
    ("DELETE", "/v1/episodes/nope"),
    ("POST", "/v1/episodes/handover-seed0/tools/wait"),
    ("POST", "/mcp"),
    ("GET", "/nowhere"),
    ("PATCH", "/v1/episodes/%ff"),
];

#[test]
fn who_has_no_token_gets_one_answer_everywhere() {
    let server = server();
    let own = [("authorization", &*format!("Bearer {TOKEN}"))];
    let start = json!({ "task": "handover", "seed": 0, "protocol": "benchmark" });
    assert_eq!(server.post_with("/v1/episodes", &own, &start).status, 201);
    let mut answers = Vec::new();
    for (method, path) in ROUTES {
        for headers in [
            &[][..],
            &[("authorization", "Bearer correct-horse-battery-stapl")],
            &[("authorization", "Basic Y29ycmVjdA==")],
            &[("authorization", TOKEN)],
            &[own[0], own[0]],
            &[("host", "evil.example"), ("origin", "http://evil.example"), ("content-type", "text/plain")],
        ] {
            let body: &[u8] = if method == "POST" { b"no JSON" } else { b"" };
            let (status, mut answer, bytes) = server.ask(method, path, headers, body);
            assert_eq!((status, &answer["www-authenticate"]), (401, &"Bearer".parse().unwrap()), "{path}");
            answer.remove("date");
            answers.push((answer, bytes));
        }
    }
    assert!(answers.iter().all(|answer| *answer == answers[0]), "{answers:?}");
    let (status, _, _) = server.ask("GET", "/v1/episodes/handover-seed0", &own, b"");
    assert_eq!(status, 200);
    let moved = server.tool_as(TOKEN, "handover-seed0", "wait", &json!({ "steps": 2 })).ok();
    assert_eq!(moved["step"], 2);
}

/// All lines logged by this process.
#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl io::Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().expect("the lines").write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn no_log_has_what_callers_send() {
    let lines = Lines::default();
    let writer = lines.clone();
    let log = tracing_subscriber::fmt().with_max_level(Level::TRACE).with_ansi(false);
    let log = log.with_writer(move || writer.clone()).finish();
    tracing::subscriber::set_global_default(log).expect("the only log of this program");

    const SECRET: &str = "xyzzy-plugh-plover";
    let server = server();
    let own = format!("Bearer {TOKEN}");
    let hidden = format!("Bearer {SECRET}");
    let rpc = |method: &str| {
        let params = json!({ "name": "wait", "arguments": { "episode_id": SECRET, "steps": 1 } });
        json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params }).to_string()
    };
    for token in [&own, &hidden] {
        for (method, path, body) in [
            ("GET", format!("/v1/episodes/{SECRET}"), String::new()),
            ("GET", format!("/{SECRET}/v1/tasks?token={SECRET}"), String::new()),
            ("GET", format!("/v1/tasks?token={SECRET}"), String::new()),
            ("PUT", format!("/v1/tasks/{SECRET}"), String::new()),
            ("POST", format!("/v1/episodes/{SECRET}/tools/{SECRET}"), "{}".into()),
            ("POST", format!("/mcp?token={SECRET}"), rpc("tools/call")),
            ("POST", format!("/mcp/{SECRET}"), rpc("tools/list")),
            ("POST", "/mcp".into(), "no JSON".into()),
            ("POST", "/v1/episodes".into(), r#"{"task": "handover", "seed": 0}"#.into()),
        ] {
            let headers = [
                ("authorization", token.as_str()),
                ("content-type", "application/json"),
                ("accept", "application/json, text/event-stream"),
                ("idempotency-key", SECRET),
                ("cookie", SECRET),
                ("x-api-key", SECRET),
                ("mcp-session-id", SECRET),
                ("user-agent", SECRET),
            ];
            server.ask(method, &path, &headers, body.as_bytes());
        }
    }
    drop(server);
    let log = String::from_utf8(lines.0.lock().expect("the lines").clone()).expect("text");
    assert!(log.contains("/v1/episodes/{id}/tools/{name}"), "requests are logged: {log}");
    for secret in [TOKEN, SECRET] {
        let told: Vec<&str> = log.lines().filter(|line| line.contains(secret)).collect();
        assert!(told.is_empty(), "{}", told.join("\n"));
    }
}
