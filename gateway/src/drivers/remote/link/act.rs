//! `/act`: a request is one POST of JSON, with arrays as the Python package `json_numpy` writes them.

use std::{io, time::Duration};

use ureq::{Agent, http::Response};

use super::{Link, json_numpy};
use crate::drivers::remote::{
    error::{RemoteError, gist},
    values::{Sent, Told},
};

/// Answers beyond this are not read.
const LARGEST_ANSWER_BYTES: u64 = 64 << 20;

/// The policy at one address.
pub struct Act {
    url: String,
    agent: Agent,
}

impl Act {
    pub fn new(url: &str) -> Act {
        let agent = Agent::config_builder().http_status_as_error(false).build().new_agent();
        Act { url: url.into(), agent }
    }

    fn post(&self, body: String, within: Duration) -> Result<Response<ureq::Body>, ureq::Error> {
        let request = self.agent.post(&self.url).config().timeout_global(Some(within)).build();
        request.header("content-type", "application/json").send(body)
    }

    fn failed(&self, error: ureq::Error, within: Duration) -> RemoteError {
        let (url, reason) = (self.url.clone(), error.to_string());
        match error {
            ureq::Error::Timeout(_) => RemoteError::Slow { url, within },
            ureq::Error::ConnectionFailed | ureq::Error::HostNotFound => {
                RemoteError::Unreachable { url, reason }
            }
            ureq::Error::Io(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
                RemoteError::Unreachable { url, reason }
            }
            _ => RemoteError::Gone { url, reason },
        }
    }
}

impl Link for Act {
    fn ask(&mut self, request: &Sent, within: Duration) -> Result<Told, RemoteError> {
        let body = json_numpy::write(request).to_string();
        let mut response = self.post(body, within).map_err(|error| self.failed(error, within))?;
        let status = response.status();
        let read = response.body_mut().with_config().limit(LARGEST_ANSWER_BYTES).read_to_string();
        let text = read.map_err(|error| self.failed(error, within))?;
        if !status.is_success() {
            let text = format!("{status}: {}", gist(&text));
            return Err(RemoteError::Failed { url: self.url.clone(), text });
        }
        let told = serde_json::from_str(&text).map_err(|error| error.to_string()).and_then(json_numpy::read);
        told.map_err(|reason| RemoteError::Unreadable { url: self.url.clone(), reason })
    }
}
