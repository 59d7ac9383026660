//! Tests of access: programs on this machine are admitted, and web pages are not.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    time::Duration,
};

use serde_json::{Value, json};
use tandem::{settings::Layer, token::Token};
use tandem_tests::TestServer;

/// Sends raw bytes and returns all bytes received until the server closes the connection.
fn raw(server: &TestServer, request: &str) -> String {
    let mut stream = TcpStream::connect(server.address).expect("a connection");
    stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a timeout");
    stream.write_all(request.as_bytes()).expect("a request");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("the server closes the connection");
    String::from_utf8_lossy(&answer).into_owned()
}

/// Sends a request with these headers and this body, and returns the response.
fn ask(server: &TestServer, line: &str, headers: &[&str], body: &str) -> String {
    let mut request =
        format!("{line} HTTP/1.1\r\nconnection: close\r\naccept: application/json, text/event-stream\r\n");
    headers.iter().for_each(|header| request += &format!("{header}\r\n"));
    raw(server, &format!("{request}content-length: {}\r\n\r\n{body}", body.len()))
}

fn status(answer: &str) -> &str {
    answer.split(' ').nth(1).unwrap_or("none")
}

fn header<'a>(answer: &'a str, name: &str) -> &'a str {
    let named = |line: &'a str| line.split_once(": ").filter(|(other, _)| other.eq_ignore_ascii_case(name));
    answer.lines().find_map(named).map_or("", |(_, value)| value)
}

const JSON: &str = "content-type: application/json";

/// A request to every route, with a body if the route reads one. The episode is the first with seed 0.
const REQUESTS: [(&str, &str); 15] = [
    ("GET /healthz", ""),
    ("GET /metrics", ""),
    ("GET /docs", ""),
    ("GET /v1/tasks", ""),
    ("GET /v1/tools", ""),
    ("GET /v1/openapi.json", ""),
    ("GET /v1/nowhere", ""),
    ("POST /mcp", r#"{"jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": {}}"#),
    ("POST /v1/episodes", r#"{"task": "handover", "seed": 0, "protocol": "benchmark"}"#),
    ("GET /v1/episodes/handover-seed0", ""),
    ("POST /v1/episodes/handover-seed0/tools/wait", r#"{"steps": 1}"#),
    ("POST /v1/episodes/handover-seed0/tools/finish", ""),
    ("DELETE /v1/episodes/handover-seed0", ""),
    ("GET /", ""),
    ("GET /v1/episodes", ""),
];

#[test]
fn requests_for_other_hosts_and_from_other_sites_change_nothing() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let before = server.get(&format!("/v1/episodes/{id}")).ok();
    for (line, body) in REQUESTS {
        for foreign in [
            &["host: evil.example", JSON][..],
            &[JSON],
            &["host: localhost", "origin: http://evil.example", JSON],
            &["host: localhost:8700", "origin: http://localhost:3000", JSON],
            &["host: localhost", "origin: null", JSON],
            &["host: localhost", "origin: http://evil.example", "content-type: text/plain"],
        ] {
            let answer = ask(&server, line, foreign, body);
            assert_eq!(status(&answer), "403", "{line} {foreign:?}: {answer}");
            assert_eq!(header(&answer, "content-type"), "application/problem+json", "{line}: {answer}");
        }
    }
    assert_eq!(server.get(&format!("/v1/episodes/{id}")).ok(), before);
    assert_eq!(server.get("/healthz").ok()["episodes"], 1);
}

#[test]
fn programs_and_pages_of_our_own_come_in() {
    let server =
        TestServer::with(Layer { allowed_host: Some(vec!["lab.example".into()]), ..Layer::default() });
    let port = server.address.port();
    for host in [
        format!("127.0.0.1:{port}"),
        format!("localhost:{port}"),
        format!("[::1]:{port}"),
        "lab.example".into(),
    ] {
        for origin in [None, Some(format!("origin: http://{host}")), Some(format!("origin: https://{host}"))]
        {
            let host = format!("host: {host}");
            let headers: Vec<&str> = [host.as_str(), JSON].into_iter().chain(origin.as_deref()).collect();
            for (line, body) in [REQUESTS[0], REQUESTS[7]] {
                let answer = ask(&server, line, &headers, body);
                assert_eq!(status(&answer), "200", "{line} {headers:?}: {answer}");
            }
        }
    }
}

#[test]
fn a_body_has_to_be_called_json() {
    let server = TestServer::start();
    let start = r#"{"task": "handover", "seed": 0, "protocol": "benchmark"}"#;
    let ask = |line: &str, headers: &[&str], body: &str| {
        ask(&server, line, &[&["host: localhost"], headers].concat(), body)
    };
    for kind in [&[][..], &["content-type: text/plain"], &["content-type: application/x-www-form-urlencoded"]]
    {
        let answer = ask("POST /v1/episodes", kind, start);
        assert_eq!(status(&answer), "415", "{kind:?}: {answer}");
    }
    assert_eq!(status(&ask("POST /v1/episodes", &[JSON], start)), "201");
    let finish = "POST /v1/episodes/handover-seed0/tools/finish";
    assert_eq!(status(&ask(finish, &["content-type: text/plain"], "")), "415");
    assert_eq!(
        status(&ask(finish, &[], "")),
        "200",
        "where nothing has to be said, nothing has to be called JSON"
    );
}

#[test]
fn other_methods_are_told_which_there_are() {
    let server = TestServer::start();
    for (path, allowed) in [
        ("/healthz", "GET,HEAD"),
        ("/v1/episodes", "GET,HEAD,POST"),
        ("/v1/episodes/x", "GET,HEAD,DELETE"),
        ("/v1/episodes/x/tools/wait", "POST"),
    ] {
        let answer = server.send("PATCH", path, None, b"");
        answer.refused(405, &[path]);
        assert_eq!(answer.header("allow"), allowed, "{path}");
    }
    let answer = server.get("/mcp");
    answer.refused(405, &[]);
    assert!(answer.header("allow").contains("POST"), "{answer:?}");
}

#[test]
fn a_refusal_names_no_other_callers_episode() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    for answer in [server.get("/v1/episodes/nope"), server.tool("nope", "wait", &json!({ "steps": 1 }))] {
        answer.refused(404, &["\"nope\""]);
        assert!(!answer.body.to_string().contains(&id), "{answer:?}");
    }
}

#[test]
fn who_does_not_finish_a_request_is_cut_off() {
    let server = TestServer::with(Layer { request_timeout: Some(1), ..Layer::default() });
    let header_only = raw(&server, "GET /healthz HTTP/1.1\r\nhost: local");
    assert!(!header_only.contains("200"), "{header_only}");
    for path in ["/v1/episodes", "/mcp"] {
        let answer = raw(
            &server,
            &format!("POST {path} HTTP/1.1\r\nhost: localhost\r\n{JSON}\r\ncontent-length: 99\r\n\r\n{{"),
        );
        assert_eq!((status(&answer), header(&answer, "connection")), ("408", "close"), "{answer}");
        let body = answer.rsplit("\r\n\r\n").next().unwrap_or_default();
        let problem: Value = serde_json::from_str(body).expect("problem details");
        assert_eq!(problem["detail"], "the body did not arrive in 1 s; send it again, in one go");
    }
}

const TOKEN: &str = "correct-horse-battery-staple";

fn with_token(flags: Layer) -> TestServer {
    TestServer::with(Layer { token: Some(Token::parse(TOKEN, "a test").expect("a token")), ..flags })
}

/// A connection kept open between requests.
struct Kept(TcpStream);

impl Kept {
    fn open(server: &TestServer) -> Kept {
        let stream = TcpStream::connect(server.address).expect("a connection");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a timeout");
        Kept(stream)
    }

    /// Sends a request without a body and returns the status; `None` if the server has closed the connection.
    fn ask(&mut self, path: &str, token: &str) -> Option<u16> {
        let request =
            format!("GET {path} HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer {token}\r\n\r\n");
        self.0.write_all(request.as_bytes()).ok()?;
        let mut answer = String::new();
        let mut reader = BufReader::new(&self.0);
        reader.read_line(&mut answer).ok().filter(|read| *read > 0)?;
        let mut length = 0;
        loop {
            let mut line = String::new();
            reader.read_line(&mut line).expect("a header");
            match line.split_once(": ") {
                Some((name, value)) if name.eq_ignore_ascii_case("content-length") => {
                    length = value.trim().parse().expect("a length");
                }
                Some(_) => {}
                None => break,
            }
        }
        reader.read_exact(&mut vec![0; length]).expect("a body");
        status(&answer).parse().ok()
    }

    /// Waits until the server has closed the connection.
    fn wait_for_the_end(&mut self) {
        let mut rest = Vec::new();
        // A connection closed with unread bytes is reset.
        let _ = self.0.read_to_end(&mut rest);
    }
}

#[test]
fn a_connection_that_has_made_a_good_call_outlives_a_long_thought() {
    let server = with_token(Layer { request_timeout: Some(1), ..Layer::default() });
    let (mut known, mut unknown, mut idle) = (Kept::open(&server), Kept::open(&server), Kept::open(&server));
    assert_eq!(known.ask("/healthz", TOKEN), Some(200));
    assert_eq!(unknown.ask("/healthz", "another-token-of-somebody"), Some(401));
    // Three times the time limit of a request's header.
    std::thread::sleep(Duration::from_secs(3));
    unknown.wait_for_the_end();
    idle.wait_for_the_end();
    assert_eq!(known.ask("/healthz", TOKEN), Some(200));
    let half = "GET /healthz HTTP/1.1\r\nhost: local";
    known.0.write_all(half.as_bytes()).expect("half a request");
    known.wait_for_the_end();
}

#[test]
fn nobody_takes_a_place_by_being_slow() {
    let server = with_token(Layer { max_requests: Some(4), ..Layer::default() });
    let begin = |line: &str, headers: &str| {
        let mut kept = Kept::open(&server);
        let request = format!("{line} HTTP/1.1\r\nhost: localhost\r\n{headers}content-length: 9\r\n\r\n{{");
        kept.0.write_all(request.as_bytes()).expect("half a request");
        kept
    };
    let authorization = format!("authorization: Bearer {TOKEN}\r\n{JSON}\r\n");
    let slow: Vec<Kept> = (0..8)
        .flat_map(|_| [begin("GET /operate", ""), begin("POST /v1/episodes", &authorization)])
        .collect();
    for _ in 0..8 {
        assert_eq!(Kept::open(&server).ask("/healthz", TOKEN), Some(200));
    }
    drop(slow);
    // The server does not wait for a body that the page does not read.
    let page = raw(
        &server,
        "GET /operate HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-length: 9\r\n\r\n{",
    );
    assert_eq!(status(&page), "200", "{page}");
}

#[test]
fn an_address_keeps_so_many_connections_waiting_and_no_more() {
    let server = with_token(Layer { max_requests: Some(4), ..Layer::default() });
    let mut known = Kept::open(&server);
    assert_eq!(known.ask("/healthz", TOKEN), Some(200));
    // There are 64 waiting connections, including one with a valid call.
    let mut waiting: Vec<Kept> = (0..67).map(|_| Kept::open(&server)).collect();
    for kept in &mut waiting[..4] {
        kept.wait_for_the_end();
    }
    let last = waiting.last_mut().expect("a connection");
    assert_eq!(last.ask("/healthz", TOKEN), Some(200), "the latest may wait");
    assert_eq!(known.ask("/healthz", TOKEN), Some(200), "who has made a good call goes last");
}
