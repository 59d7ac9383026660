//! Ways to a policy's server: one file per protocol.

mod act;
mod json_numpy;
mod msgpack_numpy;
mod openpi;

use std::{fmt, time::Duration};

use super::{
    error::RemoteError,
    values::{Sent, Told},
};

/// A way to one server.
pub trait Link: Send {
    /// The answer to a request, if it comes in time.
    fn ask(&mut self, request: &Sent, within: Duration) -> Result<Told, RemoteError>;
}

/// How a server is spoken to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// msgpack with numpy arrays over WebSocket, as openpi's server and client.
    Openpi,
    /// JSON with numpy arrays over HTTP, as the `/act` of OpenVLA and others.
    Act,
}

impl Protocol {
    pub const ALL: [Protocol; 2] = [Protocol::Openpi, Protocol::Act];

    /// As the command line calls it.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Openpi => "openpi",
            Protocol::Act => "act",
        }
    }

    /// What its addresses begin with.
    pub fn scheme(self) -> &'static str {
        match self {
            Protocol::Openpi => "ws://",
            Protocol::Act => "http://",
        }
    }

    /// A way to the server at `url`.
    pub fn open(self, url: &str, within: Duration) -> Result<Box<dyn Link>, RemoteError> {
        Ok(match self {
            Protocol::Openpi => Box::new(openpi::Openpi::connect(url, within)?),
            Protocol::Act => Box::new(act::Act::new(url)),
        })
    }
}

impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}
