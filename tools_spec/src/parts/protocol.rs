//! The two sets of rules.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The rules an episode is run under.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Protocol {
    /// For agents that think between commands: at most 25 steps a command, 6000 steps of which 300 are an initial hold,
    /// and 1800 s of the policy's own time.
    Agentic,
    /// For learned policies: at most 50 steps a command, and the task's own number of steps.
    Benchmark,
}

impl Protocol {
    /// Every protocol.
    pub const ALL: [Protocol; 2] = [Protocol::Agentic, Protocol::Benchmark];

    /// The name that JSON, command lines and reports use.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Agentic => "agentic",
            Protocol::Benchmark => "benchmark",
        }
    }
}

impl fmt::Display for Protocol {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_has_the_same_names() {
        for protocol in Protocol::ALL {
            assert_eq!(serde_json::json!(protocol), protocol.name());
            assert_eq!(protocol.to_string(), protocol.name());
        }
    }
}
