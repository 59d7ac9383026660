//! Every refusal as RFC 9457 problem details. The detail says what would work; what is our own fault goes to the log only.

#[cfg(test)]
mod goldens;

use std::time::Duration;

use axum::{
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use tandem_episodes::EpisodeError;
use tandem_tools_spec::{Format, ProblemBody, SpecError};

use crate::hosting::{EpisodeThread, HostingError};

/// The media type of RFC 9457.
pub const PROBLEM_JSON: &str = "application/problem+json";

/// Everything a request can be refused for.
#[derive(Debug, thiserror::Error)]
pub enum ApiError {
    /// The call does not fit the contract.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// A refusal that concerns an episode whose recording has failed, which every answer of it says.
    #[error("{error}")]
    Unrecorded {
        /// The refusal.
        error: Box<ApiError>,
        /// Why the recording is not complete.
        recording_failed: String,
    },
    /// The host of the episodes, or the episode itself, refused.
    #[error("{0}{way}", way = way_out(.0))]
    Hosting(#[from] HostingError),
    /// No such route, or not with this method.
    #[error("{method} {path} is not served; have: {}", .have.join(", "))]
    NoRoute {
        /// What was asked for.
        method: String,
        /// What was asked for.
        path: String,
        /// The routes that are served.
        have: Vec<String>,
        /// Whether the path is served with another method.
        other_method: bool,
    },
    /// The body names another episode than the path.
    #[error(
        "the path names episode {path:?} and the body {body}; leave episode_id out of the body or make them equal"
    )]
    EpisodeMismatch {
        /// From the path.
        path: String,
        /// From the body, as JSON.
        body: String,
    },
    /// A call over MCP that names no episode.
    #[error("{tool} needs episode_id, a text, as start_episode returned it")]
    NoEpisodeNamed {
        /// The tool that was called.
        tool: String,
    },
    /// The request is for another server.
    #[error(
        "host {0:?} is not this server; use the address it prints at its start, or name the host in --allowed-host"
    )]
    ForeignHost(String),
    /// The request comes from a web page of somebody else.
    #[error("origin {0:?} is another site, and pages of other sites may not call; call from a program")]
    ForeignOrigin(String),
    /// The body is no JSON.
    #[error("the body is no JSON: {0}; send one JSON object, with finite numbers only, as {{\"steps\": 25}}")]
    MalformedJson(String),
    /// The body is no MessagePack.
    #[error("the body is no MessagePack: {0}; send one map with names for keys and finite numbers only")]
    MalformedMsgpack(String),
    /// Nothing says who calls.
    #[error("send the token as Authorization: Bearer TOKEN")]
    NoToken,
    /// A key that cannot be kept.
    #[error(
        "Idempotency-Key has to be 1 to 255 letters, digits and signs, as a UUID; a new one for each request"
    )]
    Key,
    /// The body is JSON, but no object.
    #[error(
        "the body is {0}; send one JSON object, as {{\"steps\": 25}}, or no body where there is nothing to say"
    )]
    NoObject(&'static str),
    /// The body took too long.
    #[error("the body did not arrive in {} s; send it again, in one go", .limit.as_secs())]
    SlowBody {
        /// The longest that is waited.
        limit: Duration,
    },
    /// The body did not arrive.
    #[error("the body could not be read: {0}; send it again")]
    BrokenBody(String),
    /// The body is too large.
    #[error("the body is larger than {limit_bytes} bytes; send less, as fewer rows per send_joint_chunk")]
    BodyTooLarge {
        /// The most that is read.
        limit_bytes: usize,
    },
    /// The body is said to be something else than JSON.
    #[error(
        "content-type {0:?} is not read; send JSON with content-type: application/json, or MessagePack with application/msgpack"
    )]
    ContentType(String),
    /// More requests are under way than are let in at once.
    #[error("{limit} requests are under way, which is the most; send it again")]
    Busy {
        /// How many may be under way.
        limit: usize,
    },
    /// The caller's address sends more than its share.
    #[error("an address may send {per_second} requests a second; send it again, and fewer")]
    TooManyRequests {
        /// How many it may send.
        per_second: u32,
    },
    /// No such form of the tools' specifications.
    #[error("no format {name:?}; have: {}", Format::ALL.map(Format::name).join(", "))]
    UnknownFormat {
        /// What was asked for.
        name: String,
    },
    /// A request that axum refused before any handler saw it.
    #[error("{detail}")]
    Protocol {
        /// As axum had it.
        status: StatusCode,
        /// What axum said.
        detail: String,
    },
    /// A reply of ours that cannot be written.
    #[error("a reply cannot be written: {0}")]
    Reply(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// What a caller over HTTP can do about a refusal whose text does not say so: the host does not know the routes.
fn way_out(error: &HostingError) -> &'static str {
    match error {
        HostingError::UnknownEpisode { .. } => "; start_episode (POST /v1/episodes) starts one",
        HostingError::TooManyEpisodes { .. } => "; finish or DELETE one, or try again later",
        HostingError::EpisodeStopped | HostingError::EpisodePanicked => {
            "; start another with start_episode (POST /v1/episodes)"
        }
        HostingError::Episode(_)
        | HostingError::TooManyWaiting { .. }
        | HostingError::ShuttingDown
        | HostingError::Folder { .. }
        | HostingError::OtherStep { .. }
        | HostingError::DoubleCommand { .. }
        | HostingError::LateCommand { .. }
        | HostingError::OperatorFinished { .. }
        | HostingError::NeedsOperator
        | HostingError::HostsBusiness
        | HostingError::NoTalk
        | HostingError::TooMuchSaid { .. }
        | HostingError::KeyUsed
        | HostingError::Token(_)
        | HostingError::Thread(_) => "",
        HostingError::Shared(error) => way_out(error),
    }
}

/// A kind of problem: a stable name, the name in words, and the status it is served with.
type Kind = (&'static str, &'static str, StatusCode);

impl ApiError {
    fn kind(&self) -> Kind {
        match self {
            ApiError::Spec(error) => spec_kind(error),
            ApiError::Unrecorded { error, .. } => error.kind(),
            ApiError::Hosting(error) => hosting_kind(error),
            ApiError::NoRoute { other_method: false, .. } => {
                ("no-route", "No such route", StatusCode::NOT_FOUND)
            }
            ApiError::NoRoute { other_method: true, .. } => {
                ("no-method", "Method not allowed", StatusCode::METHOD_NOT_ALLOWED)
            }
            ApiError::EpisodeMismatch { .. } => {
                ("episode-mismatch", "Two episodes named", StatusCode::UNPROCESSABLE_ENTITY)
            }
            ApiError::NoEpisodeNamed { .. } => {
                ("no-episode-named", "No episode named", StatusCode::UNPROCESSABLE_ENTITY)
            }
            ApiError::ForeignHost(_) => ("foreign-host", "Foreign host", StatusCode::FORBIDDEN),
            ApiError::ForeignOrigin(_) => ("foreign-origin", "Foreign origin", StatusCode::FORBIDDEN),
            ApiError::NoObject(_) => ("no-object", "No JSON object", StatusCode::UNPROCESSABLE_ENTITY),
            ApiError::SlowBody { .. } => ("slow-body", "Body too slow", StatusCode::REQUEST_TIMEOUT),
            ApiError::MalformedJson(_) => ("malformed-json", "Malformed JSON", StatusCode::BAD_REQUEST),
            ApiError::MalformedMsgpack(_) => {
                ("malformed-msgpack", "Malformed MessagePack", StatusCode::BAD_REQUEST)
            }
            ApiError::NoToken => ("no-token", "No token", StatusCode::UNAUTHORIZED),
            ApiError::Key => ("invalid-key", "Invalid key", StatusCode::BAD_REQUEST),
            ApiError::BrokenBody(_) => ("broken-body", "Body not received", StatusCode::BAD_REQUEST),
            ApiError::BodyTooLarge { .. } => {
                ("body-too-large", "Body too large", StatusCode::PAYLOAD_TOO_LARGE)
            }
            ApiError::ContentType(_) => {
                ("content-type", "Unsupported content type", StatusCode::UNSUPPORTED_MEDIA_TYPE)
            }
            ApiError::Busy { .. } => ("busy", "Too many requests at once", StatusCode::SERVICE_UNAVAILABLE),
            ApiError::TooManyRequests { .. } => {
                ("too-many-requests", "Too many requests", StatusCode::TOO_MANY_REQUESTS)
            }
            ApiError::UnknownFormat { .. } => {
                ("unknown-format", "Unknown format", StatusCode::UNPROCESSABLE_ENTITY)
            }
            ApiError::Protocol { status, .. } => ("bad-request", "Bad request", *status),
            ApiError::Reply(_) => INTERNAL,
        }
    }

    /// The status that it is served with.
    pub fn status(&self) -> StatusCode {
        self.kind().2
    }

    /// The kind's stable name.
    pub fn name(&self) -> &'static str {
        self.kind().0
    }

    /// The body that this refusal is served with. What is our own fault is logged.
    pub fn body(&self) -> ProblemBody {
        let (kind, title, status) = self.kind();
        if status.is_server_error() {
            tracing::error!(error = %self, "request failed");
        }
        let detail = if (kind, title, status) == INTERNAL {
            "the server failed; its log says why".into()
        } else {
            self.to_string()
        };
        ProblemBody {
            kind: format!("urn:tandem:problem:{kind}"),
            title: title.into(),
            status: status.as_u16(),
            detail,
            recording_failed: self.recording_failed().map(str::to_owned),
        }
    }

    /// Why the recording of the episode that it concerns is not complete, if that has to be said.
    pub fn recording_failed(&self) -> Option<&str> {
        match self {
            ApiError::Unrecorded { recording_failed, .. } => Some(recording_failed),
            _ => None,
        }
    }

    /// The refusal as `episode` makes it.
    pub fn of(self, episode: &EpisodeThread) -> ApiError {
        match episode.recording_failed() {
            Some(reason) => {
                ApiError::Unrecorded { error: Box::new(self), recording_failed: reason.to_owned() }
            }
            None => self,
        }
    }

    /// Seconds after which the same request may work.
    fn retry_after_s(&self) -> Option<u16> {
        match self {
            ApiError::Unrecorded { error, .. } => error.retry_after_s(),
            ApiError::Hosting(error) => hosting_retry_s(error),
            ApiError::Busy { .. } | ApiError::TooManyRequests { .. } => Some(1),
            _ => None,
        }
    }
}

fn hosting_retry_s(error: &HostingError) -> Option<u16> {
    match error {
        HostingError::TooManyWaiting { .. } | HostingError::TooMuchSaid { .. } => Some(1),
        HostingError::TooManyEpisodes { .. } => Some(10),
        HostingError::ShuttingDown => Some(60),
        HostingError::Shared(error) => hosting_retry_s(error),
        _ => None,
    }
}

const INTERNAL: Kind = ("internal", "Internal error", StatusCode::INTERNAL_SERVER_ERROR);

/// That a response refuses, and the name of the problem's kind.
#[derive(Debug, Clone, Copy)]
pub struct Refused(pub &'static str);

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let (_, _, status) = self.kind();
        let text = serde_json::json!(self.body()).to_string();
        let mut response = (status, [(header::CONTENT_TYPE, PROBLEM_JSON)], text).into_response();
        response.extensions_mut().insert(Refused(self.name()));
        let headers = response.headers_mut();
        if let Some(seconds) = self.retry_after_s() {
            headers.insert(header::RETRY_AFTER, seconds.into());
        }
        if status == StatusCode::UNAUTHORIZED {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        if status == StatusCode::REQUEST_TIMEOUT {
            headers.insert(header::CONNECTION, HeaderValue::from_static("close"));
        }
        response
    }
}

fn hosting_kind(error: &HostingError) -> Kind {
    match error {
        HostingError::Episode(error) => episode_kind(error),
        HostingError::UnknownEpisode { .. } => ("unknown-episode", "Unknown episode", StatusCode::NOT_FOUND),
        HostingError::TooManyEpisodes { .. } => {
            ("too-many-episodes", "Too many episodes", StatusCode::TOO_MANY_REQUESTS)
        }
        HostingError::TooManyWaiting { .. } => {
            ("too-many-calls", "Too many calls at once", StatusCode::TOO_MANY_REQUESTS)
        }
        HostingError::ShuttingDown => ("shutting-down", "Shutting down", StatusCode::SERVICE_UNAVAILABLE),
        HostingError::EpisodeStopped => ("episode-stopped", "Episode stopped", StatusCode::GONE),
        HostingError::EpisodePanicked => {
            ("episode-failed", "The simulator failed", StatusCode::INTERNAL_SERVER_ERROR)
        }
        HostingError::OtherStep { .. } => ("other-step", "Another step", StatusCode::CONFLICT),
        HostingError::DoubleCommand { .. } => ("double-command", "Commanded already", StatusCode::CONFLICT),
        HostingError::LateCommand { .. } => ("late-command", "Commanded late", StatusCode::CONFLICT),
        HostingError::OperatorFinished { .. } => {
            ("operator-finished", "Operator has finished", StatusCode::CONFLICT)
        }
        HostingError::NeedsOperator => ("needs-operator", "Driven by operators", StatusCode::FORBIDDEN),
        HostingError::HostsBusiness => ("hosts-business", "Not for operators", StatusCode::FORBIDDEN),
        HostingError::NoTalk => ("no-talk", "Nobody hears", StatusCode::CONFLICT),
        HostingError::TooMuchSaid { .. } => ("too-much-said", "Too much said", StatusCode::TOO_MANY_REQUESTS),
        HostingError::KeyUsed => ("key-used", "Key used", StatusCode::UNPROCESSABLE_ENTITY),
        HostingError::Shared(error) => hosting_kind(error),
        HostingError::Folder { .. } | HostingError::Token(_) | HostingError::Thread(_) => INTERNAL,
    }
}

fn episode_kind(error: &EpisodeError) -> Kind {
    match error {
        EpisodeError::UnknownTask { .. } => ("unknown-task", "Unknown task", StatusCode::NOT_FOUND),
        EpisodeError::UnknownRobot { .. } => ("unknown-robot", "Unknown robot", StatusCode::NOT_FOUND),
        EpisodeError::TooManySteps { .. } => {
            ("too-many-steps", "Too many steps", StatusCode::UNPROCESSABLE_ENTITY)
        }
        EpisodeError::PixelOutside { .. } => {
            ("pixel-outside", "Pixel outside the image", StatusCode::UNPROCESSABLE_ENTITY)
        }
        EpisodeError::ForeignRobot { .. } => {
            ("foreign-robot", "Another operator's robot", StatusCode::CONFLICT)
        }
        EpisodeError::DepthImage { .. } => ("depth-image", "No depth images", StatusCode::CONFLICT),
        EpisodeError::Ended { .. } => ("ended", "Episode ended", StatusCode::CONFLICT),
        EpisodeError::Spec(error) => spec_kind(error),
        EpisodeError::Checkpoint(_) => {
            ("checkpoint", "Checkpoint does not fit", StatusCode::UNPROCESSABLE_ENTITY)
        }
        EpisodeError::Scene(_) => ("scene", "Scene does not fit the task", StatusCode::UNPROCESSABLE_ENTITY),
        EpisodeError::Diverged(_) => ("diverged", "Physics diverged", StatusCode::CONFLICT),
        EpisodeError::Sim(_)
        | EpisodeError::Ik(_)
        | EpisodeError::Picture(_)
        | EpisodeError::Build(_)
        | EpisodeError::Output(_) => INTERNAL,
    }
}

fn spec_kind(error: &SpecError) -> Kind {
    match error {
        SpecError::UnknownTool { .. } => ("unknown-tool", "Unknown tool", StatusCode::NOT_FOUND),
        SpecError::Malformed { .. } | SpecError::Invalid { .. } => {
            ("invalid-arguments", "Invalid arguments", StatusCode::UNPROCESSABLE_ENTITY)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::{Arc, Mutex};

    use super::*;

    #[test]
    fn our_own_faults_stay_in_the_log_and_other_refusals_say_what_would_work() {
        let check = |error: HostingError, status: u16, says: &str| {
            let body = ApiError::from(error).body();
            assert_eq!(body.status, status, "{body:?}");
            assert!(body.detail.contains(says), "{body:?}");
        };
        let failure = || io::Error::other("disk full");
        check(HostingError::Folder { runs: "runs".into(), source: failure() }, 500, "its log says why");
        check(HostingError::Thread(failure()), 500, "the server failed; its log says why");
        check(HostingError::UnknownEpisode { id: "x".into() }, 404, "POST /v1/episodes");
        check(HostingError::EpisodePanicked, 500, "its recording holds what went before; start another");
        check(HostingError::TooManyEpisodes { limit: 8 }, 429, "all 8 places for episodes are taken; finish");
        check(HostingError::TooManyWaiting { limit: 16 }, 429, "call again when");
        check(HostingError::ShuttingDown, 503, "try again");
        check(HostingError::EpisodeStopped, 410, "start another");
    }

    /// What is logged while `work` is done.
    fn logged(work: impl FnOnce()) -> String {
        let lines = Arc::new(Mutex::new(Vec::new()));
        let writer = lines.clone();
        let log = tracing_subscriber::fmt().with_writer(move || Lines(writer.clone())).finish();
        tracing::subscriber::with_default(log, work);
        let lines = lines.lock().unwrap();
        String::from_utf8(lines.clone()).unwrap()
    }

    struct Lines(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Lines {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// MCP takes the body and REST the response.
    #[test]
    fn our_own_faults_are_logged_once_whatever_the_caller_speaks() {
        let fault = || ApiError::from(HostingError::Thread(io::Error::other("no more threads")));
        for log in [logged(|| drop(fault().body())), logged(|| drop(fault().into_response()))] {
            assert_eq!(log.matches("no more threads").count(), 1, "{log}");
        }
        assert_eq!(logged(|| drop(ApiError::from(HostingError::EpisodeStopped).body())), "");
    }

    #[test]
    fn what_may_work_later_says_when() {
        let check = |error: ApiError, expected: Option<&str>| {
            let response = error.into_response();
            let header = response.headers().get(header::RETRY_AFTER).map(|value| value.to_str().unwrap());
            assert_eq!(header, expected, "{}", response.status());
        };
        check(HostingError::TooManyEpisodes { limit: 8 }.into(), Some("10"));
        check(HostingError::TooManyWaiting { limit: 16 }.into(), Some("1"));
        check(HostingError::ShuttingDown.into(), Some("60"));
        check(HostingError::EpisodeStopped.into(), None);
        check(ApiError::Busy { limit: 256 }, Some("1"));
        check(ApiError::TooManyRequests { per_second: 10 }, Some("1"));
    }
}
