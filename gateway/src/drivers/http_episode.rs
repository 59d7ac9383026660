//! An HTTP client for one episode, for policies written in Rust.

use std::{
    fmt::Write,
    io,
    net::SocketAddr,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use serde::Serialize;
use serde_json::Value;
use tandem_episodes::players::{Episode, PlayerError};
use tandem_tools_spec::{Driving, ProblemBody, ResultReply, StartEpisode, StartReply, ToolCall, ToolReply};
use ureq::{Agent, http::Response};

/// Timeout of a request. It exceeds the longest call: an operator's call waits up to 600 s for its
/// partners.
const TIMEOUT: Duration = Duration::from_secs(720);

/// Header with the idempotency key, so that a repeated request is executed once.
const KEY: &str = "idempotency-key";

/// An episode on a server.
#[derive(Debug)]
pub struct HttpEpisode {
    agent: Agent,
    url: String,
}

/// Request body of a start.
#[derive(Debug, Serialize)]
struct StartBody<'a> {
    #[serde(flatten)]
    args: &'a StartEpisode,
    #[serde(flatten)]
    driving: &'a Driving,
}

/// Reason why a call over HTTP has no reply.
#[derive(Debug, thiserror::Error)]
pub enum HttpError {
    /// The server refused the call and gave a reason.
    #[error("{}", .0.detail)]
    Refused(Box<ProblemBody>),
    /// The server was not reached, or its response is not JSON.
    #[error("no reply over HTTP: {0}")]
    Transport(#[from] ureq::Error),
    /// The reply does not match the contract.
    #[error("a reply that the contract does not know: {0}")]
    Contract(#[from] serde_json::Error),
}

impl HttpEpisode {
    /// Starts an episode on the server at `address`.
    pub fn start(address: SocketAddr, args: &StartEpisode) -> Result<(HttpEpisode, StartReply), HttpError> {
        HttpEpisode::start_driven(address, args, &Driving::default())
    }

    /// Starts an episode as [`HttpEpisode::start`] does, with the given `driving`.
    ///
    /// If each robot has its own operator, the reply includes the operators' tokens. The returned client
    /// can then end the episode, but not play it.
    pub fn start_driven(
        address: SocketAddr,
        args: &StartEpisode,
        driving: &Driving,
    ) -> Result<(HttpEpisode, StartReply), HttpError> {
        let agent = Agent::config_builder()
            .http_status_as_error(false)
            // The server is nearby, so no proxy is used.
            .proxy(None)
            // With a limit on the whole call, ureq would resolve every address on a separate thread.
            .timeout_recv_response(Some(TIMEOUT))
            .timeout_recv_body(Some(TIMEOUT))
            .build()
            .new_agent();
        let episodes = format!("http://{address}/v1/episodes");
        let body = StartBody { args, driving };
        let started: StartReply = serde_json::from_value(post(&agent, &episodes, &body)?)?;
        let url = format!("{episodes}/{}", started.episode_id);
        Ok((HttpEpisode { agent, url }, started))
    }

    /// Ends the episode and closes its recording.
    pub fn delete(self) -> Result<ResultReply, HttpError> {
        Ok(serde_json::from_value(reply(self.agent.delete(&self.url).call()?)?)?)
    }
}

impl Episode for HttpEpisode {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let url = format!("{}/tools/{}", self.url, call.name());
        let answer = post(&self.agent, &url, &call).and_then(|reply| Ok(call.parse_reply(reply)?));
        answer.map_err(|error| match error {
            HttpError::Refused(problem) if problem.kind.ends_with(":ended") => PlayerError::EpisodeOver,
            error => PlayerError::Call { tool: call.name(), reason: error.to_string() },
        })
    }
}

/// Posts a request and repeats it if the connection breaks. Its idempotency key makes the server execute
/// it once.
fn post(agent: &Agent, url: &str, body: &impl Serialize) -> Result<Value, HttpError> {
    let key = new_key();
    let send = || agent.post(url).header(KEY, &key).send_json(body);
    match send() {
        Err(ureq::Error::Io(error)) if is_broken(&error) => reply(send()?),
        sent => reply(sent?),
    }
}

/// Returns true if an existing connection has broken.
fn is_broken(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::BrokenPipe
            | io::ErrorKind::ConnectionAborted
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::UnexpectedEof
    )
}

/// Returns a key that no other request has.
fn new_key() -> String {
    let mut bytes = [0; 16];
    if getrandom::fill(&mut bytes).is_err() {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        return format!("{}", now.as_nanos());
    }
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn reply(mut response: Response<ureq::Body>) -> Result<Value, HttpError> {
    if response.status().is_success() {
        Ok(response.body_mut().read_json()?)
    } else {
        Err(HttpError::Refused(Box::new(response.body_mut().read_json()?)))
    }
}
