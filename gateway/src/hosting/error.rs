//! Errors with which the host of episodes refuses requests.

use std::{io, path::PathBuf, sync::Arc};

use tandem_episodes::{EpisodeError, players::PlayerError};
use tandem_tools_spec::{Refusal, RefusalClass};

use crate::token::TokenError;

/// Refusal by the host, or refusal by an episode that the host passes on.
#[derive(Debug, thiserror::Error)]
pub enum HostingError {
    /// The episode refused the call.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// The episode does not exist. The error does not list existing episodes, because their ids are known
    /// only to their callers.
    #[error("no episode {id:?}")]
    UnknownEpisode {
        /// Requested id.
        id: String,
    },
    /// The episode limit is reached.
    #[error("all {limit} places for episodes are taken")]
    TooManyEpisodes {
        /// Maximum number of episodes.
        limit: u32,
    },
    /// Too many calls are waiting for one episode.
    #[error("{limit} calls already wait for this episode; call again when one of them has answered")]
    TooManyWaiting {
        /// Maximum number of waiting calls.
        limit: usize,
    },
    /// The server is shutting down.
    #[error("the server is shutting down and takes no new episodes; try again when it is back")]
    ShuttingDown,
    /// Another episode has this id.
    #[error("an episode {id:?} is held already")]
    HeldAlready {
        /// Id of both episodes.
        id: String,
    },
    /// The linked image is no longer kept, or another operator's robot took it.
    #[error(
        "no image {name:?} of yours is kept, only the latest {kept} that replies of this episode linked to; \
         observe again"
    )]
    NoImage {
        /// Name of the image in the link.
        name: String,
        /// Number of images that are kept.
        kept: usize,
    },
    /// Another server on the same runs folder plays the episode.
    #[error("episode {id:?} is played by {url:?}; ask there")]
    HeldElsewhere {
        /// Requested id.
        id: String,
        /// URL of the server that plays the episode.
        url: String,
    },
    /// The episode was begun by another build; only that build restores the same state.
    #[error(
        "this episode was begun by build {made_by} of the server and this is {this}, which would not bring \
         it to the same state; start that build on the same runs folder to go on, or DELETE the episode; \
         what was recorded is in {}", .folder.display()
    )]
    OtherBuild {
        /// Build that began the episode.
        made_by: String,
        /// Build of this server.
        this: &'static str,
        /// Folder of the recording.
        folder: PathBuf,
    },
    /// The journal of the episode cannot be read or written.
    #[error("the journal {}: {source}", .path.display())]
    Journal {
        /// Path of the journal.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The episode was closed meanwhile.
    #[error("the episode has stopped")]
    EpisodeStopped,
    /// The episode's thread panicked.
    #[error(
        "the simulator failed in this episode and the episode ends here; its recording holds what went before"
    )]
    EpisodePanicked,
    /// The operator has already given its command for this step.
    #[error(
        "robot {robot:?} has its command for this step already; its reply comes when {}",
        waiting_text(.waits_for)
    )]
    DoubleCommand {
        /// The operator's robot.
        robot: String,
        /// Robots whose operators have not commanded yet.
        waits_for: Vec<String>,
    },
    /// The operator gave no command within the time limit, and has not been notified of the hold yet.
    #[error(
        "robot {robot:?} was held still from step {from_step} to {to_step}, because the others' patience ran \
         out before a command came; look again, then command"
    )]
    LateCommand {
        /// The operator's robot.
        robot: String,
        /// First step of the hold.
        from_step: u32,
        /// Last step of the hold, which is the current one.
        to_step: u32,
    },
    /// The operator has called finish.
    #[error(
        "robot {robot:?} has finished and holds still until the others have, too; observe and get_status \
         still answer"
    )]
    OperatorFinished {
        /// The operator's robot.
        robot: String,
    },
    /// An operator commanded after its thinking time had run out.
    #[error(
        "the operator of robot {robot:?} has thought for {limit_s} s, which is all that it may; its robot \
         holds still, the others play on, and observe and get_status still answer"
    )]
    OperatorOutOfTime {
        /// The operator's robot.
        robot: String,
        /// Limit of an operator's thinking time in seconds.
        limit_s: u64,
    },
    /// A call came without an operator's token, but each robot of the episode has an operator.
    #[error(
        "each robot of this episode is driven by its own operator; send its token, which the start of the \
         episode returned, as Authorization: Bearer TOKEN"
    )]
    NeedsOperator,
    /// An operator's request concerns more than the operator's robot.
    #[error(
        "an operator looks through its robot and commands it; this request is for who started the episode"
    )]
    HostsBusiness,
    /// One policy controls all robots of the episode, so no other driver can take over a robot.
    #[error(
        "one policy directs all robots of this episode; start one and add \"operators\": \"per_robot\" for \
         somebody else to drive one of them"
    )]
    OnePolicy,
    /// A client tried to start an episode, but this server only holds the episode of an evaluation.
    #[error(
        "this server holds the one episode that an evaluation scores, and starts no other; play the one that \
         your brief and the environment's TANDEM_EPISODE name"
    )]
    OneEpisode,
    /// An expert or a policy was requested to replace a person in a collection.
    #[error(
        "in a collection people drive, and nobody else in their place; demonstrations of the expert are \
         tandem collect's without --operators"
    )]
    PeopleDrive,
    /// No expert of this process can drive a robot of this task.
    #[error("{0}")]
    NoExpert(#[source] PlayerError),
    /// No policy can drive a robot on this server.
    #[error("{reason}")]
    NoPolicy {
        /// Reason why no policy can drive.
        reason: String,
    },
    /// Messages between operators are not enabled in this episode.
    #[error(
        "nobody hears you: operators talk in an episode that was started with operators \"per_robot\" and \
         talk true"
    )]
    NoTalk,
    /// A recipient has too many unread messages.
    #[error(
        "robot {robot:?} has {unheard} messages that its operator has not heard yet; say more after its next \
         call"
    )]
    TooMuchSaid {
        /// Recipient's robot.
        robot: String,
        /// Number of unread messages.
        unheard: usize,
    },
    /// The idempotency key was used for a different request before.
    #[error(
        "this Idempotency-Key came with another request before; a key stands for one request, so take a new \
         one for each"
    )]
    KeyUsed,
    /// No token could be generated for an operator.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A refusal that several callers share.
    #[error(transparent)]
    Shared(Arc<HostingError>),
    /// The operating system could not start a thread for the episode.
    #[error("no thread for an episode: {0}")]
    Thread(#[source] io::Error),
}

impl HostingError {
    /// Returns the refusal to send to the caller.
    pub fn refusal(&self) -> Refusal {
        use RefusalClass::{
            Conflict, Elsewhere, Failed, Forbidden, Gone, Invalid, NotFound, TooMany, Unavailable,
        };
        match self {
            HostingError::Episode(error) => error.refusal(),
            HostingError::UnknownEpisode { .. } => {
                Refusal::new("unknown-episode", "Unknown episode", NotFound).hint(
                    "is this the server that started it? start_episode (POST /v1/episodes) starts another",
                )
            }
            HostingError::NoImage { .. } => Refusal::new("no-image", "No such image", NotFound),
            HostingError::TooManyEpisodes { .. } => {
                Refusal::new("too-many-episodes", "Too many episodes", TooMany)
                    .retry_after_s(10)
                    .hint("finish or DELETE one, or try again later")
            }
            HostingError::TooManyWaiting { .. } => {
                Refusal::new("too-many-calls", "Too many calls at once", TooMany).retry_after_s(1)
            }
            HostingError::ShuttingDown => {
                Refusal::new("shutting-down", "Shutting down", Unavailable).retry_after_s(60)
            }
            HostingError::HeldElsewhere { .. } => {
                Refusal::new("held-elsewhere", "Played elsewhere", Elsewhere)
            }
            HostingError::OtherBuild { .. } => {
                Refusal::new("other-build", "Begun by another build", Conflict)
            }
            HostingError::EpisodeStopped => {
                Refusal::new("episode-stopped", "Episode stopped", Gone).hint(START_ANOTHER)
            }
            HostingError::EpisodePanicked => {
                Refusal::new("episode-failed", "The simulator failed", Failed).hint(START_ANOTHER)
            }
            HostingError::DoubleCommand { .. } => Refusal::new("double-command", "Commanded twice", Conflict),
            HostingError::LateCommand { .. } => Refusal::new("late-command", "Commanded late", Conflict),
            HostingError::OperatorFinished { .. } => {
                Refusal::new("operator-finished", "Operator has finished", Conflict)
            }
            HostingError::OperatorOutOfTime { .. } => Refusal::new("out-of-time", "Out of time", Conflict),
            HostingError::NeedsOperator => Refusal::new("needs-operator", "Driven by operators", Forbidden),
            HostingError::HostsBusiness => Refusal::new("hosts-business", "Not for operators", Forbidden),
            HostingError::OneEpisode => Refusal::new("one-episode", "No other episode", Forbidden),
            HostingError::PeopleDrive => Refusal::new("people-drive", "People drive", Forbidden),
            HostingError::OnePolicy => Refusal::new("one-policy", "One policy directs all", Conflict),
            HostingError::NoExpert(_) => Refusal::new("no-expert", "No expert", Invalid),
            HostingError::NoPolicy { .. } => Refusal::new("no-policy", "No policy", Conflict),
            HostingError::NoTalk => Refusal::new("no-talk", "Nobody hears", Conflict),
            HostingError::TooMuchSaid { .. } => {
                Refusal::new("too-much-said", "Too much said", TooMany).retry_after_s(1)
            }
            HostingError::KeyUsed => Refusal::new("key-used", "Key used", Invalid),
            HostingError::Shared(error) => error.refusal(),
            HostingError::HeldAlready { .. }
            | HostingError::Journal { .. }
            | HostingError::Token(_)
            | HostingError::Thread(_) => Refusal::INTERNAL,
        }
    }

    /// Returns true if the rules for operators blocked the call, so that it has not reached the episode.
    pub fn is_of_the_team(&self) -> bool {
        match self {
            HostingError::DoubleCommand { .. }
            | HostingError::LateCommand { .. }
            | HostingError::OperatorFinished { .. }
            | HostingError::OperatorOutOfTime { .. }
            | HostingError::NoTalk
            | HostingError::TooMuchSaid { .. }
            | HostingError::Episode(EpisodeError::ForeignRobot { .. }) => true,
            HostingError::Episode(_)
            | HostingError::UnknownEpisode { .. }
            | HostingError::NoImage { .. }
            | HostingError::TooManyEpisodes { .. }
            | HostingError::TooManyWaiting { .. }
            | HostingError::ShuttingDown
            | HostingError::HeldAlready { .. }
            | HostingError::HeldElsewhere { .. }
            | HostingError::OtherBuild { .. }
            | HostingError::Journal { .. }
            | HostingError::EpisodeStopped
            | HostingError::EpisodePanicked
            | HostingError::NeedsOperator
            | HostingError::HostsBusiness
            | HostingError::OneEpisode
            | HostingError::PeopleDrive
            | HostingError::OnePolicy
            | HostingError::NoExpert(_)
            | HostingError::NoPolicy { .. }
            | HostingError::KeyUsed
            | HostingError::Token(_)
            | HostingError::Shared(_)
            | HostingError::Thread(_) => false,
        }
    }

    /// Returns true if another server plays the episode, or if the episode does not exist.
    pub fn is_elsewhere(&self) -> bool {
        match self {
            HostingError::HeldElsewhere { .. } | HostingError::UnknownEpisode { .. } => true,
            HostingError::Shared(error) => error.is_elsewhere(),
            _ => false,
        }
    }

    /// Returns true if only another build can continue the episode.
    pub fn is_of_other_build(&self) -> bool {
        match self {
            HostingError::OtherBuild { .. } => true,
            HostingError::Shared(error) => error.is_of_other_build(),
            _ => false,
        }
    }

    /// Returns the URL of the other server that plays the episode; `None` for other errors.
    pub fn elsewhere(&self) -> Option<&str> {
        match self {
            HostingError::HeldElsewhere { url, .. } => Some(url),
            HostingError::Shared(error) => error.elsewhere(),
            _ => None,
        }
    }

    /// Returns true if the same request will be refused again.
    pub fn is_final(&self) -> bool {
        self.refusal().retry_after_s.is_none()
    }
}

const START_ANOTHER: &str = "start another with start_episode (POST /v1/episodes)";

fn waiting_text(waits_for: &[String]) -> String {
    match waits_for {
        [] => "the step is made".into(),
        robots => format!("{} commands, too, or the patience ends", robots.join(" and ")),
    }
}
