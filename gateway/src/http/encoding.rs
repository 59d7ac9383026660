//! JSON and MessagePack: the formats of request bodies and replies.

use axum::{
    extract::FromRequestParts,
    http::{HeaderMap, StatusCode, header, request::Parts},
    response::{IntoResponse, Response},
};
use serde::Serialize;
use serde_json::Value;

use super::{
    body::{json_object, msgpack_object},
    problem::ApiError,
};

/// Media types of MessagePack: the registered type and an older type.
const MSGPACK: [&str; 2] = ["application/msgpack", "application/x-msgpack"];

/// Formats of a request's body and of its reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Encoding {
    body: BodyFormat,
    reply: BodyFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BodyFormat {
    Json,
    Msgpack,
}

/// Returns true if bodies of this media type can be read.
pub fn is_read(content_type: &str) -> bool {
    is(content_type, "application/json") || is_msgpack(content_type)
}

fn is_msgpack(content_type: &str) -> bool {
    MSGPACK.iter().any(|name| is(content_type, name))
}

fn is(content_type: &str, name: &str) -> bool {
    let essence = content_type.split(';').next().unwrap_or_default().trim();
    essence.eq_ignore_ascii_case(name)
}

impl Encoding {
    fn from_headers(headers: &HeaderMap) -> Encoding {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok()).unwrap_or_default();
        let format = |msgpack: bool| if msgpack { BodyFormat::Msgpack } else { BodyFormat::Json };
        let body = format(is_msgpack(text(header::CONTENT_TYPE)));
        // A caller that accepts both gets its reply in the format of its request.
        let accepted = text(header::ACCEPT);
        let (json, msgpack) = accepted.split(',').fold((false, false), |(json, msgpack), one| {
            (json || is(one, "application/json"), msgpack || is_msgpack(one))
        });
        let reply = if json == msgpack { body } else { format(msgpack) };
        Encoding { body, reply }
    }

    /// Parses a body. An empty body is an object without fields.
    pub fn read(self, body: &[u8]) -> Result<Value, ApiError> {
        match self.body {
            BodyFormat::Json => json_object(body),
            BodyFormat::Msgpack => msgpack_object(body),
        }
    }

    /// Serializes a reply.
    pub fn write(self, status: StatusCode, reply: &impl Serialize) -> Result<Response, ApiError> {
        let (kind, bytes) = match self.reply {
            BodyFormat::Json => (
                "application/json",
                serde_json::to_vec(reply).map_err(|error| ApiError::Reply(error.into()))?,
            ),
            BodyFormat::Msgpack => {
                (MSGPACK[0], rmp_serde::to_vec_named(reply).map_err(|error| ApiError::Reply(error.into()))?)
            }
        };
        Ok((status, [(header::CONTENT_TYPE, kind)], bytes).into_response())
    }
}

impl<S: Sync> FromRequestParts<S> for Encoding {
    type Rejection = std::convert::Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Encoding, Self::Rejection> {
        Ok(Encoding::from_headers(&parts.headers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replies_come_as_they_are_wanted() {
        let check = |content_type: &str, accept: &str, expected: [BodyFormat; 2]| {
            let mut headers = HeaderMap::new();
            for (name, value) in [(header::CONTENT_TYPE, content_type), (header::ACCEPT, accept)] {
                if !value.is_empty() {
                    headers.insert(name, value.parse().unwrap());
                }
            }
            let [body, reply] = expected;
            assert_eq!(
                Encoding::from_headers(&headers),
                Encoding { body, reply },
                "{content_type}, {accept}"
            );
        };
        let (json, msgpack) = ("application/json", "application/msgpack");
        check("", "", [BodyFormat::Json, BodyFormat::Json]);
        check(json, "*/*", [BodyFormat::Json, BodyFormat::Json]);
        check(msgpack, "", [BodyFormat::Msgpack, BodyFormat::Msgpack]);
        check("application/x-msgpack", "*/*", [BodyFormat::Msgpack, BodyFormat::Msgpack]);
        check(json, "application/MsgPack;q=1", [BodyFormat::Json, BodyFormat::Msgpack]);
        check(msgpack, json, [BodyFormat::Msgpack, BodyFormat::Json]);
        check(msgpack, "application/json, application/msgpack", [BodyFormat::Msgpack, BodyFormat::Msgpack]);
        check(json, "application/json, text/event-stream", [BodyFormat::Json, BodyFormat::Json]);
    }

    #[test]
    fn bytes_are_bytes_in_msgpack_and_base64_in_json() {
        use tandem_tools_spec::{Bytes, CameraArrays};
        let arrays = CameraArrays {
            robot: "A".into(),
            rgb: Some(Bytes(vec![1, 2])),
            depth_float16: None,
            depth_png16: None,
        };
        assert_eq!(serde_json::to_string(&arrays).unwrap(), r#"{"robot":"A","rgb":"AQI="}"#);
        let packed = rmp_serde::to_vec_named(&arrays).unwrap();
        assert_eq!(packed, b"\x82\xa5robot\xa1A\xa3rgb\xc4\x02\x01\x02");
    }
}
