//! Jobs for the thread of an episode.

use std::{sync::Arc, time::Duration};

use tandem_episodes::{OperatorCall, OperatorCommand, live::LiveView};
use tandem_tools_spec::{Briefing, Call, EndReason, Note, ResultReply};
use tokio::sync::oneshot;

use super::{PanicGuard, status::SharedStatus};
use crate::hosting::{
    Answer, HostingError, RefusedCall,
    durable::{Heading, Keyed},
};

/// A unit of work. No other job runs while it does.
pub enum Job {
    Call {
        /// Robot whose operator calls; `None` if one policy controls all robots.
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
        /// Idempotency keys, one entry for each command.
        keyed: Vec<Option<Keyed>>,
        told: Tell<Vec<Answer>>,
        reply: ReplySender<Vec<Answer>>,
    },
    /// Storage of an answer that was combined from several.
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
    /// Record of a call that was refused before it arrived here.
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
    /// Used by experts, scoring and clients of policies in this process.
    Work(Work),
    EndIfAbandoned {
        idle: Duration,
    },
    End {
        reason: EndReason,
    },
    Watch {
        /// Robot whose operator watches, which is recorded.
        operator: Option<String>,
        reply: ReplySender<LiveView>,
    },
    /// Start of the journal from which the episode can be brought back.
    BeginJournal {
        heading: Box<Heading>,
        reply: ReplySender<()>,
    },
    /// A request that is answered as soon as the episode is awake.
    Awake {
        reply: ReplySender<()>,
    },
    /// Sleep until the next job.
    Sleep,
    Close {
        /// True if the next server is to bring the episode back.
        keep: bool,
        reply: ReplySender<ResultReply>,
    },
}

/// A job with access to the session.
pub type Work = Box<dyn FnOnce(WorkOn) + Send>;

/// Argument of a [`Work`]: the session, or the reason why there is none.
pub type WorkOn<'a> = Result<(&'a mut PanicGuard, &'a SharedStatus), HostingError>;

/// Conversion of an outcome into the caller's answer, before it is written to the journal.
pub type Tell<T> = Box<dyn FnOnce(Result<T, HostingError>) -> Result<T, HostingError> + Send>;

pub type ReplySender<T> = oneshot::Sender<Result<T, HostingError>>;

impl Job {
    /// Replies to the waiting caller that the episode is not available.
    pub fn refuse(self, why: &Arc<HostingError>) {
        let shared = || HostingError::Shared(why.clone());
        // The caller may have gone.
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
