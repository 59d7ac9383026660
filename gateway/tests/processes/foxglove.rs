//! Test of the live view in Foxglove, with a client that speaks its WebSocket protocol.

use std::{
    collections::BTreeMap,
    fs,
    net::{TcpListener, TcpStream},
    process::Command,
    time::Duration,
};

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket, client::IntoClientRequest, http::HeaderValue};

use crate::Server;

/// Time limit for a message.
const MESSAGE_TIMEOUT: Duration = Duration::from_secs(30);

/// Opcode of the binary messages with data.
const MESSAGE_DATA: u8 = 1;

/// A connected client.
struct Viewer {
    socket: WebSocket<TcpStream>,
    /// Channel number of each advertised topic.
    channels: BTreeMap<String, u64>,
}

impl Viewer {
    fn connect(port: u16) -> Viewer {
        let stream = TcpStream::connect(("127.0.0.1", port)).expect("the live view");
        stream.set_read_timeout(Some(MESSAGE_TIMEOUT)).unwrap();
        let mut request = format!("ws://127.0.0.1:{port}/").into_client_request().unwrap();
        let protocol = HeaderValue::from_static("foxglove.sdk.v1");
        request.headers_mut().insert("sec-websocket-protocol", protocol);
        let (socket, _) = tungstenite::client(request, stream).expect("a handshake");
        Viewer { socket, channels: BTreeMap::new() }
    }

    /// Returns the next data message: subscription, time in nanoseconds, and bytes. Returns `None` after an
    /// advertisement, whose channels it stores.
    fn next(&mut self) -> Option<(u32, u64, Vec<u8>)> {
        loop {
            match self.socket.read().expect("a message") {
                Message::Text(text) => {
                    let message: Value = serde_json::from_str(&text).unwrap();
                    if message["op"] == "advertise" {
                        for channel in message["channels"].as_array().unwrap() {
                            let topic = channel["topic"].as_str().unwrap().to_owned();
                            self.channels.insert(topic, channel["id"].as_u64().unwrap());
                        }
                        return None;
                    }
                }
                Message::Binary(bytes) if bytes[0] == MESSAGE_DATA => {
                    let subscription = u32::from_le_bytes(bytes[1..5].try_into().unwrap());
                    let time_ns = u64::from_le_bytes(bytes[5..13].try_into().unwrap());
                    return Some((subscription, time_ns, bytes[13..].to_vec()));
                }
                _ => {}
            }
        }
    }

    /// Waits until `topic` has a channel other than `before`, and returns its number.
    fn channel(&mut self, topic: &str, before: Option<u64>) -> u64 {
        loop {
            match self.channels.get(topic) {
                Some(found) if Some(*found) != before => return *found,
                _ => drop(self.next()),
            }
        }
    }

    /// Subscribes to channels in this order; the first of each pair is the subscription's number.
    fn subscribe(&mut self, channels: [(u32, u64); 2]) {
        let subscriptions = channels.map(|(id, channel)| json!({"id": id, "channelId": channel}));
        let message = json!({"op": "subscribe", "subscriptions": subscriptions});
        self.socket.send(Message::text(message.to_string())).unwrap();
    }
}

fn start(server: &Server, seed: u32) -> String {
    let reply = server.post("/v1/episodes", &json!({"task": "pouring", "seed": seed})).unwrap();
    reply["episode_id"].as_str().unwrap_or_else(|| panic!("{reply}")).to_owned()
}

/// Returns the messages of `topic` in a recording, with their times.
fn recorded(bytes: &[u8], topic: &str) -> Vec<(u64, Vec<u8>)> {
    let messages = mcap::MessageStream::new(bytes).unwrap().map(Result::unwrap);
    let of_topic = messages.filter(|message| message.channel.topic == topic);
    of_topic.map(|message| (message.log_time, message.data.to_vec())).collect()
}

/// A client that connects late gets the scene. It then gets every message of the recording, and the channels
/// of the next episode when that begins.
#[test]
fn foxglove_shows_the_episode_that_began_last() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let runs = tempfile::tempdir().unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_tandem"));
    program.env("TANDEM_FOXGLOVE", port.to_string());
    let server = Server::run(program, runs.path());
    let first = start(&server, 2000);

    let mut viewer = Viewer::connect(port);
    let (scene, budget) = (viewer.channel("/scene", None), viewer.channel("/budget", None));
    viewer.subscribe([(2, budget), (1, scene)]);
    // The scene's message shows that the earlier subscription is in effect, too.
    let drawn = loop {
        if let Some((1, _, bytes)) = viewer.next() {
            break bytes;
        }
    };
    for _ in 0..2 {
        let reply = server.tool(&first, "wait", &json!({"steps": 25}));
        assert_eq!(reply["error"], Value::Null, "{reply}");
    }
    let mut live = Vec::new();
    while live.len() < 2 * 25 {
        if let Some((2, time_ns, bytes)) = viewer.next() {
            live.push((time_ns, bytes));
        }
    }
    server.tool(&first, "finish", &json!({}));
    let file = fs::read(runs.path().join(&first).join("episode.mcap")).unwrap();
    assert!(recorded(&file, "/budget").ends_with(&live), "every step, in order");
    assert!(recorded(&file, "/scene").iter().any(|(_, bytes)| *bytes == drawn));

    start(&server, 2001);
    assert!(viewer.channel("/scene", Some(scene)) > scene);
}

#[test]
fn a_port_in_use_is_an_error_in_words() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tandem"));
    let runs = tempfile::tempdir().unwrap();
    command.args(["serve", "--listen", "127.0.0.1:0", "--foxglove", &port, "--runs"]).arg(runs.path());
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    let expected = format!("cannot serve Foxglove on port {port}");
    assert!(!output.status.success() && text.contains(&expected) && text.contains("--foxglove 0"), "{text}");
}
