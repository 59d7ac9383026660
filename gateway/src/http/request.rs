//! Reads request bodies: of bounded size, JSON, and with a content type that says so.

use axum::{
    body::{Body, Bytes},
    extract::Request,
    http::{HeaderMap, header},
};
use serde_json::Value;

use super::problem::ApiError;

/// A body beyond the limit is read and thrown away up to this many times the limit, because a client that is still
/// sending when the connection closes never sees the answer.
const DRAINED_LIMITS: usize = 16;

/// Reads the JSON body of `request`; an empty body is `null`.
pub async fn json_body(request: Request, limit_bytes: usize) -> Result<Value, ApiError> {
    let (parts, body) = request.into_parts();
    let bytes = bounded(body, limit_bytes).await?;
    if bytes.is_empty() {
        return Ok(Value::Null);
    }
    check_content_type(&parts.headers)?;
    serde_json::from_slice(&bytes).map_err(|error| ApiError::MalformedJson(error.to_string()))
}

async fn bounded(body: Body, limit_bytes: usize) -> Result<Bytes, ApiError> {
    use http_body_util::BodyExt;
    let mut body = body;
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

fn check_content_type(headers: &HeaderMap) -> Result<(), ApiError> {
    let Some(value) = headers.get(header::CONTENT_TYPE) else {
        return Ok(());
    };
    let text = value.to_str().unwrap_or_default();
    let essence = text.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    if essence == "application/json" || (essence.starts_with("application/") && essence.ends_with("+json")) {
        return Ok(());
    }
    Err(ApiError::ContentType(text.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_types() {
        let accepted = |text: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(header::CONTENT_TYPE, text.parse().unwrap());
            check_content_type(&headers).is_ok()
        };
        assert!(check_content_type(&HeaderMap::new()).is_ok());
        assert!(accepted("application/json"));
        assert!(accepted("Application/JSON; charset=utf-8"));
        assert!(accepted("application/vnd.tandem+json"));
        assert!(!accepted("application/x-www-form-urlencoded"));
        assert!(!accepted("text/json"));
        assert!(!accepted(""));
    }
}
