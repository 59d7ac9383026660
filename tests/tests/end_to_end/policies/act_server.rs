//! A fake policy server for `/act`: each request is a POST with JSON, and so is its response.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
    sync::{Arc, Mutex},
    thread,
};

use serde_json::Value;

/// A server that runs until the test ends.
pub struct ActServer {
    pub address: SocketAddr,
    /// Requests received.
    pub requests: Arc<Mutex<Vec<Value>>>,
}

impl ActServer {
    /// Starts a server that answers every request with the status and JSON returned by `decide`.
    pub fn start(decide: impl Fn(&Value) -> (u16, Value) + Send + Sync + 'static) -> ActServer {
        ActServer::start_with_text(move |request| {
            let (status, reply) = decide(request);
            (status, reply.to_string())
        })
    }

    /// Starts a server like [`ActServer::start`] whose responses are arbitrary text.
    pub fn start_with_text(decide: impl Fn(&Value) -> (u16, String) + Send + Sync + 'static) -> ActServer {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("an address");
        let requests = Arc::new(Mutex::new(Vec::new()));
        let (heard, decide) = (requests.clone(), Arc::new(decide));
        thread::spawn(move || {
            for stream in listener.incoming() {
                let (heard, decide) = (heard.clone(), decide.clone());
                let stream = stream.expect("a connection");
                thread::spawn(move || while serve(&stream, &*decide, &heard).is_some() {});
            }
        });
        ActServer { address, requests }
    }

    pub fn url(&self) -> String {
        format!("http://{}/act", self.address)
    }
}

/// Answers one request. Returns `None` if the client has closed the connection.
fn serve(
    mut stream: &TcpStream,
    decide: &(dyn Fn(&Value) -> (u16, String) + Send + Sync),
    heard: &Mutex<Vec<Value>>,
) -> Option<()> {
    let mut reader = BufReader::new(stream);
    let mut length = 0;
    loop {
        let mut line = String::new();
        reader.read_line(&mut line).ok().filter(|read| *read > 0)?;
        if let Some((name, value)) = line.split_once(':')
            && name.eq_ignore_ascii_case("content-length")
        {
            length = value.trim().parse().expect("a number");
        }
        if line == "\r\n" {
            break;
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    // Requests of other protocols have no body.
    let request: Value = serde_json::from_slice(&body).unwrap_or_default();
    let (status, text) = decide(&request);
    heard.lock().expect("no panic").push(request);
    let head = format!(
        "HTTP/1.1 {status} OK\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
        text.len()
    );
    stream.write_all(head.as_bytes()).ok()?;
    stream.write_all(text.as_bytes()).ok()
}
