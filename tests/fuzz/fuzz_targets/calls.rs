//! Fuzzes the arguments of every tool: a parsed call survives a round trip through JSON, and still passes
//! validation.
#![no_main]

use libfuzzer_sys::fuzz_target;
use serde_json::{Value, json};
use tandem_tools_spec::{EPISODE_TOOLS, StartEpisode, ToolCall, parse_args};

fuzz_target!(|bytes: &[u8]| {
    let Ok(args) = serde_json::from_slice::<Value>(bytes) else { return };
    for tool in EPISODE_TOOLS {
        if let Ok(call) = ToolCall::parse(tool, args.clone()) {
            assert_eq!(call.validate(), Ok(()));
            assert_eq!(ToolCall::parse(tool, json!(call)).as_ref(), Ok(&call));
        }
    }
    if let Ok(start) = parse_args::<StartEpisode>(args) {
        assert_eq!(parse_args::<StartEpisode>(json!(start)), Ok(start));
    }
});
