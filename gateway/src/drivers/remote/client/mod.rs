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

use super::{
    error::RemoteError,
    values::{ReplyValue, RequestValue},
};

/// A connection to one policy server.
pub trait PolicyClient: Send {
    /// The answer to a request, if it comes in time.
    fn ask(&mut self, request: &RequestValue, within: Duration) -> Result<ReplyValue, RemoteError>;

    /// What was asked before is over: the policy begins anew, where its protocol has a word for that.
    fn begin_trial(&mut self, within: Duration) -> Result<(), RemoteError>;

    /// Tells a server that has not been asked for a while that somebody is there still.
    fn keep_alive(&mut self);
}

/// How a server is spoken to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolicyProtocol {
    /// msgpack with numpy arrays over WebSocket, as openpi's server and client.
    Openpi,
    /// JSON with numpy arrays over HTTP, as the `/act` of OpenVLA and others.
    Act,
    /// Frames of msgpack over WebSocket, as XPolicyLab's servers.
    XPolicyLab,
}

impl PolicyProtocol {
    pub const ALL: [PolicyProtocol; 3] =
        [PolicyProtocol::Openpi, PolicyProtocol::Act, PolicyProtocol::XPolicyLab];

    /// As the command line calls it.
    pub fn name(self) -> &'static str {
        match self {
            PolicyProtocol::Openpi => "openpi",
            PolicyProtocol::Act => "act",
            PolicyProtocol::XPolicyLab => "xpolicylab",
        }
    }

    /// What its addresses begin with: those of encrypted servers last.
    pub fn schemes(self) -> [&'static str; 2] {
        match self {
            PolicyProtocol::Openpi | PolicyProtocol::XPolicyLab => link::SCHEMES,
            PolicyProtocol::Act => act::SCHEMES,
        }
    }

    /// Refuses to send a key where others could read it: to another machine, unencrypted.
    pub fn check_key(self, address: &PolicyAddress) -> Result<(), PolicyKeyError> {
        if address.key.is_none() || address.is_encrypted() || address.is_loopback() {
            return Ok(());
        }
        let [_, encrypted] = self.schemes();
        Err(PolicyKeyError::Unencrypted { url: address.url.clone(), protocol: self.name(), encrypted })
    }

    /// The preset that is meant where no map is given.
    pub fn preset(self) -> Option<&'static str> {
        match self {
            PolicyProtocol::Openpi | PolicyProtocol::XPolicyLab => Some(self.name()),
            PolicyProtocol::Act => None,
        }
    }

    /// A client of the server at `address` for an episode of `task`. The server has to be found within `connect_within`; it may be busy
    /// then, and has `reply_within` to say who it is, or as long as to be found if that is longer.
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
