//! Refusals as RFC 9457 problem details. The detail says which calls would work. The text of a server fault
//! is only logged.

#[cfg(test)]
mod goldens;

use std::time::Duration;

use axum::{
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use tandem_episodes::EpisodeError;
use tandem_tools_spec::{Format, ProblemBody, Refusal, RefusalClass, ResultReply, SpecError};

use crate::hosting::{EpisodeThread, HostingError};

/// Media type of RFC 9457.
pub const PROBLEM_JSON: &str = "application/problem+json";

/// Status of requests that are invalid as HTTP requests to this server.
const BAD_REQUEST: StatusCode = StatusCode::BAD_REQUEST;

/// Reason why a request is refused.
#[derive(Debug, thiserror::Error)]
pub enum ApiError {
    /// The call does not fit the contract.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// A refusal of an episode whose recording has failed; every answer of that episode reports the
    /// failure.
    #[error("{error}")]
    RecordingFailed {
        /// The refusal itself.
        error: Box<ApiError>,
        /// Reason why the recording is incomplete.
        recording_failed: String,
    },
    /// The host of the episodes, or the episode itself, refused.
    #[error("{0}{hint}", hint = hint(.0))]
    Hosting(#[from] HostingError),
    /// The route does not exist, or not with this method.
    #[error("{method} {path} is not served; have: {}", .have.join(", "))]
    NoRoute {
        /// Requested method.
        method: String,
        /// Requested path.
        path: String,
        /// Routes that are served.
        have: Vec<String>,
        /// True if the path is served with another method.
        other_method: bool,
    },
    /// The body names an episode other than the one in the path.
    #[error(
        "the path names episode {path:?} and the body {body}; leave episode_id out of the body or make them \
         equal"
    )]
    EpisodeMismatch {
        /// Id in the path.
        path: String,
        /// Id in the body, as JSON.
        body: String,
    },
    /// A call over MCP names no episode.
    #[error("{tool} needs episode_id, a text, as start_episode returned it")]
    NoEpisodeNamed {
        /// Name of the called tool.
        tool: String,
    },
    /// The request is for another server.
    #[error(
        "host {0:?} is not this server; use the address it prints at its start, or name the host in \
         --allowed-host"
    )]
    ForeignHost(String),
    /// The request comes from a foreign web page.
    #[error("origin {0:?} is another site, and pages of other sites may not call; call from a program")]
    ForeignOrigin(String),
    /// The request is plain HTTP, but the server requires HTTPS.
    #[error("this server speaks HTTPS; ask for https:// in place of http://")]
    NotEncrypted,
    /// The body is not valid JSON.
    #[error(
        "the body is no JSON: {0}; send one JSON object, with finite numbers only, for example {{\"steps\": \
         25}}"
    )]
    MalformedJson(String),
    /// The body is not valid MessagePack.
    #[error("the body is no MessagePack: {0}; send one map with names for keys and finite numbers only")]
    MalformedMsgpack(String),
    /// The caller has no token.
    #[error("send the token as Authorization: Bearer TOKEN")]
    NoToken,
    /// The caller has no watch key.
    #[error("watching wants the link that the server printed when it started; a policy's token does not do")]
    NoWatcher,
    /// There is no finished episode with that name.
    #[error("no finished episode {run:?} with that file in the runs folder; GET /watch/episodes lists them")]
    NoRun {
        /// Requested name.
        run: String,
    },
    /// No scene that a page draws has an image with that hash.
    #[error(
        "no scene has an image {hash:?} on its surfaces; the head of GET /watch/scene lists their hashes"
    )]
    NoTexture {
        /// Requested hash.
        hash: String,
    },
    /// The server has no collection, or the caller does not take part in it.
    #[error(
        "nobody collects episodes by this server and token; tandem collect --operators N prints the links of \
         those who do"
    )]
    NoCollection,
    /// The request marks an episode, but no episode awaits a mark.
    #[error("no episode is to be marked now; mark it when it has ended")]
    NothingToMark,
    /// The idempotency key is not a text of the right length.
    #[error(
        "Idempotency-Key has to be 1 to 255 letters, digits and signs, as a UUID; a new one for each request"
    )]
    Key,
    /// The body is JSON, but not an object.
    #[error(
        "the body is {0}; send one JSON object, for example {{\"steps\": 25}}, or no body where there is \
         nothing to say"
    )]
    NoObject(&'static str),
    /// The body took too long to arrive.
    #[error("the body did not arrive in {} s; send it again, in one go", .limit.as_secs())]
    SlowBody {
        /// Time limit.
        limit: Duration,
    },
    /// The body did not arrive completely.
    #[error("the body could not be read: {0}; send it again")]
    BrokenBody(String),
    /// The body is too large.
    #[error(
        "the body is larger than {limit_bytes} bytes; send less, for example fewer rows per send_joint_chunk"
    )]
    BodyTooLarge {
        /// Limit in bytes.
        limit_bytes: usize,
    },
    /// The content type is neither JSON nor MessagePack.
    #[error(
        "content-type {0:?} is not read; send JSON with content-type: application/json, or MessagePack with \
         application/msgpack"
    )]
    ContentType(String),
    /// Too many requests are in progress.
    #[error("{limit} requests are under way, which is the most; send it again")]
    Busy {
        /// Maximum number of concurrent requests.
        limit: usize,
    },
    /// The caller's address exceeds its rate.
    #[error("an address may send {per_second} requests a second; send it again, and fewer")]
    TooManyRequests {
        /// Allowed number of requests per second.
        per_second: u32,
    },
    /// The format of the tools' specifications is unknown.
    #[error("no format {name:?}; have: {}", Format::ALL.map(Format::name).join(", "))]
    UnknownFormat {
        /// Requested format.
        name: String,
    },
    /// axum refused the request before any handler saw it.
    #[error("{detail}")]
    Protocol {
        /// Status from axum.
        status: StatusCode,
        /// Message from axum.
        detail: String,
    },
    /// A reply could not be serialized.
    #[error("a reply cannot be written: {0}")]
    Reply(#[source] Box<dyn std::error::Error + Send + Sync>),
}

fn result_in(error: &HostingError) -> Option<&ResultReply> {
    match error {
        HostingError::Episode(EpisodeError::Ended { result, .. }) => Some(result),
        HostingError::Shared(error) => result_in(error),
        _ => None,
    }
}

/// Returns the caller's remedy, unless the error's own text has it.
fn hint(error: &HostingError) -> String {
    error.refusal().hint.map_or_else(String::new, |hint| format!("; {hint}"))
}

/// HTTP form of a refusal.
#[derive(Debug, Clone, Copy)]
struct Problem {
    /// Stable name.
    kind: &'static str,
    /// Title in words.
    title: &'static str,
    status: StatusCode,
    /// Seconds after which the same request may work.
    retry_after_s: Option<u16>,
    /// True if the text is for the log only.
    internal: bool,
}

impl Problem {
    /// Creates a problem of HTTP itself, which has no [`RefusalClass`].
    const fn new(kind: &'static str, title: &'static str, status: StatusCode) -> Problem {
        Problem { kind, title, status, retry_after_s: None, internal: false }
    }
}

impl From<Refusal> for Problem {
    fn from(refusal: Refusal) -> Problem {
        let Refusal { kind, title, class, retry_after_s, .. } = refusal;
        let internal = class == RefusalClass::Internal;
        Problem { kind, title, status: status(class), retry_after_s, internal }
    }
}

fn status(class: RefusalClass) -> StatusCode {
    match class {
        RefusalClass::NotFound => StatusCode::NOT_FOUND,
        RefusalClass::Invalid => StatusCode::UNPROCESSABLE_ENTITY,
        RefusalClass::Conflict => StatusCode::CONFLICT,
        RefusalClass::Forbidden => StatusCode::FORBIDDEN,
        RefusalClass::Gone => StatusCode::GONE,
        RefusalClass::Elsewhere => StatusCode::TEMPORARY_REDIRECT,
        RefusalClass::TooMany => StatusCode::TOO_MANY_REQUESTS,
        RefusalClass::Unavailable => StatusCode::SERVICE_UNAVAILABLE,
        RefusalClass::Failed | RefusalClass::Internal => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

impl ApiError {
    fn problem(&self) -> Problem {
        use RefusalClass::{Forbidden, Invalid, NotFound, TooMany, Unavailable};
        match self {
            ApiError::Spec(error) => error.refusal().into(),
            ApiError::Hosting(error) => error.refusal().into(),
            ApiError::RecordingFailed { error, .. } => error.problem(),
            ApiError::NoRoute { other_method: false, .. } => {
                Refusal::new("no-route", "No such route", NotFound).into()
            }
            ApiError::NoRoute { other_method: true, .. } => {
                Problem::new("no-method", "Method not allowed", StatusCode::METHOD_NOT_ALLOWED)
            }
            ApiError::EpisodeMismatch { .. } => {
                Refusal::new("episode-mismatch", "Two episodes named", Invalid).into()
            }
            ApiError::NoEpisodeNamed { .. } => {
                Refusal::new("no-episode-named", "No episode named", Invalid).into()
            }
            ApiError::ForeignHost(_) => Refusal::new("foreign-host", "Foreign host", Forbidden).into(),
            ApiError::ForeignOrigin(_) => Refusal::new("foreign-origin", "Foreign origin", Forbidden).into(),
            ApiError::NotEncrypted => Problem::new("not-encrypted", "Not encrypted", BAD_REQUEST),
            ApiError::NoObject(_) => Refusal::new("no-object", "No JSON object", Invalid).into(),
            ApiError::SlowBody { .. } => {
                Problem::new("slow-body", "Body too slow", StatusCode::REQUEST_TIMEOUT)
            }
            ApiError::MalformedJson(_) => Problem::new("malformed-json", "Malformed JSON", BAD_REQUEST),
            ApiError::MalformedMsgpack(_) => {
                Problem::new("malformed-msgpack", "Malformed MessagePack", BAD_REQUEST)
            }
            ApiError::NoToken => Problem::new("no-token", "No token", StatusCode::UNAUTHORIZED),
            ApiError::NoWatcher => Refusal::new("no-watcher", "Not by the link", Forbidden).into(),
            ApiError::NoRun { .. } => Refusal::new("no-run", "No such finished episode", NotFound).into(),
            ApiError::NoTexture { .. } => {
                Refusal::new("no-texture", "No such image on a surface", NotFound).into()
            }
            ApiError::NoCollection => Refusal::new("no-collection", "No collection", NotFound).into(),
            ApiError::NothingToMark => {
                Problem::new("nothing-to-mark", "Nothing to mark", StatusCode::CONFLICT)
            }
            ApiError::Key => Problem::new("invalid-key", "Invalid key", BAD_REQUEST),
            ApiError::BrokenBody(_) => Problem::new("broken-body", "Body not received", BAD_REQUEST),
            ApiError::BodyTooLarge { .. } => {
                Problem::new("body-too-large", "Body too large", StatusCode::PAYLOAD_TOO_LARGE)
            }
            ApiError::ContentType(_) => {
                Problem::new("content-type", "Unsupported content type", StatusCode::UNSUPPORTED_MEDIA_TYPE)
            }
            ApiError::Busy { .. } => {
                Refusal::new("busy", "Too many requests at once", Unavailable).retry_after_s(1).into()
            }
            ApiError::TooManyRequests { .. } => {
                Refusal::new("too-many-requests", "Too many requests", TooMany).retry_after_s(1).into()
            }
            ApiError::UnknownFormat { .. } => {
                Refusal::new("unknown-format", "Unknown format", Invalid).into()
            }
            ApiError::Protocol { status, .. } => Problem::new("bad-request", "Bad request", *status),
            ApiError::Reply(_) => Refusal::INTERNAL.into(),
        }
    }

    /// Returns the HTTP status.
    pub fn status(&self) -> StatusCode {
        self.problem().status
    }

    /// Returns the kind's stable name.
    pub fn kind(&self) -> &'static str {
        self.problem().kind
    }

    /// Returns the response body, and logs a fault of the server.
    pub fn body(&self) -> ProblemBody {
        let Problem { kind, title, status, internal, .. } = self.problem();
        if status.is_server_error() {
            tracing::error!(error = %self, "request failed");
        }
        let detail = if internal { "the server failed; its log says why".into() } else { self.to_string() };
        ProblemBody {
            kind: format!("urn:tandem:problem:{kind}"),
            title: title.into(),
            status: status.as_u16(),
            detail,
            recording_failed: self.recording_failed().map(str::to_owned),
            result: self.result().map(|result| serde_json::json!(result)),
        }
    }

    /// Returns the result of the episode if it refuses because it has ended.
    pub fn result(&self) -> Option<&ResultReply> {
        match self {
            ApiError::Hosting(error) => result_in(error),
            ApiError::RecordingFailed { error, .. } => error.result(),
            _ => None,
        }
    }

    /// Returns the URL of the other server that plays the episode, if one does.
    fn elsewhere(&self) -> Option<&str> {
        match self {
            ApiError::Hosting(error) => error.elsewhere(),
            ApiError::RecordingFailed { error, .. } => error.elsewhere(),
            _ => None,
        }
    }

    /// Returns the reason why the episode's recording is incomplete, if it has to be reported.
    pub fn recording_failed(&self) -> Option<&str> {
        let ApiError::RecordingFailed { recording_failed, .. } = self else { return None };
        Some(recording_failed)
    }

    /// Adds the reason why the recording of `episode` is incomplete, if it is.
    pub fn in_episode(self, episode: &EpisodeThread) -> ApiError {
        match episode.recording_failed() {
            Some(reason) => {
                ApiError::RecordingFailed { error: Box::new(self), recording_failed: reason.to_owned() }
            }
            None => self,
        }
    }
}

/// Response extension of a refusal: URL of the server that plays the episode.
#[derive(Debug, Clone)]
pub struct Elsewhere(pub String);

/// Response extension of a refusal: the name of the problem's kind.
#[derive(Debug, Clone, Copy)]
pub struct RefusalKind(pub &'static str);

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let Problem { kind, status, retry_after_s, .. } = self.problem();
        let text = serde_json::json!(self.body()).to_string();
        let mut response = (status, [(header::CONTENT_TYPE, PROBLEM_JSON)], text).into_response();
        response.extensions_mut().insert(RefusalKind(kind));
        if let Some(url) = self.elsewhere() {
            response.extensions_mut().insert(Elsewhere(url.into()));
        }
        let headers = response.headers_mut();
        if let Some(seconds) = retry_after_s {
            headers.insert(header::RETRY_AFTER, seconds.into());
        }
        if status == StatusCode::UNAUTHORIZED {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        // The rest of the body is not read, so the connection cannot take another request.
        if matches!(
            status,
            StatusCode::UNAUTHORIZED | StatusCode::REQUEST_TIMEOUT | StatusCode::PAYLOAD_TOO_LARGE
        ) {
            headers.insert(header::CONNECTION, HeaderValue::from_static("close"));
        }
        response
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
        check(HostingError::Thread(failure()), 500, "the server failed; its log says why");
        check(HostingError::UnknownEpisode { id: "x".into() }, 404, "POST /v1/episodes");
        check(HostingError::EpisodePanicked, 500, "its recording holds what went before; start another");
        check(HostingError::TooManyEpisodes { limit: 8 }, 429, "all 8 places for episodes are taken; finish");
        check(HostingError::TooManyWaiting { limit: 16 }, 429, "call again when");
        check(HostingError::ShuttingDown, 503, "try again");
        check(HostingError::EpisodeStopped, 410, "start another");
    }

    /// Returns the log output of `work`.
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

    /// MCP sends the body, and REST the whole response.
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
