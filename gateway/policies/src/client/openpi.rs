//! openpi's protocol over WebSocket. The server sends its metadata, then answers each binary message with a
//! binary message. A text message reports an error.

use std::time::Duration;

use super::{
    PolicyAddress, PolicyClient,
    link::{Frame, PolicySocket, silent},
    msgpack::{Dialect, read_reply, written},
};
use crate::{
    error::{RemoteError, gist},
    values::{ReplyValue, RequestValue},
};

/// A connection to one server.
pub struct Openpi {
    socket: PolicySocket,
}

impl Openpi {
    /// Connects and receives the server's metadata.
    pub fn connect(
        address: &PolicyAddress,
        connect_within: Duration,
        reply_within: Duration,
    ) -> Result<Openpi, RemoteError> {
        // A server that is answering another client may delay its handshake.
        let within = connect_within.max(reply_within);
        let mut link = Openpi { socket: PolicySocket::connect(address, connect_within, within)? };
        let metadata = link.hear(within).map_err(|error| match error {
            RemoteError::Slow { .. } => silent(&address.url, within),
            error => error,
        })?;
        match metadata {
            ReplyValue::Map(_) => Ok(link),
            other => Err(link
                .socket
                .unreadable(format!("expected metadata first, a map; came {}", other.describe()))),
        }
    }

    fn hear(&mut self, within: Duration) -> Result<ReplyValue, RemoteError> {
        match self.socket.hear(within)? {
            Frame::Bytes(bytes) => read_reply(&bytes).map_err(|reason| self.socket.unreadable(reason)),
            Frame::Text(text) => {
                Err(RemoteError::Failed { url: self.socket.url().into(), text: gist(&text) })
            }
        }
    }
}

impl PolicyClient for Openpi {
    fn ask(&mut self, request: &RequestValue, within: Duration) -> Result<ReplyValue, RemoteError> {
        self.socket.send(written(request, Dialect::Openpi), within)?;
        self.hear(within)
    }

    /// Does nothing: each connection is one episode, and the protocol has no reset.
    fn begin_trial(&mut self, _within: Duration) -> Result<(), RemoteError> {
        Ok(())
    }

    fn keep_alive(&mut self) {
        self.socket.answer_pings();
    }
}

#[cfg(test)]
mod tests {
    use std::{net::TcpListener, thread, time::Instant};

    use tungstenite::Message;

    use super::*;

    #[test]
    fn a_server_that_says_nothing_is_not_there() {
        // The operating system accepts connections, but no program answers.
        let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("ws://{}", silent.local_addr().unwrap());
        let address = PolicyAddress { url, key: None };
        let opened = Openpi::connect(&address, Duration::from_secs(1), Duration::from_millis(20));
        let error = opened.err().unwrap();
        assert!(matches!(error, RemoteError::Unreachable { .. }), "{error}");
        assert!(error.to_string().ends_with("it says nothing within 1 s of the connection"), "{error}");
    }

    #[test]
    fn a_ping_between_requests_is_answered() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("ws://{}", listener.local_addr().unwrap());
        let server = thread::spawn(move || {
            let mut socket = tungstenite::accept(listener.accept().unwrap().0).unwrap();
            let metadata = b"\x80".to_vec();
            socket.send(Message::binary(metadata)).unwrap();
            socket.send(Message::Ping("there?".into())).unwrap();
            socket.read().unwrap()
        });
        let within = Duration::from_secs(5);
        let mut link = Openpi::connect(&PolicyAddress { url, key: None }, within, within).unwrap();
        let since = Instant::now();
        while !server.is_finished() && since.elapsed() < within {
            link.keep_alive();
        }
        assert!(server.is_finished(), "no answer to a ping");
        assert_eq!(server.join().unwrap(), Message::Pong("there?".into()));
    }
}
