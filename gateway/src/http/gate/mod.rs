//! Checks of every request before its route: limits, token, host and media type of the body.
//!
//! The media type is checked because pages in browsers cannot send JSON without a preflight request.

pub mod connections;
mod hosts;
pub mod limits;
pub mod tokens;
mod waiting;

use std::{net::IpAddr, sync::Arc};

use axum::{
    body::{Body, Bytes},
    extract::{Request, State},
    http::{HeaderMap, header},
    middleware::Next,
    response::{IntoResponse, Response},
};
use http_body_util::BodyExt;
use tokio::time::timeout;

use crate::{
    http::{encoding, problem::ApiError},
    settings::Settings,
};
use hosts::OwnHosts;

/// Factor on the body limit up to which an oversized body is read and discarded. A client that is still
/// sending when the connection closes would never see the answer.
const DRAINED_LIMITS: usize = 16;

/// Allowed hosts, and limits on the size and duration of bodies.
#[derive(Debug, Clone)]
pub struct Gate {
    settings: Arc<Settings>,
    hosts: OwnHosts,
}

impl Gate {
    /// Creates the gate of a server that is bound to `address`.
    pub fn new(settings: Arc<Settings>, address: IpAddr) -> Gate {
        Gate { hosts: OwnHosts::new(settings.clone(), address), settings }
    }
}

/// Admits a request with its whole body, or answers with the refusal.
pub async fn pass(State(gate): State<Gate>, request: Request, next: Next) -> Response {
    match admit(&gate, request).await {
        Ok(request) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    }
}

async fn admit(gate: &Gate, request: Request) -> Result<Request, ApiError> {
    let (parts, body) = request.into_parts();
    gate.hosts.check(&parts.headers, &parts.uri)?;
    let (limit, limit_bytes) = (gate.settings.request_timeout, gate.settings.max_body_bytes);
    let received = timeout(limit, read_body(body, limit_bytes)).await;
    let bytes = received.map_err(|_| ApiError::SlowBody { limit })??;
    check_content_type(&parts.headers, &bytes)?;
    Ok(Request::from_parts(parts, bytes.into()))
}

async fn read_body(mut body: Body, limit_bytes: usize) -> Result<Bytes, ApiError> {
    let mut kept = Vec::new();
    let mut seen_bytes = 0;
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|error| ApiError::BrokenBody(error.to_string()))?;
        let Some(data) = frame.data_ref() else { continue };
        seen_bytes += data.len();
        if seen_bytes <= limit_bytes {
            kept.extend_from_slice(data);
        } else if seen_bytes > limit_bytes.saturating_mul(DRAINED_LIMITS) {
            break;
        }
    }
    if seen_bytes > limit_bytes {
        return Err(ApiError::BodyTooLarge { limit_bytes });
    }
    Ok(kept.into())
}

/// Refuses a body whose content type is neither JSON nor MessagePack. An empty body needs no content
/// type.
fn check_content_type(headers: &HeaderMap, body: &[u8]) -> Result<(), ApiError> {
    let text = match headers.get(header::CONTENT_TYPE) {
        None if body.is_empty() => return Ok(()),
        None => "",
        Some(value) => value.to_str().unwrap_or("no text"),
    };
    if encoding::is_read(text) {
        return Ok(());
    }
    Err(ApiError::ContentType(text.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_types() {
        let accepted = |text: Option<&str>, body: &[u8]| {
            let mut headers = HeaderMap::new();
            text.map(|text| headers.insert(header::CONTENT_TYPE, text.parse().unwrap()));
            check_content_type(&headers, body).is_ok()
        };
        assert!(accepted(None, b"") && !accepted(None, b"{}"));
        for text in ["application/json", "Application/JSON; charset=utf-8", "application/msgpack"] {
            assert!(accepted(Some(text), b"{}") && accepted(Some(text), b""), "{text}");
        }
        for text in ["application/x-www-form-urlencoded", "text/plain", "text/json", "application/jsonp", ""]
        {
            assert!(!accepted(Some(text), b"{}") && !accepted(Some(text), b""), "{text}");
        }
    }
}
