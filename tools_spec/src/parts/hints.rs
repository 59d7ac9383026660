//! Whether a policy is told how to grasp.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What texts say besides geometry.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Hints {
    /// How to grasp: finger angles, ways to come near, orders of closing.
    #[default]
    On,
    /// Nothing.
    Off,
}

impl Hints {
    /// Both.
    pub const ALL: [Hints; 2] = [Hints::On, Hints::Off];

    /// The name that JSON, command lines and reports use.
    pub fn name(self) -> &'static str {
        match self {
            Hints::On => "on",
            Hints::Off => "off",
        }
    }
}

impl fmt::Display for Hints {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_has_the_same_names() {
        for hints in Hints::ALL {
            assert_eq!(serde_json::json!(hints), hints.name());
            assert_eq!(hints.to_string(), hints.name());
        }
    }
}
