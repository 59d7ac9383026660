//! A fake policy server for openpi: it sends metadata first, then a response to each request.

use std::{
    net::{SocketAddr, TcpListener, TcpStream},
    sync::{Arc, Mutex},
    thread,
};

use rmpv::Value;
use tungstenite::{Message, WebSocket};

/// Function that returns the reply to a request. The arguments are its number on this connection, counted
/// from 0, and its content.
pub type Decide = dyn Fn(usize, &Value) -> Reply + Send + Sync;

/// Response of the server.
pub enum Reply {
    /// Rows under `actions`.
    Rows(Vec<Vec<f32>>),
    Text(&'static str),
    Bytes(Vec<u8>),
    /// Closes the connection.
    Nothing,
    /// Sends nothing and keeps the connection open while the client is connected.
    Silence,
}

/// A server that runs until the test ends.
pub struct OpenpiServer {
    pub address: SocketAddr,
    /// Requests received on all connections.
    pub requests: Arc<Mutex<Vec<Value>>>,
}

impl OpenpiServer {
    /// Starts a server whose connection number `n`, counted from 0, is answered by `decide(n)`.
    pub fn start(decide: impl Fn(usize) -> Box<Decide> + Send + 'static) -> OpenpiServer {
        OpenpiServer::start_at(([127, 0, 0, 1], 0).into(), usize::MAX, decide)
    }

    /// Starts a server like [`OpenpiServer::start`] at this address. It stops listening after
    /// `connections` connections.
    pub fn start_at(
        address: SocketAddr,
        connections: usize,
        decide: impl Fn(usize) -> Box<Decide> + Send + 'static,
    ) -> OpenpiServer {
        let listener = TcpListener::bind(address).expect("a free port");
        let address = listener.local_addr().expect("an address");
        let requests = Arc::new(Mutex::new(Vec::new()));
        let heard = requests.clone();
        thread::spawn(move || {
            for (number, stream) in listener.incoming().enumerate().take(connections) {
                let (decide, heard) = (decide(number), heard.clone());
                let stream = stream.expect("a connection");
                thread::spawn(move || serve(stream, &*decide, &heard));
            }
        });
        OpenpiServer { address, requests }
    }

    pub fn url(&self) -> String {
        format!("ws://{}", self.address)
    }
}

fn serve(stream: TcpStream, decide: &Decide, heard: &Mutex<Vec<Value>>) {
    let Ok(mut socket) = tungstenite::accept(stream) else { return };
    let metadata = Value::Map(vec![("model".into(), "test".into())]);
    send(&mut socket, Message::binary(packed(&metadata)));
    let mut number = 0;
    while let Ok(message) = socket.read() {
        let Message::Binary(bytes) = message else { continue };
        let request = rmpv::decode::read_value(&mut &bytes[..]).expect("msgpack");
        let reply = decide(number, &request);
        heard.lock().expect("no panic").push(request);
        number += 1;
        match reply {
            Reply::Rows(rows) => send(&mut socket, Message::binary(packed(&actions(&rows)))),
            Reply::Text(text) => send(&mut socket, Message::text(text)),
            Reply::Bytes(bytes) => send(&mut socket, Message::binary(bytes)),
            Reply::Nothing => return,
            Reply::Silence => {}
        }
    }
}

fn send(socket: &mut WebSocket<TcpStream>, message: Message) {
    // The client may have closed the connection.
    let _ = socket.send(message);
}

fn packed(value: &Value) -> Vec<u8> {
    let mut bytes = Vec::new();
    rmpv::encode::write_value(&mut bytes, value).expect("memory");
    bytes
}

/// Encodes `{"actions": array}` in the format of openpi-client's `msgpack_numpy`.
fn actions(rows: &[Vec<f32>]) -> Value {
    let data = rows.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    let shape = [rows.len(), rows.first().map_or(0, Vec::len)];
    let key = |name: &str| Value::Binary(name.into());
    let array = Value::Map(vec![
        (key("__ndarray__"), true.into()),
        (key("data"), Value::Binary(data)),
        (key("dtype"), "<f4".into()),
        (key("shape"), Value::Array(shape.map(|side| (side as u64).into()).to_vec())),
    ]);
    Value::Map(vec![("actions".into(), array)])
}

/// Returns the value under `key`.
pub fn entry<'a>(map: &'a Value, key: &str) -> &'a Value {
    let entries = map.as_map().expect("a map");
    let found = entries.iter().find(|(name, _)| name.as_slice() == Some(key.as_bytes()));
    &found.unwrap_or_else(|| panic!("no {key:?} in {map}")).1
}

/// Returns the floats of the array under `key`.
pub fn floats(map: &Value, key: &str) -> Vec<f32> {
    let array = entry(map, key);
    assert_eq!(entry(array, "dtype").as_str(), Some("<f4"));
    let (bytes, _) = entry(array, "data").as_slice().expect("bytes").as_chunks::<4>();
    bytes.iter().map(|four| f32::from_le_bytes(*four)).collect()
}
