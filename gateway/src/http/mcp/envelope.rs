//! Validation of the JSON-RPC 2.0 message around a call over MCP, with the error codes of JSON-RPC.
//!
//! The MCP library would mistake some invalid messages for unknown requests, and would answer others without
//! JSON.

use axum::{
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use serde_json::{Map, Value, json};

const PARSE_ERROR: i32 = -32700;
const INVALID_REQUEST: i32 = -32600;
const INVALID_PARAMS: i32 = -32602;

/// Reason why a body is not a JSON-RPC message.
#[derive(Debug)]
pub struct RpcError {
    code: i32,
    message: String,
    /// Id of the request, a string or a number, if it could be read.
    id: Option<Value>,
}

impl IntoResponse for RpcError {
    fn into_response(self) -> Response {
        let mut answer = json!({ "jsonrpc": "2.0", "error": { "code": self.code, "message": self.message } });
        if let Some(id) = self.id {
            answer["id"] = id;
        }
        let headers = [(header::CONTENT_TYPE, "application/json")];
        (StatusCode::BAD_REQUEST, headers, answer.to_string()).into_response()
    }
}

/// Checks that a body is one message, and that tool calls and prompt requests name their target.
pub fn check(body: &[u8]) -> Result<(), RpcError> {
    let refuse = |code: i32, id: Option<&Value>, message: &str| {
        Err(RpcError { code, message: message.into(), id: id.cloned() })
    };
    let message: Value = match serde_json::from_slice(body) {
        Ok(message) => message,
        Err(error) => return refuse(PARSE_ERROR, None, &format!("the body is no JSON: {error}")),
    };
    let Value::Object(message) = message else {
        return refuse(INVALID_REQUEST, None, "send one JSON object per request; batches are not taken");
    };
    let id = message.get("id").filter(|id| id.is_string() || id.is_i64() || id.is_u64());
    if message.contains_key("id") && id.is_none() {
        return refuse(INVALID_REQUEST, None, "id has to be a text or an integer");
    }
    if message.get("jsonrpc").is_none_or(|version| version != "2.0") {
        return refuse(INVALID_REQUEST, id, "jsonrpc has to be \"2.0\"");
    }
    match message.get("method") {
        Some(Value::String(method)) => check_params(method, message.get("params"))
            .map_err(|message| RpcError { code: INVALID_PARAMS, message, id: id.cloned() }),
        // The client answers a request of the server.
        None if message.contains_key("result") || message.contains_key("error") => Ok(()),
        _ => refuse(INVALID_REQUEST, id, "method has to be a text, for example \"tools/call\""),
    }
}

/// Checks the parameters of `method`. The error describes what is wrong.
fn check_params(method: &str, params: Option<&Value>) -> Result<(), String> {
    let none = Map::new();
    let params = match params {
        None => &none,
        Some(Value::Object(params)) => params,
        Some(_) => return Err("params has to be an object".into()),
    };
    if !matches!(method, "tools/call" | "prompts/get") {
        return Ok(());
    }
    if !params.get("name").is_some_and(Value::is_string) {
        return Err(format!("{method} needs params.name, a text"));
    }
    match params.get("arguments") {
        None | Some(Value::Object(_)) => Ok(()),
        Some(_) => Err("params.arguments has to be an object".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistakes_have_the_codes_of_json_rpc() {
        let check = |body: &str, expected: Option<(i32, Option<Value>)>| {
            let found = super::check(body.as_bytes()).err().map(|error| (error.code, error.id));
            assert_eq!(found, expected, "{body}");
        };
        let refused = |code: i32| Some((code, None));
        let of_request = |code: i32, id: Value| Some((code, Some(id)));
        check(r#"{"jsonrpc": "2.0", "id": 1, "method": "tools/list"}"#, None);
        check(r#"{"jsonrpc": "2.0", "method": "notifications/initialized"}"#, None);
        check(r#"{"jsonrpc": "2.0", "id": 1, "result": {}}"#, None);
        check(r#"{"jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": {"name": "wait"}}"#, None);
        check("", refused(PARSE_ERROR));
        check("{", refused(PARSE_ERROR));
        check(r#"[{"jsonrpc": "2.0", "id": 1, "method": "ping"}]"#, refused(INVALID_REQUEST));
        check(r#"{"jsonrpc": "2.0", "id": null, "method": "ping"}"#, refused(INVALID_REQUEST));
        check(r#"{"jsonrpc": "2.0", "id": 1.5, "method": "ping"}"#, refused(INVALID_REQUEST));
        check(r#"{"id": "a", "method": "ping"}"#, of_request(INVALID_REQUEST, json!("a")));
        check(r#"{"jsonrpc": "2.0", "id": 7}"#, of_request(INVALID_REQUEST, json!(7)));
        check(r#"{"jsonrpc": "2.0", "id": 7, "method": 5}"#, of_request(INVALID_REQUEST, json!(7)));
        let call = |params: &str| {
            format!(r#"{{"jsonrpc": "2.0", "id": 7, "method": "tools/call", "params": {params}}}"#)
        };
        for params in ["[]", "{}", r#"{"name": 5}"#, r#"{"name": "wait", "arguments": [5]}"#] {
            check(&call(params), of_request(INVALID_PARAMS, json!(7)));
        }
    }
}
