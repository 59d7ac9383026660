//! An episode as callers meet it: driven by one policy or by an operator for each robot, with replies that are kept.

use std::sync::Arc;

use serde_json::Value;
use tandem_tools_spec::{
    Asked, Briefing, ManageReply, ResultReply, Say, SpecError, StatusReply, Tool, ToolReply, parse_args,
};

use super::{
    Answer, Caller, EpisodeThread, HostingError,
    kept::{Kept, Once},
    team::Team,
};

/// An episode that is held.
#[derive(Debug, Clone)]
pub struct Hosted {
    id: String,
    /// The thread that owns its world.
    pub thread: Arc<EpisodeThread>,
    /// The operators, where each robot has one.
    pub team: Option<Arc<Team>>,
    kept: Arc<Kept<Request, Outcome>>,
}

/// What is asked of an episode.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// A call of a tool.
    Asked(Box<Asked>),
    /// Words to the other operators.
    Say(Say),
}

/// What came of a request, for as many as want to know.
type Outcome = Result<Arc<Answer>, Arc<HostingError>>;

impl Request {
    /// Reads a call of the tool `name`.
    pub fn parse(name: &str, args: Value) -> Result<Request, SpecError> {
        match name {
            Say::NAME => parse_args(args).map(Request::Say),
            _ => Asked::parse(name, args).map(|asked| Request::Asked(asked.into())),
        }
    }
}

impl Hosted {
    /// The episode `id`, whose replies are kept from now on.
    pub fn new(id: &str, thread: Arc<EpisodeThread>, team: Option<Team>) -> Hosted {
        Hosted { id: id.into(), thread, team: team.map(Arc::new), kept: Arc::default() }
    }

    /// What the episode is called.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Answers a request; with a key, once for this key and caller.
    pub async fn call(
        &self,
        who: &Caller,
        request: Request,
        key: Option<&str>,
    ) -> Result<Once<Arc<Answer>>, HostingError> {
        let robot = self.robot_of(who)?;
        let Some(key) = key else {
            let reply = Arc::new(self.clone().answer(robot, request).await?);
            return Ok(Once { reply, again: false });
        };
        // Keys of different operators have nothing to do with each other.
        let key = format!("{}:{key}", robot.as_deref().unwrap_or_default());
        let (hosted, asked) = (self.clone(), request.clone());
        let work = async move { hosted.answer(robot, asked).await.map(Arc::new).map_err(Arc::new) };
        let lasting = |made: &Outcome| made.as_ref().map_or_else(|error| error.is_final(), |_| true);
        let Once { reply, again } = self.kept.once(&key, request, work, lasting).await?;
        Ok(Once { reply: reply.map_err(HostingError::Shared)?, again })
    }

    /// Where the episode stands, for who looks on: asking is no call.
    pub async fn status(&self, who: &Caller) -> Result<Answer, HostingError> {
        let mut answer = self.thread.status().await?;
        if let Caller::Operator { .. } = who
            && let (Some(robot), ToolReply::Manage(ManageReply::GetStatus(status))) =
                (self.robot_of(who)?, &mut answer.reply)
        {
            let StatusReply { fallen, .. } = status;
            fallen.retain(|entry| entry.robot == robot);
        }
        Ok(answer)
    }

    /// What `who` has to know to begin.
    pub async fn briefing(&self, who: &Caller) -> Result<Briefing, HostingError> {
        self.admit(who)?;
        let mut briefing = self.thread.briefing().await?;
        if let Caller::Operator { robot, .. } = who {
            briefing.instructions.retain(|entry| entry.robot == *robot);
            briefing.status.fallen.retain(|entry| entry.robot == *robot);
        }
        Ok(briefing)
    }

    /// Whether operators may talk.
    pub fn may_talk(&self) -> bool {
        self.team.as_ref().is_some_and(|team| team.may_talk())
    }

    /// Ends the episode, as [`EpisodeThread::close`] does; operators who wait for each other are told.
    pub async fn close(&self) -> Result<ResultReply, HostingError> {
        let result = self.thread.close().await;
        if let Some(team) = &self.team {
            team.stop();
        }
        result
    }

    /// Whether `who` may know of this episode.
    pub fn admit(&self, who: &Caller) -> Result<(), HostingError> {
        match who {
            Caller::Operator { episode, .. } if *episode != self.id => {
                Err(HostingError::UnknownEpisode { id: self.id.clone() })
            }
            _ => Ok(()),
        }
    }

    /// The robot that `who` drives; `None` where one policy directs all.
    fn robot_of(&self, who: &Caller) -> Result<Option<String>, HostingError> {
        self.admit(who)?;
        match (who, &self.team) {
            (Caller::Host, None) => Ok(None),
            (Caller::Host, Some(_)) => Err(HostingError::NeedsOperator),
            (Caller::Operator { robot, .. }, _) => Ok(Some(robot.clone())),
        }
    }

    async fn answer(self, robot: Option<String>, request: Request) -> Result<Answer, HostingError> {
        match (self.team, robot, request) {
            (Some(team), Some(robot), Request::Asked(asked)) => team.call(&self.thread, &robot, *asked).await,
            (Some(team), Some(robot), Request::Say(say)) => team.say(&self.thread, &robot, say).await,
            (_, _, Request::Asked(asked)) => self.thread.ask(None, *asked).await,
            (_, _, Request::Say(_)) => Err(HostingError::NoTalk),
        }
    }
}
