//! What a call on an episode is answered with, and one that was refused on its way there.

use serde::Serialize;
use tandem_episodes::{CallReply, Session};
use tandem_tools_spec::{Call, Heard, ManageReply, Observation, Partner, StopReason, TalkReply, ToolReply};

/// A tool's reply, and what has to be said with every reply.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// The reply.
    #[serde(flatten)]
    pub reply: ToolReply,
    /// Control steps executed so far, the initial hold included: what a caller may expect the episode to stand at. Left out of a
    /// result, which says it itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<u32>,
    /// What was seen after a command that asked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observation: Option<Observation>,
    /// What the robots of the other operators did meanwhile.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub partners: Vec<Partner>,
    /// What the other operators have said.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub heard: Vec<Heard>,
    /// Why the recording is not complete; left out where it is, and where the reply itself says it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recording_failed: Option<String>,
    /// Whether the operator has left an episode that others still play: its end is not known yet.
    #[serde(skip)]
    pub others_play_on: bool,
}

impl Answer {
    /// The answer of `session` with `reply`.
    pub fn new(reply: CallReply, session: &Session) -> Answer {
        let CallReply { reply, observation } = reply;
        let is_result = matches!(reply, ToolReply::Manage(ManageReply::Finish(_)));
        let failed = session.recording_failed().filter(|_| !is_result);
        Answer {
            reply,
            step: (!is_result).then(|| session.env_steps()),
            observation,
            partners: Vec::new(),
            heard: Vec::new(),
            recording_failed: failed.map(str::to_owned),
            others_play_on: false,
        }
    }

    /// The answer without what it says of other robots than `robot`.
    pub fn of_own_robot(mut self, robot: &str) -> Answer {
        match &mut self.reply {
            ToolReply::Act(reply) => {
                reply.robots.retain(|report| report.robot == robot);
                reply.fallen.retain(|entry| entry.robot == robot);
            }
            ToolReply::Manage(ManageReply::GetStatus(status)) | ToolReply::Talk(TalkReply::Say(status)) => {
                status.fallen.retain(|entry| entry.robot == robot)
            }
            // Looks are asked of the own robot alone, a plan's commands are answered so already, and a result is of all.
            ToolReply::Look(_) | ToolReply::Plan(_) | ToolReply::Manage(ManageReply::Finish(_)) => {}
        }
        self
    }

    /// The control steps of a command that was cut off by a partner's.
    pub fn cut_off_steps(&self) -> Option<u32> {
        match &self.reply {
            ToolReply::Act(reply) if reply.stop_reason == StopReason::PartnerDone => {
                Some(reply.executed_steps)
            }
            ToolReply::Act(_)
            | ToolReply::Look(_)
            | ToolReply::Plan(_)
            | ToolReply::Manage(_)
            | ToolReply::Talk(_) => None,
        }
    }

    /// The answer to a whole command, to whose last part this is one.
    pub fn after(mut self, steps_before: u32, heard_before: Vec<Heard>) -> Answer {
        if let ToolReply::Act(reply) = &mut self.reply {
            reply.executed_steps += steps_before;
        }
        let heard = heard_before.into_iter().chain(self.heard).collect();
        Answer { heard, ..self }
    }

    /// The answer to a command of `asked_steps`, of which fewer were executed where a partner's was shorter.
    pub fn cut_off_after(mut self, asked_steps: u32) -> Answer {
        if let ToolReply::Act(reply) = &mut self.reply
            && reply.stop_reason == StopReason::StepsDone
            && reply.executed_steps < asked_steps
        {
            reply.stop_reason = StopReason::PartnerDone;
        }
        self
    }
}

/// A call that was refused before it reached its episode, as it came.
#[derive(Debug, Clone)]
pub struct RefusedCall {
    /// What may be a tool's name.
    pub tool: String,
    /// What may be JSON.
    pub arguments: String,
    /// Why it was refused.
    pub problem: String,
}

impl RefusedCall {
    /// A call that may yet be refused.
    pub fn of(call: &Call) -> RefusedCall {
        let arguments = serde_json::to_string(call).unwrap_or_default();
        RefusedCall { tool: call.name().into(), arguments, problem: String::new() }
    }

    /// The call with why it was refused.
    pub fn because(self, refusal: &impl ToString) -> RefusedCall {
        RefusedCall { problem: refusal.to_string(), ..self }
    }
}
