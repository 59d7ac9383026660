//! What the thread of an episode does for somebody.

use std::{sync::Arc, time::Duration};

use tandem_episodes::{OperatorCall, OperatorCommand, live::LiveView};
use tandem_tools_spec::{Briefing, Call, EndReason, Note, ResultReply};
use tokio::sync::oneshot;

use super::{PanicGuard, status::SharedStatus};
use crate::hosting::{
    Answer, HostingError, RefusedCall,
    durable::{Heading, Keyed},
};

/// All of it happens between two other jobs.
pub enum Job {
    Call {
        /// The robot whose operator calls; `None` where one policy directs all.
        operator: Option<String>,
        call: Box<Call>,
        keyed: Option<Keyed>,
        told: Tell<Answer>,
        reply: ReplySender<Answer>,
    },
    ReadCommand {
        call: Box<OperatorCall>,
        reply: ReplySender<OperatorCommand>,
    },
    Together {
        commands: Vec<OperatorCommand>,
        /// By command.
        keyed: Vec<Option<Keyed>>,
        told: Tell<Vec<Answer>>,
        reply: ReplySender<Vec<Answer>>,
    },
    /// Keeps an answer that was made of several.
    KeepAnswer {
        keyed: Keyed,
        answer: Box<Answer>,
        reply: ReplySender<Answer>,
    },
    Note {
        operator: Option<String>,
        note: Box<Note>,
        key: Option<String>,
        reply: ReplySender<()>,
    },
    /// Keeps a call that was refused on its way here.
    Refused {
        operator: Option<String>,
        call: Box<RefusedCall>,
        reply: ReplySender<()>,
    },
    Status {
        reply: ReplySender<Answer>,
    },
    Briefing {
        reply: ReplySender<Briefing>,
    },
    /// For experts, scoring and clients of policies in this process.
    Work(Work),
    EndIfAbandoned {
        idle: Duration,
    },
    End {
        reason: EndReason,
    },
    Watch {
        /// The operator of this robot looks on, which is recorded.
        operator: Option<String>,
        reply: ReplySender<LiveView>,
    },
    /// Begins the journal from which the episode can be brought back.
    BeginJournal {
        heading: Box<Heading>,
        reply: ReplySender<()>,
    },
    /// Answers as soon as the episode is there.
    Awake {
        reply: ReplySender<()>,
    },
    /// Puts the episode aside until the next job.
    Sleep,
    Close {
        /// Whether it is to be brought back by who serves next.
        keep: bool,
        reply: ReplySender<ResultReply>,
    },
}

/// A job that knows the session.
pub type Work = Box<dyn FnOnce(WorkOn) + Send>;

/// What a [`Work`] is for: the session, or why it cannot be had.
pub type WorkOn<'a> = Result<(&'a mut PanicGuard, &'a SharedStatus), HostingError>;

/// Makes of what was answered what is told, before it is written down.
pub type Tell<T> = Box<dyn FnOnce(Result<T, HostingError>) -> Result<T, HostingError> + Send>;

pub type ReplySender<T> = oneshot::Sender<Result<T, HostingError>>;

impl Job {
    /// Tells who waits for it that the episode cannot be had.
    pub fn refuse(self, why: &Arc<HostingError>) {
        let shared = || HostingError::Shared(why.clone());
        // Who asked may have gone.
        match self {
            Job::Call { reply, .. } | Job::KeepAnswer { reply, .. } | Job::Status { reply } => {
                drop(reply.send(Err(shared())));
            }
            Job::Together { told, reply, .. } => drop(reply.send(told(Err(shared())))),
            Job::ReadCommand { reply, .. } => drop(reply.send(Err(shared()))),
            Job::Note { reply, .. }
            | Job::Refused { reply, .. }
            | Job::BeginJournal { reply, .. }
            | Job::Awake { reply } => drop(reply.send(Err(shared()))),
            Job::Briefing { reply } => drop(reply.send(Err(shared()))),
            Job::Watch { reply, .. } => drop(reply.send(Err(shared()))),
            Job::Close { reply, .. } => drop(reply.send(Err(shared()))),
            Job::Work(work) => work(Err(shared())),
            Job::EndIfAbandoned { .. } | Job::End { .. } | Job::Sleep => {}
        }
    }
}
