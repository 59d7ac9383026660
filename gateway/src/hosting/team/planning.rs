//! Plans of one operator. Each command of a plan goes through the team's rounds like any other command. A
//! partner's command continues over as many rounds as it has steps.

use tandem_episodes::{OperatorCall, PlanAdvance, PlanRun};
use tandem_tools_spec::{ActCall, Call, CommandReply, Heard, Partner, PlanCall, ToolCall, ToolReply};

use super::handle::OperatorHandle;
use crate::hosting::{Answer, HostingError, durable::Keyed};

/// A plan of one operator during its execution. Meanwhile, partners' longer commands continue after each of
/// its commands.
struct PlanUnderWay {
    own: OperatorHandle,
    heard: Vec<Heard>,
    partners: Vec<Partner>,
}

impl PlanUnderWay {
    fn new(own: &OperatorHandle) -> PlanUnderWay {
        own.round().plans += 1;
        PlanUnderWay { own: own.clone(), heard: Vec::new(), partners: Vec::new() }
    }
}

impl Drop for PlanUnderWay {
    fn drop(&mut self) {
        self.own.round().plans -= 1;
    }
}

impl OperatorHandle {
    /// Executes a plan, or refuses the whole plan.
    pub(super) async fn plan(
        &self,
        call: OperatorCall,
        plan: PlanCall,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        self.own(|own| own.check_plays())?;
        let run = {
            let _place = self.team.take_place(self.robot())?;
            self.episode.begin_plan(call.clone(), plan).await?
        };
        let own = self.clone();
        self.finish_all(keyed, async move { own.carry_out(&call, run).await }).await
    }

    async fn carry_out(&self, own: &OperatorCall, mut run: PlanRun) -> Result<Answer, HostingError> {
        let mut under_way = PlanUnderWay::new(self);
        let stopped = loop {
            let next;
            (run, next) = self.episode.advance_plan(run).await?;
            let call = match next {
                PlanAdvance::Make(call) => call,
                PlanAdvance::Done(stopped) => break stopped,
            };
            let stopped = match self.make_planned((call, run.tool()), &mut under_way).await {
                Ok(reply) => run.take(reply),
                Err(error) if run.is_untouched() => return Err(error),
                Err(error) => Some(error.to_string()),
            };
            run.see(&under_way.partners);
            under_way.heard.iter().for_each(|words| run.hear(&words.from));
            if stopped.is_some() {
                break stopped;
            }
        };
        let (reply, step) = self.episode.end_plan(own.call().clone(), run, stopped).await?;
        Ok(Answer {
            reply: ToolReply::Plan(reply),
            step: Some(step),
            observation: None,
            partners: std::mem::take(&mut under_way.partners),
            presence: Vec::new(),
            heard: std::mem::take(&mut under_way.heard),
            recording_failed: self.episode.recording_failed().map(str::to_owned),
            others_play_on: false,
        })
    }

    async fn make_planned(
        &self,
        (call, tool): (ActCall, &'static str),
        under_way: &mut PlanUnderWay,
    ) -> Result<CommandReply, HostingError> {
        let command = OperatorCall::new(self.robot(), Call::from(ToolCall::Act(call)))?.planned(tool);
        let Answer { reply, mut heard, partners, .. } = self.act_on(command).await?;
        under_way.heard.append(&mut heard);
        under_way.partners = partners;
        match reply {
            ToolReply::Act(reply) => Ok(reply),
            ToolReply::Look(_) | ToolReply::Plan(_) | ToolReply::Manage(_) | ToolReply::Talk(_) => {
                Err(HostingError::EpisodeStopped)
            }
        }
    }
}
