//! The other operators at the moment, for one that asks.

use tandem_tools_spec::{ManageReply, ToolReply};

use super::Team;
use crate::hosting::Answer;

impl Team {
    /// Notes that the operator on `seat` has looked, and adds to a status what the others do.
    pub(super) fn looked(&self, seat: usize, answer: Answer) -> Answer {
        let mut round = self.round();
        round.has_looked(seat);
        match answer.reply {
            ToolReply::Manage(ManageReply::GetStatus(_)) => {
                Answer { presence: round.presence(seat), ..answer }
            }
            _ => answer,
        }
    }
}
