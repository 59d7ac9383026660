//! Clients of policy servers: one file per protocol.

mod act;
mod address;
mod encryption;
mod link;
mod msgpack;
mod openpi;
mod xpolicylab;

use std::{fmt, time::Duration};

pub use address::{PolicyAddress, PolicyKey, PolicyKeyError};

use crate::{
    error::RemoteError,
    values::{ReplyValue, RequestValue},
};

/// A connection to one policy server.
pub trait PolicyClient: Send {
    /// Sends a request and returns the answer.
    ///
    /// # Errors
    ///
    /// Returns an error if there is no valid answer within `within`.
    fn ask(&mut self, request: &RequestValue, within: Duration) -> Result<ReplyValue, RemoteError>;

    /// Begins a new trial. The policy resets its state if its protocol supports that.
    fn begin_trial(&mut self, within: Duration) -> Result<(), RemoteError>;

    /// Keeps the connection to an idle server alive.
    fn keep_alive(&mut self);
}

/// Protocol of a policy server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolicyProtocol {
    /// msgpack with numpy arrays over WebSocket, used by openpi's server and client.
    Openpi,
    /// JSON with numpy arrays over HTTP, used by the `/act` endpoint of OpenVLA and others.
    Act,
    /// msgpack messages over WebSocket, used by XPolicyLab's servers.
    XPolicyLab,
}

impl PolicyProtocol {
    pub const ALL: [PolicyProtocol; 3] =
        [PolicyProtocol::Openpi, PolicyProtocol::Act, PolicyProtocol::XPolicyLab];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            PolicyProtocol::Openpi => "openpi",
            PolicyProtocol::Act => "act",
            PolicyProtocol::XPolicyLab => "xpolicylab",
        }
    }

    /// Returns the URL schemes; the encrypted one is last.
    pub fn schemes(self) -> [&'static str; 2] {
        match self {
            PolicyProtocol::Openpi | PolicyProtocol::XPolicyLab => link::SCHEMES,
            PolicyProtocol::Act => act::SCHEMES,
        }
    }

    /// Returns an error if a key would be sent unencrypted to another machine.
    pub fn check_key(self, address: &PolicyAddress) -> Result<(), PolicyKeyError> {
        if address.key.is_none() || address.is_encrypted() || address.is_loopback() {
            return Ok(());
        }
        let [_, encrypted] = self.schemes();
        Err(PolicyKeyError::Unencrypted { url: address.url.clone(), protocol: self.name(), encrypted })
    }

    /// Returns the preset that is used if no map is given; `None` if the protocol has no default.
    pub fn preset(self) -> Option<&'static str> {
        match self {
            PolicyProtocol::Openpi | PolicyProtocol::XPolicyLab => Some(self.name()),
            PolicyProtocol::Act => None,
        }
    }

    /// Opens a client of the server at `address` for an episode of `task`.
    ///
    /// The server must be reachable within `connect_within`, but may be busy then. The time limit for its
    /// first message is the longer of `connect_within` and `reply_within`.
    pub fn open(
        self,
        address: &PolicyAddress,
        task: &str,
        connect_within: Duration,
        reply_within: Duration,
    ) -> Result<Box<dyn PolicyClient>, RemoteError> {
        Ok(match self {
            PolicyProtocol::Openpi => {
                Box::new(openpi::Openpi::connect(address, connect_within, reply_within)?)
            }
            PolicyProtocol::Act => Box::new(act::Act::new(address, connect_within)),
            PolicyProtocol::XPolicyLab => {
                Box::new(xpolicylab::XPolicyLab::connect(address, task, connect_within, reply_within)?)
            }
        })
    }
}

impl fmt::Display for PolicyProtocol {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}
