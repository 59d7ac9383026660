//! Answers to calls on an episode, and calls that were refused before they reached it.

use serde::Serialize;
use tandem_episodes::{CallReply, Session};
use tandem_tools_spec::{
    Call, Heard, ManageReply, Observation, Partner, PartnerDid, Presence, StopReason, TalkReply, ToolReply,
};

/// A tool's reply with the information that accompanies every reply.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// The reply.
    #[serde(flatten)]
    pub reply: ToolReply,
    /// Control steps executed up to now, including the initial hold. Omitted from a result, which contains a
    /// step count.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<u32>,
    /// Observation after a command that requested it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observation: Option<Observation>,
    /// Behaviour of the other operators' robots during the command.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub partners: Vec<Partner>,
    /// Current actions of the other operators, only in the answer to a status request.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub presence: Vec<Presence>,
    /// Messages from the other operators.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub heard: Vec<Heard>,
    /// Reason why the recording is incomplete. Omitted if the recording is complete or the reply itself
    /// contains the reason.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recording_failed: Option<String>,
    /// True once the operator has finished while others still play, so that the episode has no result yet.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub others_play_on: bool,
}

impl Answer {
    /// Adds the information from `session` to its reply `reply`.
    pub fn new(reply: CallReply, session: &Session) -> Answer {
        let CallReply { reply, observation } = reply;
        let is_result = matches!(reply, ToolReply::Manage(ManageReply::Finish(_)));
        let failed = session.recording_failed().filter(|_| !is_result);
        Answer {
            reply,
            step: (!is_result).then(|| session.env_steps()),
            observation,
            partners: Vec::new(),
            presence: Vec::new(),
            heard: Vec::new(),
            recording_failed: failed.map(str::to_owned),
            others_play_on: false,
        }
    }

    /// Removes the entries of all robots but `robot`.
    pub fn of_own_robot(mut self, robot: &str) -> Answer {
        match &mut self.reply {
            ToolReply::Act(reply) => {
                reply.robots.retain(|report| report.robot == robot);
                reply.fallen.retain(|entry| entry.robot == robot);
            }
            ToolReply::Manage(ManageReply::GetStatus(status)) | ToolReply::Talk(TalkReply::Say(status)) => {
                status.fallen.retain(|entry| entry.robot == robot)
            }
            // An observation shows the operator's robot alone, replies to a plan's commands are already
            // restricted, and a result concerns all robots.
            ToolReply::Look(_) | ToolReply::Plan(_) | ToolReply::Manage(ManageReply::Finish(_)) => {}
        }
        self
    }

    /// Sets the thinking time in seconds that the operator has left.
    pub fn with_clock_left(mut self, left_s: Option<f64>) -> Answer {
        let budget = match &mut self.reply {
            ToolReply::Act(reply) => &mut reply.budget,
            ToolReply::Manage(ManageReply::GetStatus(status)) | ToolReply::Talk(TalkReply::Say(status)) => {
                &mut status.budget
            }
            // The last reply of a plan already contains the time.
            ToolReply::Look(_) | ToolReply::Plan(_) | ToolReply::Manage(ManageReply::Finish(_)) => {
                return self;
            }
        };
        budget.wall_clock_left_s = left_s;
        self
    }

    /// Returns the number of executed control steps if a partner's shorter command ended this command early.
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

    /// Adds the steps and messages of a command's earlier parts to this answer, which is for its last part.
    pub fn after(mut self, steps_before: u32, heard_before: Vec<Heard>) -> Answer {
        if let ToolReply::Act(reply) = &mut self.reply {
            reply.executed_steps += steps_before;
        }
        let heard = heard_before.into_iter().chain(self.heard).collect();
        Answer { heard, ..self }
    }

    /// Reports as active those partners that acted in an earlier part of a command and fell silent only in
    /// its last part. Two operators that wait for each other then both receive this report, whichever command
    /// ends first.
    pub fn with_partners_before(mut self, before: Vec<Partner>) -> Answer {
        for earlier in before.into_iter().filter(|earlier| earlier.did == PartnerDid::Acted) {
            let silent = self
                .partners
                .iter_mut()
                .find(|now| now.robot == earlier.robot && now.did == PartnerDid::HeldSilent);
            if let Some(silent) = silent {
                *silent = earlier;
            }
        }
        self
    }

    /// Reports a command of `asked_steps` as cut off by a partner if fewer steps were executed.
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

/// A call that was refused before it reached its episode, as received.
#[derive(Debug, Clone)]
pub struct RefusedCall {
    /// Tool name as received; possibly not the name of a tool.
    pub tool: String,
    /// Arguments as received; possibly not valid JSON.
    pub arguments: String,
    /// Reason for the refusal.
    pub problem: String,
}

impl RefusedCall {
    /// Copies a call that may be refused later, with an empty reason.
    pub fn of(call: &Call) -> RefusedCall {
        let arguments = serde_json::to_string(call).unwrap_or_default();
        RefusedCall { tool: call.name().into(), arguments, problem: String::new() }
    }

    /// Sets the reason for the refusal.
    pub fn because(self, refusal: &impl ToString) -> RefusedCall {
        RefusedCall { problem: refusal.to_string(), ..self }
    }
}
