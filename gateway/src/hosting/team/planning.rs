//! Plans of one operator: each command goes through the team's rounds like any other, and those of the
//! partners go on over as many of them as they have steps.

use std::sync::Arc;

use tandem_episodes::{OperatorCall, PlanAdvance, PlanRun};
use tandem_tools_spec::{ActCall, Call, CommandReply, Heard, Partner, PlanCall, ToolCall, ToolReply};

use super::Team;
use crate::hosting::{Answer, EpisodeThread, HostingError, durable::Keyed};

/// A plan of one operator while it is carried out; the partners' commands go on as long.
struct PlanUnderWay {
    team: Arc<Team>,
    heard: Vec<Heard>,
    partners: Vec<Partner>,
}

impl PlanUnderWay {
    fn new(team: &Arc<Team>) -> PlanUnderWay {
        team.wheels().plans += 1;
        PlanUnderWay { team: team.clone(), heard: Vec::new(), partners: Vec::new() }
    }
}

impl Drop for PlanUnderWay {
    fn drop(&mut self) {
        self.team.wheels().plans -= 1;
    }
}

impl Team {
    /// Carries out a plan of the operator on `seat`, or refuses all of it.
    pub(super) async fn plan(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
        (own, plan): (OperatorCall, PlanCall),
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        self.round().check_plays(seat)?;
        let run = {
            let _place = self.take_place(own.robot())?;
            episode.begin_plan(own.clone(), plan).await?
        };
        let (team, thread) = (self.clone(), episode.clone());
        finish_all(episode, keyed, async move { team.carry_out(&thread, seat, &own, run).await }).await
    }

    async fn carry_out(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
        own: &OperatorCall,
        mut run: PlanRun,
    ) -> Result<Answer, HostingError> {
        let mut under_way = PlanUnderWay::new(self);
        let stopped = loop {
            let next;
            (run, next) = episode.advance_plan(run).await?;
            let call = match next {
                PlanAdvance::Make(call) => call,
                PlanAdvance::Done(stopped) => break stopped,
            };
            let stopped =
                match self.make_planned(episode, own.robot(), seat, (call, run.tool()), &mut under_way).await
                {
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
        let (reply, step) = episode.end_plan(own.call().clone(), run, stopped).await?;
        Ok(Answer {
            reply: ToolReply::Plan(reply),
            step: Some(step),
            observation: None,
            partners: std::mem::take(&mut under_way.partners),
            presence: Vec::new(),
            heard: std::mem::take(&mut under_way.heard),
            recording_failed: episode.recording_failed().map(str::to_owned),
            others_play_on: false,
        })
    }

    async fn make_planned(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        robot: &str,
        seat: usize,
        (call, tool): (ActCall, &'static str),
        under_way: &mut PlanUnderWay,
    ) -> Result<CommandReply, HostingError> {
        let command = OperatorCall::new(robot, Call::from(ToolCall::Act(call)))?.planned(tool);
        let Answer { reply, mut heard, partners, .. } = self.clone().act_on(episode, seat, command).await?;
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

/// Finishes what has begun, even if its caller leaves, and keeps the answer to a call with a key.
pub async fn finish_all(
    episode: &Arc<EpisodeThread>,
    keyed: Option<Keyed>,
    work: impl Future<Output = Result<Answer, HostingError>> + Send + 'static,
) -> Result<Answer, HostingError> {
    let episode = episode.clone();
    let going_on = tokio::spawn(async move {
        let answer = work.await?;
        match keyed {
            Some(keyed) => episode.keep_answer(keyed, answer).await,
            None => Ok(answer),
        }
    });
    going_on.await.map_err(|_| HostingError::EpisodeStopped)?
}
