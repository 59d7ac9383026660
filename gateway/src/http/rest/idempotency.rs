//! The header `Idempotency-Key`, which allows a request to be repeated without being executed twice.

use axum::{
    extract::FromRequestParts,
    http::{HeaderValue, request::Parts},
    response::Response,
};

use crate::http::problem::ApiError;

const KEY: &str = "idempotency-key";
const REPLAYED: &str = "idempotency-replayed";

/// Maximum length of a key in bytes.
const LONGEST: usize = 255;

/// Key of a request, if it has one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IdempotencyKey(pub Option<String>);

impl<S: Sync> FromRequestParts<S> for IdempotencyKey {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<IdempotencyKey, ApiError> {
        parts.headers.get(KEY).map(read).transpose().map(IdempotencyKey)
    }
}

fn read(value: &HeaderValue) -> Result<String, ApiError> {
    let text = value.to_str().map_err(|_| ApiError::Key)?;
    match (1..=LONGEST).contains(&text.len()) {
        true => Ok(text.into()),
        false => Err(ApiError::Key),
    }
}

/// Marks a reply that an earlier request with the same key has received.
pub fn mark_replayed(mut response: Response, replayed: bool) -> Response {
    if replayed {
        response.headers_mut().insert(REPLAYED, HeaderValue::from_static("true"));
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_short_texts() {
        let long = "x".repeat(LONGEST + 1);
        for (value, accepted) in [
            (&b"8e03978e-40d5"[..], true),
            (b"a b", true),
            (b"", false),
            (long.as_bytes(), false),
            (b"\xff", false),
        ] {
            assert_eq!(read(&HeaderValue::from_bytes(value).unwrap()).is_ok(), accepted, "{value:?}");
        }
    }
}
