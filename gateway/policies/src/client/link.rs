//! A WebSocket connection to a policy's server, with a time limit on every operation.

use std::{
    io::{self, Read, Write},
    net::{TcpStream, ToSocketAddrs},
    time::{Duration, Instant},
};

use tokio_rustls::rustls::{ClientConnection, StreamOwned};
use tungstenite::{
    Error, HandshakeError, Message, WebSocket, client::IntoClientRequest, error::ProtocolError,
    handshake::client::Request,
};

use super::{PolicyAddress, encryption::encrypted};
use crate::error::{RemoteError, gist};

/// URL schemes of WebSocket servers; the encrypted one is last.
pub const SCHEMES: [&str; 2] = ["ws://", "wss://"];

/// Authorization scheme of the key, the same as in openpi's client.
const KEY_SCHEME: &str = "Api-Key";

/// Default port of unencrypted connections.
const PORT: u16 = 80;
const ENCRYPTED_PORT: u16 = 443;

/// A connection to one server.
pub struct PolicySocket {
    url: String,
    socket: WebSocket<PolicyStream>,
}

/// A message from the server.
pub enum Frame {
    Bytes(Vec<u8>),
    Text(String),
}

impl PolicySocket {
    /// Connects to a server. It must accept the connection within `connect_within`. It has `within` for the
    /// handshake, because it may be busy with another client.
    pub fn connect(
        address: &PolicyAddress,
        connect_within: Duration,
        within: Duration,
    ) -> Result<PolicySocket, RemoteError> {
        let url = address.url.as_str();
        let unreachable = |reason: String| RemoteError::Unreachable { url: url.into(), reason };
        let request = request(address).map_err(|error| unreachable(error.to_string()))?;
        let mut stream =
            PolicyStream::connect(address, connect_within).map_err(|error| unreachable(error.to_string()))?;
        stream.plain().deadline = Instant::now() + within;
        let page = stream.page();
        let (socket, _) = tungstenite::client(request, stream).map_err(|error| match error {
            // The server is a proxy with an error page, or does not use WebSocket.
            HandshakeError::Failure(Error::Http(response)) => {
                let status = response.status();
                let begun = response.into_body().unwrap_or_default();
                unreachable(format!("it answers HTTP {status}: {}", gist(&page_text(begun, page))))
            }
            HandshakeError::Failure(Error::Io(error)) if is_late(&error) => silent(url, within),
            HandshakeError::Failure(error) => unreachable(error.to_string()),
            HandshakeError::Interrupted(_) => silent(url, within),
        })?;
        Ok(PolicySocket { url: url.into(), socket })
    }

    pub fn url(&self) -> &str {
        &self.url
    }

    /// Sends a binary message. The server must then answer within `within`.
    pub fn send(&mut self, bytes: Vec<u8>, within: Duration) -> Result<(), RemoteError> {
        self.socket.get_mut().plain().deadline = Instant::now() + within;
        self.socket.send(Message::binary(bytes)).map_err(|error| self.failed(error, within))
    }

    /// Receives the next message before the deadline of the last request. Errors report `within` as the time
    /// limit.
    pub fn hear(&mut self, within: Duration) -> Result<Frame, RemoteError> {
        loop {
            match self.socket.read().map_err(|error| self.failed(error, within))? {
                Message::Binary(bytes) => return Ok(Frame::Bytes(bytes.into())),
                Message::Text(text) => return Ok(Frame::Text(text.as_str().into())),
                Message::Close(frame) => {
                    let reason = frame.map_or("it closed the connection".into(), |frame| {
                        format!("it closed the connection: {} {}", frame.code, gist(&frame.reason))
                    });
                    return Err(RemoteError::Gone { url: self.url.clone(), reason });
                }
                // The WebSocket library answers pings.
                Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
            }
        }
    }

    /// Answers pings from the server. Other failures are reported by the next request.
    pub fn answer_pings(&mut self) {
        self.socket.get_mut().plain().deadline = Instant::now() + PING_WAIT;
        let _ = self.hear(PING_WAIT);
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

    pub fn unreadable(&self, reason: String) -> RemoteError {
        RemoteError::Unreadable { url: self.url.clone(), reason }
    }
}

/// Builds the WebSocket request, with the key that the server requires.
fn request(address: &PolicyAddress) -> Result<Request, Error> {
    let mut request = address.url.as_str().into_client_request()?;
    if let Some(key) = &address.key {
        request.headers_mut().insert("authorization", key.authorization(KEY_SCHEME));
    }
    Ok(request)
}

/// Returns the error for a server at `url` that accepts connections but never answers.
pub fn silent(url: &str, within: Duration) -> RemoteError {
    let reason = format!("it says nothing within {} s of the connection", within.as_secs_f64());
    RemoteError::Unreachable { url: url.into(), reason }
}

/// Returns the beginning of an HTTP response's page. `begun` is the part that was received with the header.
/// Waits briefly for more text if it is empty.
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

/// Minimum time for trying an address.
const SHORTEST_TRIAL: Duration = Duration::from_millis(10);

/// Time limit for reading and answering a ping that has been received.
const PING_WAIT: Duration = Duration::from_millis(20);

/// Maximum delay between the header and the text of a page.
const PAGE_WAIT: Duration = Duration::from_secs(1);

fn is_late(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}

/// A connection, encrypted or not.
enum PolicyStream {
    Plain(DeadlineStream),
    Encrypted(Box<StreamOwned<ClientConnection, DeadlineStream>>),
}

impl PolicyStream {
    fn connect(address: &PolicyAddress, within: Duration) -> io::Result<PolicyStream> {
        Ok(match address.is_encrypted() {
            true => {
                let (connection, stream) =
                    (encrypted(address.host())?, DeadlineStream::connect(address, within)?);
                PolicyStream::Encrypted(Box::new(StreamOwned::new(connection, stream)))
            }
            false => PolicyStream::Plain(DeadlineStream::connect(address, within)?),
        })
    }

    fn plain(&mut self) -> &mut DeadlineStream {
        match self {
            PolicyStream::Plain(stream) => stream,
            PolicyStream::Encrypted(stream) => &mut stream.sock,
        }
    }

    /// Returns the stream from which the rest of a page is read. Encrypted connections are not supported.
    fn page(&self) -> io::Result<TcpStream> {
        match self {
            PolicyStream::Plain(stream) => stream.stream.try_clone(),
            PolicyStream::Encrypted(_) => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}

impl Read for PolicyStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            PolicyStream::Plain(stream) => stream.read(buffer),
            PolicyStream::Encrypted(stream) => stream.read(buffer),
        }
    }
}

impl Write for PolicyStream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            PolicyStream::Plain(stream) => stream.write(bytes),
            PolicyStream::Encrypted(stream) => stream.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            PolicyStream::Plain(stream) => stream.flush(),
            PolicyStream::Encrypted(stream) => stream.flush(),
        }
    }
}

/// A connection on which every operation ends at a deadline, even if data are received in small pieces.
struct DeadlineStream {
    stream: TcpStream,
    deadline: Instant,
}

impl DeadlineStream {
    fn connect(address: &PolicyAddress, within: Duration) -> io::Result<DeadlineStream> {
        let port = address.port().unwrap_or(if address.is_encrypted() { ENCRYPTED_PORT } else { PORT });
        let mut failure = io::Error::other("no such host");
        let deadline = Instant::now() + within;
        let mut addresses = (address.host(), port).to_socket_addrs()?;
        while let Some(address) = addresses.next() {
            // Each address gets an equal share of the remaining time, which must not be zero.
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

    /// Returns the remaining time. Zero is an error, because the operating system would treat it as no limit.
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
