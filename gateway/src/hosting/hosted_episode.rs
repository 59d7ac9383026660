//! Episodes with the state that callers share: the operators, if each robot has one, and the cached replies
//! and images.

use std::sync::Arc;

use serde_json::Value;
use tandem_episodes::{EpisodeError, teamwork};
use tandem_tools_spec::{
    Briefing, Call, EPISODE_TOOLS, EpisodeEntry, Formats, ImageFormat, LookReply, ManageReply, Note,
    Operators, ResultReply, SpecError, StatusReply, TalkCall, ToolCall, ToolReply,
};

use super::{
    Answer, EpisodeThread, HostingError, RefusedCall,
    durable::{KeptAnswer, Keyed, KeyedNote},
    episode::HostMemory,
    idempotency_cache::{IdempotencyCache, IdempotentReply},
    image_links::{ImageLinks, MAX_LINKED_IMAGES},
    team::{OperatorHandle, Team},
};

/// Caller, identified by its token.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Caller {
    /// The host's client. It may start episodes, and it drives episodes in which one policy controls all
    /// robots.
    Host,
    /// The operator of one robot.
    Operator {
        /// Id of the episode.
        episode: String,
        /// Name of the robot, for example "A".
        robot: String,
    },
}

impl Caller {
    /// Returns the only robot that the caller drives; `None` for the host.
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
    /// Thread that owns the world of the episode.
    pub thread: Arc<EpisodeThread>,
    beside: Arc<Beside>,
}

/// State that a server keeps for an episode besides its world.
#[derive(Debug, Default)]
pub struct Beside {
    /// Operators of the robots; `None` if one policy controls all robots.
    team: Option<Arc<Team>>,
    /// Replies by idempotency key, for repeated requests.
    replies: Arc<IdempotencyCache<Call, SharedAnswer>>,
    notes: IdempotencyCache<Note, SharedNote>,
    /// Images to which replies link.
    images: ImageLinks,
}

/// Outcome of a call, shared by its callers.
type SharedAnswer = Result<Arc<Answer>, Arc<HostingError>>;

/// Outcome of a note, shared by its callers.
type SharedNote = Result<(), Arc<HostingError>>;

impl Beside {
    /// Creates the state for an episode driven by `team`, or by one policy if there is no team.
    pub fn new(team: Option<Team>) -> Beside {
        Beside { team: team.map(Arc::new), ..Beside::default() }
    }
}

impl HostMemory for Beside {
    fn memory(&self) -> Value {
        let operators = self.team.as_ref().map(|team| team.memory());
        // Strings and numbers always serialize.
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
        // Clears the caches, because their entries would stay in memory.
        self.replies.clear();
        self.notes.clear();
        self.images.clear();
    }

    fn is_busy(&self) -> bool {
        self.team.as_ref().is_some_and(|team| team.is_busy())
    }
}

impl HostedEpisode {
    /// Creates the episode `id` with the server's state `beside`.
    pub fn new(id: &str, thread: Arc<EpisodeThread>, beside: Arc<Beside>) -> HostedEpisode {
        HostedEpisode { id: id.into(), thread, beside }
    }

    /// Returns the robots' operators; `None` if one policy controls all robots.
    pub fn team(&self) -> Option<&Arc<Team>> {
        self.beside.team.as_ref()
    }

    /// Returns the operator of `robot`.
    pub fn operator(&self, robot: &str) -> Result<OperatorHandle, HostingError> {
        OperatorHandle::new(self.team().ok_or(HostingError::OnePolicy)?, &self.thread, robot)
    }

    /// Returns the id of the episode.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Answers a call. A call with an idempotency key runs once for this key and caller.
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
        // The future is boxed, because it takes kilobytes and is moved several times.
        let work = Box::pin(async move {
            episode.answer(robot, asked, Some(keyed)).await.map(Arc::new).map_err(Arc::new)
        });
        let lasting = |made: &SharedAnswer| made.as_ref().map_or_else(|error| error.is_final(), |_| true);
        let IdempotentReply { reply, replayed } = self.beside.replies.once(&key, call, work, lasting).await?;
        Ok(IdempotentReply { reply: reply.map_err(HostingError::Shared)?, replayed })
    }

    /// Records a note of the host's client or of an operator. A note with an idempotency key is recorded once
    /// for this key and caller.
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

    /// Records a call of `who` that was refused before it reached the episode.
    pub async fn refused(&self, who: &Caller, call: RefusedCall) {
        self.thread.refused(who.robot(), call).await;
    }

    /// Returns the state of the episode for a watcher. The request does not count as a call.
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

    /// Returns the briefing for `who`.
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

    /// Returns the PNG file of an image to which a reply for `who` links.
    pub fn image(&self, who: &Caller, name: &str) -> Result<Arc<[u8]>, HostingError> {
        self.admit(who)?;
        let kept = self.beside.images.find(name);
        let own = kept.filter(|image| who.robot().is_none_or(|robot| robot == image.robot));
        own.map(|image| image.png)
            .ok_or_else(|| HostingError::NoImage { name: name.into(), kept: MAX_LINKED_IMAGES })
    }

    /// Returns the entry in the list of episodes, without information that is hidden from policies.
    pub fn told_entry(&self) -> EpisodeEntry {
        EpisodeEntry { seed: self.thread.spec().told_seed(), ..self.entry() }
    }

    /// Returns the complete entry in the list of episodes, without waiting for the thread, which may be busy.
    pub fn entry(&self) -> EpisodeEntry {
        let spec = self.thread.spec();
        EpisodeEntry {
            episode_id: self.id.clone(),
            task: spec.task.id.clone(),
            seed: Some(spec.seed),
            protocol: spec.protocol,
            operators: if self.team().is_some() { Operators::PerRobot } else { Operators::One },
            step: self.thread.env_steps(),
            ended: self.thread.end_reason(),
        }
    }

    /// Returns true if operators may send messages to each other.
    pub fn may_talk(&self) -> bool {
        self.team().is_some_and(|team| team.may_talk())
    }

    /// Returns an error if `tool` is not available to `who`, whatever the arguments.
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

    /// Closes the episode as [`EpisodeThread::close`] does, and ends the calls of operators that wait for
    /// each other.
    pub async fn close(&self) -> Result<ResultReply, HostingError> {
        self.close_for(false).await
    }

    /// Closes the episode. If `keep` is true, the episode can be resumed later.
    pub async fn close_for(&self, keep: bool) -> Result<ResultReply, HostingError> {
        let result = if keep { self.thread.leave().await } else { self.thread.close().await };
        if let Some(team) = self.team() {
            team.stop();
        }
        result
    }

    /// Returns an error for a caller that has no access to this episode.
    pub fn admit(&self, who: &Caller) -> Result<(), HostingError> {
        match who {
            Caller::Operator { episode, .. } if *episode != self.id => {
                Err(HostingError::UnknownEpisode { id: self.id.clone() })
            }
            Caller::Host | Caller::Operator { .. } => Ok(()),
        }
    }

    /// Returns the robot that `who` drives; `None` if one policy controls all robots.
    fn robot_of(&self, who: &Caller) -> Result<Option<String>, HostingError> {
        self.admit(who)?;
        match (who, self.team()) {
            (Caller::Host, None) => Ok(None),
            (Caller::Host, Some(_)) => Err(HostingError::NeedsOperator),
            (Caller::Operator { robot, .. }, _) => Ok(Some(robot.clone())),
        }
    }

    /// Answers a call. Replaces images by links if the call asks for links.
    async fn answer(
        self,
        robot: Option<String>,
        call: Call,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        let (id, beside) = (self.id.clone(), self.beside.clone());
        let has_links = |formats: Formats| formats.images == Some(ImageFormat::Link);
        let [own, after] =
            [has_links(call.formats), call.then.as_ref().is_some_and(|look| has_links(look.formats))];
        let mut answer = self.answer_with_images(robot, call, keyed).await?;
        let step = answer.step.unwrap_or_default();
        if let (true, ToolReply::Look(LookReply::Observe(seen))) = (own, &mut answer.reply) {
            beside.images.link(&id, step, seen);
        }
        if let (true, Some(seen)) = (after, &mut answer.observation) {
            beside.images.link(&id, step, seen);
        }
        Ok(answer)
    }

    async fn answer_with_images(
        self,
        robot: Option<String>,
        call: Call,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        match (self.team(), robot, &call.tool) {
            (Some(_), Some(robot), _) => {
                let asked = RefusedCall::of(&call);
                let answer = self.operator(&robot)?.call(call, keyed).await;
                if let Err(refusal) = &answer
                    && refusal.is_of_the_team()
                {
                    self.thread.refused(Some(&robot), asked.because(refusal)).await;
                }
                answer
            }
            (_, _, ToolCall::Talk(_)) => Err(HostingError::NoTalk),
            (_, _, ToolCall::Look(_) | ToolCall::Act(_) | ToolCall::Plan(_) | ToolCall::Manage(_)) => {
                self.thread.ask(None, call, keyed, |answer| answer).await
            }
        }
    }
}

/// Returns the cache key of a request: the idempotency key, prefixed with the operator's robot. Keys of
/// different operators are therefore independent.
fn own_key(robot: Option<&str>, key: &str) -> String {
    format!("{}:{key}", robot.unwrap_or_default())
}
