//! What every request has to pass before a route sees it. Browsers let any web page send requests to this machine; what keeps
//! pages out is that they cannot forge `Host` and `Origin`, nor call a body JSON without asking first.

pub mod connections;
pub mod limits;
pub mod tokens;

use std::{net::IpAddr, sync::Arc};

use axum::{
    body::{Body, Bytes},
    extract::{Request, State},
    http::{HeaderMap, Uri, header, uri::Authority},
    middleware::Next,
    response::{IntoResponse, Response},
};
use http_body_util::BodyExt;
use tokio::time::timeout;

use crate::{
    http::{encoding, problem::ApiError},
    settings::Settings,
};

/// A body beyond the limit is read and thrown away up to this many times the limit, because a client that is still
/// sending when the connection closes never sees the answer.
const DRAINED_LIMITS: usize = 16;

/// Who may come in, and how much they may bring.
#[derive(Debug, Clone)]
pub struct Gate {
    settings: Arc<Settings>,
    /// The address that the server is bound to.
    address: IpAddr,
}

impl Gate {
    /// The gate of a server that is bound to `address`.
    pub fn new(settings: Arc<Settings>, address: IpAddr) -> Gate {
        Gate { settings, address }
    }

    fn admit(&self, headers: &HeaderMap, uri: &Uri) -> Result<(), ApiError> {
        let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("no text"));
        let host = text(header::HOST).or(uri.authority().map(Authority::as_str)).unwrap_or_default();
        if !self.is_ours(host) {
            return Err(ApiError::ForeignHost(host.into()));
        }
        // Other programs send no Origin; a browser's says from which page the request comes.
        match text(header::ORIGIN) {
            Some(origin) if !is_same(origin, host) => Err(ApiError::ForeignOrigin(origin.into())),
            _ => Ok(()),
        }
    }

    /// Whether `host`, with or without a port, is a name of this server. A page that has its own name point here is refused;
    /// an address cannot be made to point elsewhere, so where we listen to all of them, each is fine.
    fn is_ours(&self, host: &str) -> bool {
        let Ok(authority) = host.parse::<Authority>() else { return false };
        let name = authority.host().trim_start_matches('[').trim_end_matches(']');
        if let Ok(address) = name.parse::<IpAddr>() {
            return address.is_loopback() || address == self.address || self.address.is_unspecified();
        }
        let allowed = self.settings.allowed_hosts.iter().map(String::as_str);
        allowed.chain(["localhost"]).any(|allowed| allowed.eq_ignore_ascii_case(name))
    }
}

/// Whether a page of `origin` came from `host` itself.
fn is_same(origin: &str, host: &str) -> bool {
    let authority = ["http://", "https://"].iter().find_map(|scheme| origin.strip_prefix(scheme));
    authority.is_some_and(|authority| authority.eq_ignore_ascii_case(host))
}

/// Lets a request in with its whole body, or answers why not.
pub async fn pass(State(gate): State<Gate>, request: Request, next: Next) -> Response {
    match arrived(&gate, request).await {
        Ok(request) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    }
}

async fn arrived(gate: &Gate, request: Request) -> Result<Request, ApiError> {
    let (parts, body) = request.into_parts();
    gate.admit(&parts.headers, &parts.uri)?;
    let (limit, limit_bytes) = (gate.settings.request_timeout, gate.settings.max_body_bytes);
    let received = timeout(limit, received(body, limit_bytes)).await;
    let bytes = received.map_err(|_| ApiError::SlowBody { limit })??;
    check_content_type(&parts.headers, &bytes)?;
    Ok(Request::from_parts(parts, bytes.into()))
}

async fn received(mut body: Body, limit_bytes: usize) -> Result<Bytes, ApiError> {
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

/// A body has to be called JSON or MessagePack. Where there is none, nothing has to be said about it.
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
    use crate::settings::Layer;

    fn gate(address: &str) -> Gate {
        let flags = Layer { allowed_host: Some(vec!["lab.example".into()]), ..Layer::default() };
        Gate::new(Settings::resolve(flags, None).unwrap(), address.parse().unwrap())
    }

    #[test]
    fn hosts() {
        let check = |address: &str, ours: &[&str], foreign: &[&str]| {
            let gate = gate(address);
            ours.iter().for_each(|host| assert!(gate.is_ours(host), "{address}: {host}"));
            foreign.iter().for_each(|host| assert!(!gate.is_ours(host), "{address}: {host}"));
        };
        let always =
            ["localhost", "LOCALHOST:8700", "127.0.0.1:1", "[::1]:8700", "lab.example", "Lab.Example:80"];
        let never = [
            "",
            "evil.example",
            "localhost.evil.example",
            "evil.lab.example",
            "a b",
            "127.0.0.1.evil.example",
        ];
        for address in ["127.0.0.1", "::1", "10.0.0.5", "0.0.0.0", "::"] {
            check(address, &always, &never);
        }
        check("127.0.0.1", &[], &["10.0.0.5:8700", "[fe80::1]"]);
        check("10.0.0.5", &["10.0.0.5:8700"], &["10.0.0.6:8700"]);
        check("0.0.0.0", &["10.0.0.5:8700", "[fe80::1]:8700"], &[]);
    }

    #[test]
    fn origins() {
        let check = |origin: &str, host: &str, expected: bool| {
            assert_eq!(is_same(origin, host), expected, "{origin} at {host}");
        };
        check("http://localhost:8700", "localhost:8700", true);
        check("https://Lab.Example", "lab.example", true);
        check("http://localhost:3000", "localhost:8700", false);
        check("http://localhost:8700.evil.example", "localhost:8700", false);
        check("http://evil.example", "localhost:8700", false);
        check("file://", "", false);
        check("null", "null", false);
    }

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
