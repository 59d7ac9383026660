//! The `/act` protocol: each request is one POST of JSON, with arrays in the format of the Python package
//! `json_numpy`.

use std::{io, time::Duration};

use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::{Value, json};
use ureq::{Agent, Timeout, http::Response};

use super::{PolicyAddress, PolicyClient, PolicyKey, encryption::for_requests};
use crate::{
    error::{RemoteError, gist},
    values::{ReplyValue, RequestValue},
};

/// URL schemes of `/act` servers; the encrypted one is last.
pub const SCHEMES: [&str; 2] = ["http://", "https://"];

/// Authorization scheme of the key.
const KEY_SCHEME: &str = "Bearer";

/// Maximum size of an answer in bytes.
const LARGEST_ANSWER_BYTES: u64 = 64 << 20;

/// Client of the policy at one address.
pub struct Act {
    url: String,
    key: Option<PolicyKey>,
    agent: Agent,
    /// Time limit for finding the server; `None` after the server has been found.
    connect_within: Option<Duration>,
}

impl Act {
    pub fn new(address: &PolicyAddress, connect_within: Duration) -> Act {
        // Redirects are refused, so that only the named address receives requests.
        let mut config = Agent::config_builder().http_status_as_error(false).max_redirects(0);
        if address.is_encrypted() {
            config = config.tls_config(for_requests());
        }
        if address.is_loopback() {
            config = config.proxy(None);
        }
        let agent = config.build().new_agent();
        let (url, key) = (address.url.clone(), address.key.clone());
        Act { url, key, agent, connect_within: Some(connect_within) }
    }

    fn post(&self, body: String, within: Duration) -> Result<Response<ureq::Body>, ureq::Error> {
        let config = self.agent.post(&self.url).config().timeout_global(Some(within));
        let config = config.timeout_resolve(self.connect_within).timeout_connect(self.connect_within);
        let mut request = config.build().header("content-type", "application/json");
        if let Some(key) = &self.key {
            request = request.header("authorization", key.authorization(KEY_SCHEME));
        }
        request.send(body)
    }

    fn failed(&self, error: ureq::Error, within: Duration) -> RemoteError {
        let (url, reason) = (self.url.clone(), error.to_string());
        match error {
            ureq::Error::Timeout(Timeout::Connect | Timeout::Resolve)
            | ureq::Error::ConnectionFailed
            | ureq::Error::HostNotFound => RemoteError::Unreachable { url, reason },
            ureq::Error::Timeout(_) => RemoteError::Slow { url, within },
            ureq::Error::Io(error) if is_unreachable(&error) => RemoteError::Unreachable { url, reason },
            _ => RemoteError::Gone { url, reason },
        }
    }
}

/// Returns true if the server could not be reached.
fn is_unreachable(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionRefused
            | io::ErrorKind::HostUnreachable
            | io::ErrorKind::NetworkUnreachable
            | io::ErrorKind::AddrNotAvailable
    )
}

impl PolicyClient for Act {
    fn ask(&mut self, request: &RequestValue, within: Duration) -> Result<ReplyValue, RemoteError> {
        let body = to_json(request).to_string();
        let mut response = self.post(body, within).map_err(|error| self.failed(error, within))?;
        self.connect_within = None;
        let status = response.status();
        if status.is_redirection() {
            let place = response.headers().get("location").and_then(|place| place.to_str().ok());
            let text = format!(
                "{status}: it sends elsewhere, to {:?}, which is not followed; name that address in --policy",
                gist(place.unwrap_or_default())
            );
            return Err(RemoteError::Failed { url: self.url.clone(), text });
        }
        let read = response.body_mut().with_config().limit(LARGEST_ANSWER_BYTES).read_to_string();
        let text = read.map_err(|error| self.failed(error, within))?;
        if !status.is_success() {
            let text = format!("{status}: {}", gist(&text));
            return Err(RemoteError::Failed { url: self.url.clone(), text });
        }
        let no_json = |error: serde_json::Error| {
            format!("expected JSON; came, with status {status}, {:?}: {error}", gist(&text))
        };
        let reply = serde_json::from_str(&text).map_err(no_json).and_then(from_json);
        reply.map_err(|reason| RemoteError::Unreadable { url: self.url.clone(), reason })
    }

    /// Does nothing, because requests are independent.
    fn begin_trial(&mut self, _within: Duration) -> Result<(), RemoteError> {
        Ok(())
    }

    fn keep_alive(&mut self) {}
}

/// Converts a request to JSON. Arrays have the format of `json_numpy`: `{"__numpy__": base64, "dtype": "<f4",
/// "shape": [2, 3]}`.
fn to_json(request: &RequestValue) -> Value {
    match request {
        RequestValue::Map(entries) => {
            entries.iter().map(|(key, request)| (key.clone(), to_json(request))).collect()
        }
        RequestValue::Array(array) => json!({
            "__numpy__": BASE64_STANDARD.encode(array.bytes()),
            "dtype": array.dtype(),
            "shape": array.shape,
        }),
        RequestValue::Text(text) => json!(text),
        RequestValue::List(items) => items.iter().map(to_json).collect(),
    }
}

/// Parses JSON. Lists of numbers also become arrays.
fn from_json(value: Value) -> Result<ReplyValue, String> {
    match value {
        Value::Object(object) if object.contains_key("__numpy__") => {
            let text = |key: &str| object.get(key).and_then(Value::as_str).unwrap_or_default();
            let shape = object.get("shape").cloned().unwrap_or_default();
            let shape = serde_json::from_value(shape).map_err(|_| "an array without a shape".to_owned())?;
            let bytes = BASE64_STANDARD.decode(text("__numpy__")).map_err(|error| error.to_string())?;
            ReplyValue::from_bytes(text("dtype"), shape, &bytes)
        }
        Value::Object(object) => {
            let entries = object.into_iter().map(|(key, value)| Ok((key, from_json(value)?)));
            entries.collect::<Result<_, String>>().map(ReplyValue::Map)
        }
        Value::Array(items) => {
            items.into_iter().map(from_json).collect::<Result<_, _>>().map(ReplyValue::list)
        }
        // Python writes NaN, which is not JSON; other writers use `null` for it.
        Value::Null => Ok(ReplyValue::number(f64::NAN)),
        Value::Number(number) => Ok(ReplyValue::number(number.as_f64().unwrap_or(f64::NAN))),
        Value::String(text) => Ok(ReplyValue::Text(text)),
        Value::Bool(value) => Ok(ReplyValue::Other(value.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::{Array, Elements};

    #[test]
    fn arrays_are_written_and_read_as_json_numpy_does() {
        let array = Array { shape: vec![1, 2], elements: Elements::Floats(vec![1.5, -2.0]) };
        let request = RequestValue::Map(vec![
            ("x".into(), RequestValue::Array(array)),
            ("y".into(), RequestValue::List(vec![RequestValue::Text("z".into())])),
        ]);
        let value = to_json(&request);
        // json_numpy.dumps(np.float32([[1.5, -2]]))
        let known = json!({ "__numpy__": "AADAPwAAAMA=", "dtype": "<f4", "shape": [1, 2] });
        assert_eq!(value, json!({ "x": known, "y": ["z"] }));
        let reply = ReplyValue::Array { shape: vec![1, 2], values: vec![1.5, -2.0] };
        assert_eq!(from_json(known), Ok(reply.clone()));
        assert_eq!(from_json(json!([[1.5, -2]])), Ok(reply));
    }

    #[test]
    fn nobody_and_somebody_slow_are_told_apart() {
        let within = Duration::from_secs(1);
        let address = PolicyAddress { url: "http://there".into(), key: None };
        let failed = |error: ureq::Error| Act::new(&address, within).failed(error, within);
        for kind in [
            io::ErrorKind::ConnectionRefused,
            io::ErrorKind::HostUnreachable,
            io::ErrorKind::NetworkUnreachable,
            io::ErrorKind::AddrNotAvailable,
        ] {
            let error = failed(ureq::Error::Io(kind.into()));
            assert!(matches!(error, RemoteError::Unreachable { .. }), "{kind}: {error}");
        }
        for timeout in [Timeout::Connect, Timeout::Resolve] {
            let error = failed(ureq::Error::Timeout(timeout));
            assert!(matches!(error, RemoteError::Unreachable { .. }), "{timeout:?}: {error}");
        }
        let error = failed(ureq::Error::Timeout(Timeout::Global));
        assert!(matches!(error, RemoteError::Slow { .. }), "{error}");
        let error = failed(ureq::Error::Io(io::ErrorKind::ConnectionReset.into()));
        assert!(matches!(error, RemoteError::Gone { .. }), "{error}");
    }

    #[test]
    fn what_is_no_array_is_told_in_words() {
        let check = |value: Value, says: &str| {
            let reply = from_json(value).map_or_else(|error| error, |reply| reply.describe());
            assert!(reply.contains(says), "{reply}");
        };
        check(json!("error"), "the text \"error\"");
        check(json!([1, "a"]), "a list of 2");
        check(json!({ "__numpy__": "AADAPw==", "dtype": "<f2", "shape": [2] }), "dtype \"<f2\"");
        check(json!({ "__numpy__": "AADAPw==", "dtype": "<f4" }), "without a shape");
        check(json!({ "__numpy__": 7, "dtype": "<f4", "shape": [1] }), "shape [1] with 0");
        check(json!({ "__numpy__": "?", "dtype": "<f4", "shape": [1] }), "Invalid");
    }
}
