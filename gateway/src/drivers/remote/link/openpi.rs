//! openpi's protocol: over WebSocket the server says who it is, then answers one binary message with another; a text is its error.

use std::{
    io::{self, Read, Write},
    net::{TcpStream, ToSocketAddrs},
    time::{Duration, Instant},
};

use tungstenite::{Error, HandshakeError, Message, WebSocket, error::ProtocolError};

use super::{Link, Protocol, msgpack_numpy};
use crate::drivers::remote::{
    error::{RemoteError, gist},
    values::{Sent, Told},
};

/// A connection to one server.
pub struct Openpi {
    url: String,
    socket: WebSocket<Timed>,
}

impl Openpi {
    /// Connects, and hears who the server is.
    pub fn connect(url: &str, within: Duration) -> Result<Openpi, RemoteError> {
        let unreachable = |reason: String| RemoteError::Unreachable { url: url.into(), reason };
        let stream = Timed::connect(url, within).map_err(|error| unreachable(error.to_string()))?;
        let (socket, _) = tungstenite::client(url, stream).map_err(|error| match error {
            HandshakeError::Failure(error) => unreachable(error.to_string()),
            HandshakeError::Interrupted(_) => RemoteError::Slow { url: url.into(), within },
        })?;
        let mut link = Openpi { url: url.into(), socket };
        match link.hear(within)? {
            Told::Map(_) => Ok(link),
            other => {
                Err(link.unreadable(format!("expected metadata first, a map; came {}", other.describe())))
            }
        }
    }

    fn hear(&mut self, within: Duration) -> Result<Told, RemoteError> {
        loop {
            match self.socket.read().map_err(|error| self.failed(error, within))? {
                Message::Binary(bytes) => {
                    return msgpack_numpy::read(&bytes).map_err(|reason| self.unreadable(reason));
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

impl Link for Openpi {
    fn ask(&mut self, request: &Sent, within: Duration) -> Result<Told, RemoteError> {
        self.socket.get_mut().deadline = Instant::now() + within;
        let message = Message::binary(msgpack_numpy::write(request));
        self.socket.send(message).map_err(|error| self.failed(error, within))?;
        self.hear(within)
    }
}

fn is_late(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}

/// A connection on which nothing takes longer than until a deadline, however small the pieces are in which it comes.
struct Timed {
    stream: TcpStream,
    deadline: Instant,
}

impl Timed {
    fn connect(url: &str, within: Duration) -> io::Result<Timed> {
        let address = url.strip_prefix(Protocol::Openpi.scheme()).unwrap_or(url);
        let address = address.split('/').next().unwrap_or_default();
        let mut failure = io::Error::other("no such host");
        for address in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, within) {
                Ok(stream) => {
                    stream.set_nodelay(true)?;
                    return Ok(Timed { stream, deadline: Instant::now() + within });
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

impl Read for Timed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(self.left()?)?;
        self.stream.read(buffer)
    }
}

impl Write for Timed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(self.left()?)?;
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}
