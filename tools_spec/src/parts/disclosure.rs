//! What a policy is told about its own success.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What replies tell about phases, and whether success ends an episode.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Disclosure {
    /// Every reply tells the phases reached, and the last phase ends the episode.
    #[default]
    Live,
    /// Phases are told once the episode has ended, which it does not do by itself on success: call finish.
    End,
    /// Phases are never told, nor does success end the episode: call finish.
    Never,
}

impl Disclosure {
    /// Every kind.
    pub const ALL: [Disclosure; 3] = [Disclosure::Live, Disclosure::End, Disclosure::Never];

    /// The name that JSON, command lines and reports use.
    pub fn name(self) -> &'static str {
        match self {
            Disclosure::Live => "live",
            Disclosure::End => "end",
            Disclosure::Never => "never",
        }
    }

    /// Whether phases are told in an episode that has `ended` or goes on.
    pub fn tells(self, ended: bool) -> bool {
        match self {
            Disclosure::Live => true,
            Disclosure::End => ended,
            Disclosure::Never => false,
        }
    }

    /// Whether the last phase ends the episode.
    pub fn ends_on_success(self) -> bool {
        self == Disclosure::Live
    }
}

impl fmt::Display for Disclosure {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_has_the_same_names() {
        for disclosure in Disclosure::ALL {
            assert_eq!(serde_json::json!(disclosure), disclosure.name());
            assert_eq!(disclosure.to_string(), disclosure.name());
        }
    }
}
