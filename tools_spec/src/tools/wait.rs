//! `wait`: lets time pass. `episodes/src/commands/wait.rs` carries it out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::parts::CommandReply;
use crate::tool::Tool;

/// Let all robots hold their targets for a number of control steps of 20 ms. The reply reports on every
/// robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wait {
    /// 1 up to the budget's steps_per_command.
    #[schemars(range(min = 1), extend("most_steps" = "maximum"))]
    pub steps: u32,
}

impl Tool for Wait {
    type Reply = CommandReply;
    const NAME: &'static str = "wait";
    const READ_ONLY: bool = false;

    fn example() -> Self {
        Wait { steps: 25 }
    }

    fn steps(&self) -> u32 {
        self.steps
    }

    fn validate(&self) -> Result<(), String> {
        checks::steps(self.steps)
    }
}
