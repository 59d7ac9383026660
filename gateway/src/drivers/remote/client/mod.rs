//! Clients of policy servers: one file per protocol.

mod act;
mod openpi;

use std::{fmt, time::Duration};

use super::{
    error::RemoteError,
    values::{ReplyValue, RequestValue},
};

/// A connection to one policy server.
pub trait PolicyClient: Send {
    /// The answer to a request, if it comes in time.
    fn ask(&mut self, request: &RequestValue, within: Duration) -> Result<ReplyValue, RemoteError>;
}

/// How a server is spoken to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolicyProtocol {
    /// msgpack with numpy arrays over WebSocket, as openpi's server and client.
    Openpi,
    /// JSON with numpy arrays over HTTP, as the `/act` of OpenVLA and others.
    Act,
}

impl PolicyProtocol {
    pub const ALL: [PolicyProtocol; 2] = [PolicyProtocol::Openpi, PolicyProtocol::Act];

    /// As the command line calls it.
    pub fn name(self) -> &'static str {
        match self {
            PolicyProtocol::Openpi => "openpi",
            PolicyProtocol::Act => "act",
        }
    }

    /// What its addresses begin with.
    pub fn scheme(self) -> &'static str {
        match self {
            PolicyProtocol::Openpi => "ws://",
            PolicyProtocol::Act => "http://",
        }
    }

    /// A client of the server at `url`, which has to be found within `connect_within`; it may be busy then, and has `reply_within` to
    /// say who it is, or as long as to be found if that is longer.
    pub fn open(
        self,
        url: &str,
        connect_within: Duration,
        reply_within: Duration,
    ) -> Result<Box<dyn PolicyClient>, RemoteError> {
        Ok(match self {
            PolicyProtocol::Openpi => Box::new(openpi::Openpi::connect(url, connect_within, reply_within)?),
            PolicyProtocol::Act => Box::new(act::Act::new(url, connect_within)),
        })
    }
}

impl fmt::Display for PolicyProtocol {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}
