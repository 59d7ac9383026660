//! An episode as callers meet it: driven by one policy or by an operator for each robot, with replies that may be asked for again.

use std::sync::Arc;

use serde_json::Value;
use tandem_episodes::{EpisodeError, teamwork};
use tandem_tools_spec::{
    Briefing, Call, EPISODE_TOOLS, EpisodeEntry, ManageReply, Note, Operators, ResultReply, SpecError,
    StatusReply, TalkCall, ToolCall, ToolReply,
};

use super::{
    Answer, EpisodeThread, HostingError, RefusedCall,
    durable::{KeptAnswer, Keyed, KeyedNote},
    episode::HostMemory,
    idempotency_cache::{IdempotencyCache, IdempotentReply},
    team::Team,
};

/// Who calls, as its token says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Caller {
    /// Who may use the server: starts episodes, and drives those that one policy directs.
    Host,
    /// The operator of one robot.
    Operator {
        /// The episode.
        episode: String,
        /// The robot, as "A".
        robot: String,
    },
}

impl Caller {
    /// The robot that it drives alone.
    pub fn robot(&self) -> Option<&str> {
        match self {
            Caller::Host => None,
            Caller::Operator { robot, .. } => Some(robot),
        }
    }
}

/// An episode that a server holds.
#[derive(Debug, Clone)]
pub struct HostedEpisode {
    id: String,
    /// The thread that owns its world.
    pub thread: Arc<EpisodeThread>,
    beside: Arc<Beside>,
}

/// What a server knows of an episode beside its world.
#[derive(Debug, Default)]
pub struct Beside {
    /// The operators, where each robot has one.
    team: Option<Arc<Team>>,
    /// Replies that may be asked for again.
    replies: Arc<IdempotencyCache<Call, SharedAnswer>>,
    notes: IdempotencyCache<Note, SharedNote>,
}

/// What came of a call, for as many as want to know.
type SharedAnswer = Result<Arc<Answer>, Arc<HostingError>>;

/// What came of a note, for as many as want to know.
type SharedNote = Result<(), Arc<HostingError>>;

impl Beside {
    /// What is known of an episode that `team` drives, or else one policy.
    pub fn new(team: Option<Team>) -> Beside {
        Beside { team: team.map(Arc::new), ..Beside::default() }
    }
}

impl HostMemory for Beside {
    fn memory(&self) -> Value {
        let operators = self.team.as_ref().map(|team| team.memory());
        // Texts and numbers can always be written.
        serde_json::to_value(operators).unwrap_or_default()
    }

    fn restore(&self, memory: Option<Value>, answers: Vec<KeptAnswer>, notes: Vec<KeyedNote>) {
        if let (Some(team), Some(memory)) = (&self.team, memory) {
            match serde_json::from_value(memory) {
                Ok(memory) => team.restore(memory),
                Err(error) => tracing::error!(%error, "what operators had not heard yet is lost"),
            }
        }
        for answer in answers {
            let key = answer.key.clone();
            match answer.read() {
                Ok((request, answer)) => self.replies.keep(key, request, Ok(Arc::new(answer))),
                Err(error) => tracing::error!(%error, key, "an answer is lost"),
            }
        }
        for KeyedNote { key, note } in notes {
            self.notes.keep(key, note, Ok(()));
        }
    }

    fn let_go(&self) {
        // What is left of them would keep all memory around it in use.
        self.replies.clear();
        self.notes.clear();
    }

    fn is_busy(&self) -> bool {
        self.team.as_ref().is_some_and(|team| team.is_busy())
    }
}

impl HostedEpisode {
    /// The episode `id`, of which the server knows `beside`.
    pub fn new(id: &str, thread: Arc<EpisodeThread>, beside: Arc<Beside>) -> HostedEpisode {
        HostedEpisode { id: id.into(), thread, beside }
    }

    /// The operators, where each robot has one.
    pub fn team(&self) -> Option<&Arc<Team>> {
        self.beside.team.as_ref()
    }

    /// What the episode is called.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Answers a call; with a key, once for this key and caller.
    pub async fn call(
        &self,
        who: &Caller,
        call: Call,
        key: Option<&str>,
    ) -> Result<IdempotentReply<Arc<Answer>>, HostingError> {
        let robot = self.robot_of(who)?;
        let Some(key) = key else {
            let reply = Arc::new(Box::pin(self.clone().answer(robot, call, None)).await?);
            return Ok(IdempotentReply { reply, replayed: false });
        };
        let key = own_key(robot.as_deref(), key);
        let (episode, asked) = (self.clone(), call.clone());
        let keyed = Keyed { key: key.clone(), request: call.clone() };
        // On the heap: it is handed on several times, and has kilobytes.
        let work = Box::pin(async move {
            episode.answer(robot, asked, Some(keyed)).await.map(Arc::new).map_err(Arc::new)
        });
        let lasting = |made: &SharedAnswer| made.as_ref().map_or_else(|error| error.is_final(), |_| true);
        let IdempotentReply { reply, replayed } = self.beside.replies.once(&key, call, work, lasting).await?;
        Ok(IdempotentReply { reply: reply.map_err(HostingError::Shared)?, replayed })
    }

    /// Keeps a note of who started the episode, or of an operator; with a key, once for this key and caller.
    pub async fn note(&self, who: &Caller, note: Note, key: Option<&str>) -> Result<(), HostingError> {
        let Some(key) = key.map(|key| own_key(who.robot(), key)) else {
            return self.keep_note(who, note, None).await;
        };
        let (episode, caller, told, own) = (self.clone(), who.clone(), note.clone(), key.clone());
        let work = async move { episode.keep_note(&caller, told, Some(own)).await.map_err(Arc::new) };
        let lasting = |made: &SharedNote| made.as_ref().map_or_else(|error| error.is_final(), |()| true);
        let kept = self.beside.notes.once(&key, note, work, lasting).await?;
        kept.reply.map_err(HostingError::Shared)
    }

    async fn keep_note(&self, who: &Caller, note: Note, key: Option<String>) -> Result<(), HostingError> {
        self.admit(who)?;
        let own = self.team().zip(who.robot());
        let _place = own.map(|(team, robot)| team.take_place(robot)).transpose()?;
        self.thread.note(who.robot(), note, key).await
    }

    /// Keeps a call of `who` that was refused before it reached the episode.
    pub async fn refused(&self, who: &Caller, call: RefusedCall) {
        self.thread.refused(who.robot(), call).await;
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
        let briefing = self.thread.briefing().await?;
        Ok(match who {
            Caller::Operator { robot, .. } => {
                let mut briefing = briefing.for_robot(robot);
                briefing.brief.teamwork = Some(teamwork(self.thread.spec().assistance, self.may_talk()));
                briefing
            }
            Caller::Host => briefing,
        })
    }

    /// Its line in the list of episodes, as far as its policies are told.
    pub fn told_entry(&self) -> EpisodeEntry {
        EpisodeEntry { seed: self.thread.spec().told_seed(), ..self.entry() }
    }

    /// The whole of it. Its thread is not asked, which may be at work.
    pub fn entry(&self) -> EpisodeEntry {
        let spec = self.thread.spec();
        EpisodeEntry {
            episode_id: self.id.clone(),
            task: spec.task.id.into(),
            seed: Some(spec.seed),
            protocol: spec.protocol,
            operators: if self.team().is_some() { Operators::PerRobot } else { Operators::One },
            step: self.thread.env_steps(),
            ended: self.thread.end_reason(),
        }
    }

    /// Whether operators may talk.
    pub fn may_talk(&self) -> bool {
        self.team().is_some_and(|team| team.may_talk())
    }

    /// Refuses a tool that `who` is not offered, whatever its arguments are.
    pub fn check_offered(&self, who: &Caller, tool: &str) -> Result<(), HostingError> {
        let is_operator = matches!(who, Caller::Operator { .. });
        let for_talk = |tool: &str| TalkCall::TOOLS.contains(&tool);
        if for_talk(tool) && !self.may_talk() {
            return Err(HostingError::NoTalk);
        }
        if EPISODE_TOOLS.contains(&tool) {
            return Ok(());
        }
        let offered = EPISODE_TOOLS.iter().filter(|tool| (is_operator && self.may_talk()) || !for_talk(tool));
        let have = offered.copied().collect();
        Err(EpisodeError::from(SpecError::UnknownTool { name: tool.into(), have }).into())
    }

    /// Ends the episode, as [`EpisodeThread::close`] does; operators who wait for each other are told.
    pub async fn close(&self) -> Result<ResultReply, HostingError> {
        self.close_for(false).await
    }

    /// As [`HostedEpisode::close`], where it is to go on when it is brought back if `keep` says so.
    pub async fn close_for(&self, keep: bool) -> Result<ResultReply, HostingError> {
        let result = if keep { self.thread.leave().await } else { self.thread.close().await };
        if let Some(team) = self.team() {
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
            Caller::Host | Caller::Operator { .. } => Ok(()),
        }
    }

    /// The robot that `who` drives; `None` where one policy directs all.
    fn robot_of(&self, who: &Caller) -> Result<Option<String>, HostingError> {
        self.admit(who)?;
        match (who, self.team()) {
            (Caller::Host, None) => Ok(None),
            (Caller::Host, Some(_)) => Err(HostingError::NeedsOperator),
            (Caller::Operator { robot, .. }, _) => Ok(Some(robot.clone())),
        }
    }

    async fn answer(
        self,
        robot: Option<String>,
        call: Call,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        match (self.team(), robot, &call.tool) {
            (Some(team), Some(robot), _) => {
                let asked = RefusedCall::of(&call);
                let answer = team.call(&self.thread, &robot, call, keyed).await;
                if let Err(refusal) = &answer
                    && refusal.is_of_the_team()
                {
                    self.thread.refused(Some(&robot), asked.because(refusal)).await;
                }
                answer
            }
            (_, _, ToolCall::Talk(_)) => Err(HostingError::NoTalk),
            (_, _, ToolCall::Look(_) | ToolCall::Act(_) | ToolCall::Plan(_) | ToolCall::Manage(_)) => {
                self.thread.ask(None, call, keyed, Box::new(|answer| answer)).await
            }
        }
    }
}

/// The key under which an operator's request is kept: keys of different operators have nothing to do with each
/// other.
fn own_key(robot: Option<&str>, key: &str) -> String {
    format!("{}:{key}", robot.unwrap_or_default())
}
