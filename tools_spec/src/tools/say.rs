//! `say`: messages between the operators of an episode, offered only if the episode was started with
//! messages. `gateway/src/hosting/team/` delivers them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::get_status::StatusReply;
use crate::tool::Tool;

/// Maximum number of characters of one message.
const MAX_CHARACTERS: usize = 500;

/// Say something to the operators of the other robots: at most 500 characters, which they hear with their
/// next reply. Costs no steps; physics stands still. Answers as get_status does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Say {
    /// The words, 1 to 500 characters.
    #[schemars(length(min = 1, max = MAX_CHARACTERS))]
    pub text: String,
}

impl Tool for Say {
    type Reply = StatusReply;
    const NAME: &'static str = "say";
    const READ_ONLY: bool = false;

    fn example() -> Self {
        Say { text: "I hold the bottle in front of you; take it by its upper half.".into() }
    }

    fn validate(&self) -> Result<(), String> {
        match self.text.chars().count() {
            0 => Err("text is empty; give 1 to 500 characters".into()),
            count if count > MAX_CHARACTERS => {
                Err(format!("text has {count} characters; give at most {MAX_CHARACTERS}"))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_few() {
        let says = |text: String| Say { text }.validate();
        assert!(says("ü".repeat(500)).is_ok() && Say::example().validate().is_ok());
        assert!(says("ü".repeat(501)).unwrap_err().contains("501"));
        assert!(says(String::new()).is_err());
    }
}
