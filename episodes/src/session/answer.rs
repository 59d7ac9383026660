//! From a tool call to its reply: looks, commands, and what concerns the episode as a whole.

use tandem_sim::Pose;
use tandem_tools_spec::{
    ActCall, CommandReply, EndReason, LookCall, LookReply, ManageCall, ManageReply, RobotReport, StopReason,
    ToolCall, ToolReply,
};

use super::Session;
use super::replies::{self, Detail};
use crate::EpisodeError;
use crate::commands::{self, Command, check_reach, report};

impl Session {
    pub(super) fn answer(&mut self, call: &ToolCall) -> Result<ToolReply, EpisodeError> {
        match (call, self.ended) {
            (ToolCall::Manage(call), _) => Ok(ToolReply::Manage(self.manage(call))),
            (ToolCall::Look(call), _) => self.look(call).map(ToolReply::Look),
            (ToolCall::Act(_), Some(reason)) => Err(EpisodeError::Ended { reason }),
            (ToolCall::Act(call), None) => self.act(call).map(ToolReply::Act),
        }
    }

    fn look(&mut self, call: &LookCall) -> Result<LookReply, EpisodeError> {
        let find = |name: &String| commands::find(name, &self.motions);
        match call {
            LookCall::Observe(args) => {
                let robots = match &args.robots {
                    Some(names) => names.iter().map(find).collect::<Result<_, _>>()?,
                    None => (0..self.motions.len()).collect::<Vec<_>>(),
                };
                let detail = Detail::of(args);
                self.eyes.observe(&self.present, &robots, &self.motions, detail).map(LookReply::Observe)
            }
            LookCall::GetRobotState(args) => {
                let robot = find(&args.robot)?;
                let sheet = &self.motions[robot].robot;
                Ok(LookReply::GetRobotState(replies::robot_state(&self.present, robot, sheet, Detail::Full)))
            }
            LookCall::QueryDepth(args) => {
                let robot = find(&args.robot)?;
                let name = &self.motions[robot].robot.name;
                self.eyes.depth(&self.present, robot, name, &args.named()).map(LookReply::QueryDepth)
            }
            LookCall::CheckReach(args) => {
                let robot = find(&args.robot)?;
                Ok(LookReply::CheckReach(check_reach(args, &self.motions[robot])))
            }
        }
    }

    fn manage(&mut self, call: &ManageCall) -> ManageReply {
        match call {
            ManageCall::GetStatus(_) => ManageReply::GetStatus(self.status()),
            ManageCall::Finish(_) => {
                self.ended.get_or_insert(EndReason::Finished);
                ManageReply::Finish(self.result().told(self.spec().disclosure))
            }
        }
    }

    /// Checks a command as a whole, then executes it.
    fn act(&mut self, call: &ActCall) -> Result<CommandReply, EpisodeError> {
        let command = Command::read(call, &self.rules, &self.motions)?;
        let cuts = command.cuts();
        let began: Vec<Pose> =
            self.present.robots.iter().map(|robot| robot.state.start_from_pelvis).collect();
        let executed_steps = self.run(command)?;
        let stop_reason = self.stop_reason();
        let robots: Vec<RobotReport> = cuts
            .iter()
            .map(|(robot, cut)| {
                let state = &self.present.robots[*robot].state;
                report(cut, &began[*robot], state, &self.motions[*robot])
            })
            .collect();
        Ok(CommandReply {
            executed_steps,
            stop_reason,
            time_s: self.present.time_s,
            robots,
            fallen: self.fallen(),
            phases: self.phases(),
            budget: self.budget(),
        })
    }

    /// Why a command that has been executed stopped; what ends the episode ends it here.
    fn stop_reason(&mut self) -> StopReason {
        if self.has_succeeded() {
            self.ended = Some(EndReason::TaskComplete);
            StopReason::TaskComplete
        } else if self.steps_left() == 0 {
            self.ended = Some(EndReason::StepBudgetExhausted);
            StopReason::StepBudgetExhausted
        } else {
            StopReason::StepsDone
        }
    }
}
