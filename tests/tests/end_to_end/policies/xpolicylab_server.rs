//! A fake policy server for XPolicyLab: frames in MessagePack, each answered with its `message_id`.

use std::{
    net::{SocketAddr, TcpListener, TcpStream},
    sync::{Arc, Mutex},
    thread,
};

use rmpv::Value;
use tungstenite::Message;

use super::openpi_server::entry;

/// Function that returns the response to an observation, or an error.
pub type Infer = dyn Fn(&Value) -> Result<Value, &'static str> + Send + Sync;

/// A server that runs until the test ends.
pub struct XPolicyLabServer {
    pub address: SocketAddr,
    /// Frames received on all connections.
    pub frames: Arc<Mutex<Vec<Value>>>,
}

impl XPolicyLabServer {
    pub fn start(
        infer: impl Fn(&Value) -> Result<Value, &'static str> + Send + Sync + 'static,
    ) -> XPolicyLabServer {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("an address");
        let frames = Arc::new(Mutex::new(Vec::new()));
        let (heard, infer) = (frames.clone(), Arc::new(infer));
        thread::spawn(move || {
            for stream in listener.incoming() {
                let (infer, heard) = (infer.clone(), heard.clone());
                let stream = stream.expect("a connection");
                thread::spawn(move || serve(stream, &*infer, &heard));
            }
        });
        XPolicyLabServer { address, frames }
    }

    pub fn url(&self) -> String {
        format!("ws://{}", self.address)
    }

    /// Returns the types of the received messages, in order.
    pub fn asked(&self) -> Vec<String> {
        let frames = self.frames.lock().expect("no panic");
        frames.iter().map(|frame| entry(frame, "message_type").as_str().expect("a text").to_owned()).collect()
    }
}

fn serve(stream: TcpStream, infer: &Infer, heard: &Mutex<Vec<Value>>) {
    let Ok(mut socket) = tungstenite::accept(stream) else { return };
    while let Ok(message) = socket.read() {
        let Message::Binary(bytes) = message else { continue };
        let frame = rmpv::decode::read_value(&mut &bytes[..]).expect("msgpack");
        let kind = entry(&frame, "message_type").as_str().expect("a text").to_owned();
        heard.lock().expect("no panic").push(frame.clone());
        let (answer, payload) = match &*kind {
            "close" => return,
            "infer" => match infer(entry(entry(&frame, "payload"), "observation")) {
                Ok(payload) => ("infer_result".to_owned(), payload),
                Err(reason) => {
                    ("error".to_owned(), map(&[("code", "infer_failed".into()), ("message", reason.into())]))
                }
            },
            "reset" => ("reset_result".to_owned(), map(&[("ok", true.into())])),
            _ => (format!("{kind}_ack"), map(&[("ok", true.into())])),
        };
        let of = |id: Value| {
            let mut bytes = Vec::new();
            let answer = map(&[
                ("message_type", answer.as_str().into()),
                ("message_id", id),
                ("evaluation_id", entry(&frame, "evaluation_id").clone()),
                ("payload", payload.clone()),
            ]);
            rmpv::encode::write_value(&mut bytes, &answer).expect("memory");
            Message::binary(bytes)
        };
        // The client must ignore responses to other messages, and messages that are not frames.
        let _ = socket.send(of("another".into()));
        let _ = socket.send(Message::text("hello"));
        // The client may have closed the connection.
        let _ = socket.send(of(entry(&frame, "message_id").clone()));
    }
}

/// Returns a map with these entries.
pub fn map(entries: &[(&str, Value)]) -> Value {
    Value::Map(entries.iter().map(|(key, value)| ((*key).into(), value.clone())).collect())
}

/// Encodes an array of one row in the format of the package msgpack-numpy.
pub fn floats(values: &[f32]) -> Value {
    let key = |name: &str| Value::Binary(name.into());
    let data = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    Value::Map(vec![
        (key("nd"), true.into()),
        (key("type"), "<f4".into()),
        (key("kind"), Value::Binary(Vec::new())),
        (key("shape"), Value::Array(vec![(values.len() as u64).into()])),
        (key("data"), Value::Binary(data)),
    ])
}

/// Returns the floats of an array in this format.
pub fn read_floats(array: &Value) -> Vec<f32> {
    assert_eq!((entry(array, "nd"), entry(array, "type").as_str()), (&Value::from(true), Some("<f4")));
    let (bytes, _) = entry(array, "data").as_slice().expect("bytes").as_chunks::<4>();
    bytes.iter().map(|four| f32::from_le_bytes(*four)).collect()
}
