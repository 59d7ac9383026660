//! Answers as the operator of one robot is told them.

use tandem_tools_spec::{ManageReply, StopReason, ToolReply};

use crate::hosting::Answer;

/// The answer without what it says of other robots than `robot`.
pub fn of_own_robot(mut answer: Answer, robot: &str) -> Answer {
    match &mut answer.reply {
        ToolReply::Act(reply) => {
            reply.robots.retain(|report| report.robot == robot);
            reply.fallen.retain(|entry| entry.robot == robot);
        }
        ToolReply::Manage(ManageReply::GetStatus(status)) => {
            status.fallen.retain(|entry| entry.robot == robot)
        }
        // Looks are asked of the own robot alone, and a result is of all.
        ToolReply::Look(_) | ToolReply::Manage(ManageReply::Finish(_)) => {}
    }
    answer
}

/// The answer to a command of `asked_steps`, of which fewer were executed where a partner's was shorter.
pub fn cut_off(mut answer: Answer, asked_steps: u32) -> Answer {
    if let ToolReply::Act(reply) = &mut answer.reply
        && reply.stop_reason == StopReason::StepsDone
        && reply.executed_steps < asked_steps
    {
        reply.stop_reason = StopReason::PartnerDone;
    }
    answer
}
