//! Refusals as callers read them over any protocol, and their form over HTTP: RFC 9457 problem details.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// An error for its caller. Each error enum provides a refusal for every variant; its text is the error's
/// text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// A stable name for the kind of problem, for example `unknown-robot`.
    pub kind: &'static str,
    /// The kind in words.
    pub title: &'static str,
    /// General kind, which a protocol maps to its own codes.
    pub class: RefusalClass,
    /// Seconds after which the same request may work; `None` if it would be refused again.
    pub retry_after_s: Option<u16>,
    /// Remedy, if the error's text does not state it.
    pub hint: Option<&'static str>,
}

/// Classes of refusals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RefusalClass {
    /// The request names something that does not exist.
    NotFound,
    /// The request can be parsed but is never valid.
    Invalid,
    /// The request conflicts with the present state.
    Conflict,
    /// The caller may not do this.
    Forbidden,
    /// The request names an object that no longer exists.
    Gone,
    /// The object of the request is on another server.
    Elsewhere,
    /// The caller requests more than the server has room for.
    TooMany,
    /// The server accepts no requests of this kind at present.
    Unavailable,
    /// The simulator failed, and the caller must be informed.
    Failed,
    /// A fault of the server, whose text is only for the server's log.
    Internal,
}

impl Refusal {
    /// A fault of the server.
    pub const INTERNAL: Refusal = Refusal::new("internal", "Internal error", RefusalClass::Internal);

    /// Returns a permanent refusal. The error's text states a valid call.
    pub const fn new(kind: &'static str, title: &'static str, class: RefusalClass) -> Refusal {
        Refusal { kind, title, class, retry_after_s: None, hint: None }
    }

    /// Returns this refusal for a request that may work after `retry_after_s` seconds.
    pub const fn retry_after_s(self, seconds: u16) -> Refusal {
        Refusal { retry_after_s: Some(seconds), ..self }
    }

    /// Returns this refusal with a remedy.
    pub const fn hint(self, hint: &'static str) -> Refusal {
        Refusal { hint: Some(hint), ..self }
    }
}

/// The body of every refusal: RFC 9457 problem details, served as `application/problem+json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ProblemBody {
    /// A stable name for the kind of problem, for example `urn:tandem:problem:unknown-robot`.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind in words; the same for all problems of one kind.
    pub title: String,
    /// The HTTP status.
    pub status: u16,
    /// Mistake in this call, and a valid call.
    pub detail: String,
    /// Cause of an incomplete recording; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording_failed: Option<String>,
    /// Result of the episode, as from finish, if its end is the cause of the refusal; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub result: Option<Value>,
}
