//! openpi's protocol: over WebSocket the server says who it is, then answers one binary message with another; a text is its error.

use std::{
    io::{self, Read, Write},
    net::{TcpStream, ToSocketAddrs},
    time::{Duration, Instant},
};

use rmpv::{Value, decode, encode};
use tungstenite::{Error, HandshakeError, Message, WebSocket, error::ProtocolError};

use super::{PolicyClient, PolicyProtocol};
use crate::drivers::remote::{
    error::{RemoteError, gist},
    values::{Array, ReplyValue, RequestValue},
};

/// A connection to one server.
pub struct Openpi {
    url: String,
    socket: WebSocket<DeadlineStream>,
}

impl Openpi {
    /// Connects, and hears who the server is.
    pub fn connect(
        url: &str,
        connect_within: Duration,
        reply_within: Duration,
    ) -> Result<Openpi, RemoteError> {
        let unreachable = |reason: String| RemoteError::Unreachable { url: url.into(), reason };
        let mut stream =
            DeadlineStream::connect(url, connect_within).map_err(|error| unreachable(error.to_string()))?;
        // A server that answers somebody else may shake no hands meanwhile.
        let within = connect_within.max(reply_within);
        let silent =
            || unreachable(format!("it says nothing within {} s of the connection", within.as_secs_f64()));
        stream.deadline = Instant::now() + within;
        let page = stream.stream.try_clone();
        let (socket, _) = tungstenite::client(url, stream).map_err(|error| match error {
            // A proxy's page of an error, or another server than a policy's.
            HandshakeError::Failure(Error::Http(response)) => {
                let status = response.status();
                let begun = response.into_body().unwrap_or_default();
                unreachable(format!("it answers HTTP {status}: {}", gist(&page_text(begun, page))))
            }
            HandshakeError::Failure(Error::Io(error)) if is_late(&error) => silent(),
            HandshakeError::Failure(error) => unreachable(error.to_string()),
            HandshakeError::Interrupted(_) => silent(),
        })?;
        let mut link = Openpi { url: url.into(), socket };
        let metadata = link.hear(within).map_err(|error| match error {
            RemoteError::Slow { .. } => silent(),
            error => error,
        })?;
        match metadata {
            ReplyValue::Map(_) => Ok(link),
            other => {
                Err(link.unreadable(format!("expected metadata first, a map; came {}", other.describe())))
            }
        }
    }

    fn hear(&mut self, within: Duration) -> Result<ReplyValue, RemoteError> {
        loop {
            match self.socket.read().map_err(|error| self.failed(error, within))? {
                Message::Binary(bytes) => {
                    return from_msgpack(&bytes).map_err(|reason| self.unreadable(reason));
                }
                Message::Text(text) => {
                    return Err(RemoteError::Failed { url: self.url.clone(), text: gist(&text) });
                }
                Message::Close(frame) => {
                    let reason = frame.map_or("it closed the connection".into(), |frame| {
                        format!("it closed the connection: {} {}", frame.code, gist(&frame.reason))
                    });
                    return Err(RemoteError::Gone { url: self.url.clone(), reason });
                }
                // Answered by the library.
                Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
            }
        }
    }

    fn failed(&self, error: Error, within: Duration) -> RemoteError {
        let url = self.url.clone();
        match error {
            Error::Io(error) if is_late(&error) => RemoteError::Slow { url, within },
            Error::Protocol(ProtocolError::ResetWithoutClosingHandshake) => {
                RemoteError::Gone { url, reason: error.to_string() }
            }
            Error::Protocol(_) | Error::Utf8(_) | Error::Capacity(_) => self.unreadable(error.to_string()),
            error => RemoteError::Gone { url, reason: error.to_string() },
        }
    }

    fn unreadable(&self, reason: String) -> RemoteError {
        RemoteError::Unreadable { url: self.url.clone(), reason }
    }
}

impl PolicyClient for Openpi {
    fn ask(&mut self, request: &RequestValue, within: Duration) -> Result<ReplyValue, RemoteError> {
        self.socket.get_mut().deadline = Instant::now() + within;
        let message = Message::binary(to_msgpack(request));
        self.socket.send(message).map_err(|error| self.failed(error, within))?;
        self.hear(within)
    }
}

/// The beginning of a page of which `begun` came with its header, as far as it comes soon.
fn page_text(mut begun: Vec<u8>, stream: io::Result<TcpStream>) -> String {
    if begun.is_empty()
        && let Ok(mut stream) = stream
        && stream.set_read_timeout(Some(PAGE_WAIT)).is_ok()
    {
        let mut buffer = [0; 4096];
        let length = stream.read(&mut buffer).unwrap_or_default();
        begun.extend_from_slice(&buffer[..length]);
    }
    String::from_utf8_lossy(&begun).into_owned()
}

/// How long an address is tried at least.
const SHORTEST_TRIAL: Duration = Duration::from_millis(10);

/// How long the text of a page may follow its header.
const PAGE_WAIT: Duration = Duration::from_secs(1);

fn is_late(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}

/// A connection on which nothing takes longer than until a deadline, however small the pieces are in which it comes.
struct DeadlineStream {
    stream: TcpStream,
    deadline: Instant,
}

impl DeadlineStream {
    fn connect(url: &str, within: Duration) -> io::Result<DeadlineStream> {
        let address = url.strip_prefix(PolicyProtocol::Openpi.scheme()).unwrap_or(url);
        let address = address.split('/').next().unwrap_or_default();
        let mut failure = io::Error::other("no such host");
        let deadline = Instant::now() + within;
        let mut addresses = address.to_socket_addrs()?;
        while let Some(address) = addresses.next() {
            // Each has its share of what is left, which must not be nothing.
            let left = deadline.saturating_duration_since(Instant::now());
            let share = left / (addresses.len() as u32 + 1);
            match TcpStream::connect_timeout(&address, share.max(SHORTEST_TRIAL)) {
                Ok(stream) => {
                    stream.set_nodelay(true)?;
                    return Ok(DeadlineStream { stream, deadline });
                }
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }

    /// What is left; no time at all is a time that nothing takes, which the system would take for any time.
    fn left(&self) -> io::Result<Option<Duration>> {
        match self.deadline.saturating_duration_since(Instant::now()) {
            Duration::ZERO => Err(io::ErrorKind::TimedOut.into()),
            left => Ok(Some(left)),
        }
    }
}

impl Read for DeadlineStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(self.left()?)?;
        self.stream.read(buffer)
    }
}

impl Write for DeadlineStream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(self.left()?)?;
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// As msgpack, with arrays as openpi-client's `msgpack_numpy` writes them: a map of `__ndarray__`, `data`, `dtype` and `shape`, whose
/// keys are bytes.
fn to_msgpack(request: &RequestValue) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Nothing fails to be written into memory.
    let _ = encode::write_value(&mut bytes, &msgpack_value(request));
    bytes
}

fn msgpack_value(request: &RequestValue) -> Value {
    match request {
        RequestValue::Map(entries) => Value::Map(
            entries.iter().map(|(key, request)| (key.as_str().into(), msgpack_value(request))).collect(),
        ),
        RequestValue::Array(array) => ndarray(array),
        RequestValue::Text(text) => text.as_str().into(),
        RequestValue::List(items) => Value::Array(items.iter().map(msgpack_value).collect()),
    }
}

fn ndarray(array: &Array) -> Value {
    let key = |name: &str| Value::Binary(name.into());
    Value::Map(vec![
        (key("__ndarray__"), true.into()),
        (key("data"), Value::Binary(array.bytes())),
        (key("dtype"), array.dtype().into()),
        (key("shape"), Value::Array(array.shape.iter().map(|side| (*side as u64).into()).collect())),
    ])
}

/// Reads msgpack; lists of numbers are arrays, too.
fn from_msgpack(mut bytes: &[u8]) -> Result<ReplyValue, String> {
    let value = decode::read_value(&mut bytes).map_err(|error| format!("no msgpack: {error}"))?;
    match bytes.is_empty() {
        true => reply_value(value),
        false => Err(format!("{} bytes after the end of a msgpack value", bytes.len())),
    }
}

fn reply_value(value: Value) -> Result<ReplyValue, String> {
    if let Some(number) = value.as_f64() {
        return Ok(ReplyValue::number(number));
    }
    match value {
        Value::Map(entries) => of_map(entries),
        Value::Array(items) => {
            items.into_iter().map(reply_value).collect::<Result<_, _>>().map(ReplyValue::list)
        }
        Value::String(text) => Ok(ReplyValue::Text(text.as_str().unwrap_or("no UTF-8").into())),
        other => Ok(ReplyValue::Other(format!("a {}", kind(&other)))),
    }
}

fn of_map(entries: Vec<(Value, Value)>) -> Result<ReplyValue, String> {
    let find = |name: &str| {
        entries.iter().find(|(key, _)| key.as_slice() == Some(name.as_bytes())).map(|(_, value)| value)
    };
    if find("__ndarray__").is_some() {
        let shape = find("shape").and_then(Value::as_array).into_iter().flatten();
        let shape: Option<Vec<usize>> = shape.map(|side| side.as_u64()?.try_into().ok()).collect();
        let dtype = find("dtype").and_then(text).unwrap_or_default();
        let data = find("data").and_then(Value::as_slice).ok_or("an array without data")?;
        return ReplyValue::from_bytes(&dtype, shape.ok_or("an array with a side that is no number")?, data);
    }
    if find("__npgeneric__").is_some() {
        return reply_value(find("data").cloned().unwrap_or(Value::Nil));
    }
    let named = entries.into_iter().map(|(key, value)| {
        let key = text(&key).ok_or("a key that is no text")?;
        Ok((key, reply_value(value)?))
    });
    named.collect::<Result<_, String>>().map(ReplyValue::Map)
}

/// A text, written as text or as bytes.
fn text(value: &Value) -> Option<String> {
    Some(std::str::from_utf8(value.as_slice()?).ok()?.to_owned())
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Nil => "nil",
        Value::Boolean(_) => "boolean",
        Value::Integer(_) | Value::F32(_) | Value::F64(_) => "number",
        Value::String(_) => "text",
        Value::Binary(_) => "row of bytes",
        Value::Array(_) => "list",
        Value::Map(_) => "map",
        Value::Ext(..) => "msgpack extension",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drivers::remote::values::Elements;

    /// `msgpack_numpy.packb({"actions": np.float32([[1.5, -2]]), "n": np.float64(3)})` of openpi-client 0.1.2.
    const KNOWN: &[u8] = include_bytes!("known.msgpack");

    #[test]
    fn a_server_that_says_nothing_is_not_there() {
        // The system takes connections; nobody hears them.
        let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("ws://{}", silent.local_addr().unwrap());
        let opened = Openpi::connect(&url, Duration::from_secs(1), Duration::from_millis(20));
        let error = opened.err().unwrap();
        assert!(matches!(error, RemoteError::Unreachable { .. }), "{error}");
        assert!(error.to_string().ends_with("it says nothing within 1 s of the connection"), "{error}");
    }

    #[test]
    fn answers_of_openpi_are_read() {
        let reply = from_msgpack(KNOWN).unwrap();
        assert_eq!(
            reply.at("actions"),
            Some(&ReplyValue::Array { shape: vec![1, 2], values: vec![1.5, -2.0] })
        );
        assert_eq!(reply.at("n"), Some(&ReplyValue::number(3.0)));
        for end in 0..KNOWN.len() {
            assert!(from_msgpack(&KNOWN[..end]).is_err(), "{end}");
        }
    }

    #[test]
    fn requests_read_back_as_they_were() {
        let array = Array { shape: vec![1, 2], elements: Elements::Bytes(vec![7, 200]) };
        let request = RequestValue::Map(vec![
            ("x".into(), RequestValue::Array(array)),
            ("y".into(), RequestValue::Text("z".into())),
        ]);
        let bytes = to_msgpack(&request);
        let reply = from_msgpack(&bytes).unwrap();
        assert_eq!(reply.at("x"), Some(&ReplyValue::Array { shape: vec![1, 2], values: vec![7.0, 200.0] }));
        assert_eq!(reply.at("y"), Some(&ReplyValue::Text("z".into())));
        assert!(bytes.windows(13).any(|part| part == b"\xc4\x0b__ndarray__"), "keys of arrays are bytes");
        assert!(from_msgpack(&[&bytes[..], b"\x01"].concat()).unwrap_err().contains("1 bytes after"));
        assert_eq!(from_msgpack(b"\xc3").map(|reply| reply.describe()), Ok("a boolean".into()));
    }
}
