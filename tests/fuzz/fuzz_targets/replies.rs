//! Fuzzes the replies of every tool that a client may receive. Each is parsed or refused.
#![no_main]

use libfuzzer_sys::fuzz_target;
use serde_json::{Value, json};
use tandem_tools_spec::ToolCall;

fuzz_target!(|bytes: &[u8]| {
    let Ok(reply) = serde_json::from_slice::<Value>(bytes) else { return };
    for call in ToolCall::examples() {
        if let Ok(read) = call.parse_reply(reply.clone()) {
            assert!(call.parse_reply(json!(read)).is_ok());
        }
    }
});
