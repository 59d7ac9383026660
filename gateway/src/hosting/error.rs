//! Why the host of episodes refuses.

use std::{io, path::PathBuf, sync::Arc};

use tandem_episodes::{EpisodeError, players::PlayerError};
use tandem_tools_spec::{Refusal, RefusalClass};

use crate::token::TokenError;

/// Refusals of the host, and those of the episode that it passes on.
#[derive(Debug, thiserror::Error)]
pub enum HostingError {
    /// The episode refused.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// No such episode. Which there are is their callers' business.
    #[error("no episode {id:?}")]
    UnknownEpisode {
        /// What was asked for.
        id: String,
    },
    /// Every place for an episode is taken.
    #[error("all {limit} places for episodes are taken")]
    TooManyEpisodes {
        /// How many places there are.
        limit: u32,
    },
    /// Too many calls wait for one episode.
    #[error("{limit} calls already wait for this episode; call again when one of them has answered")]
    TooManyWaiting {
        /// How many may wait.
        limit: usize,
    },
    /// The server is going down.
    #[error("the server is shutting down and takes no new episodes; try again when it is back")]
    ShuttingDown,
    /// Another episode has this id.
    #[error("an episode {id:?} is held already")]
    HeldAlready {
        /// The id of both.
        id: String,
    },
    /// Another server on the same folder of runs plays the episode.
    #[error("episode {id:?} is played by {url:?}; ask there")]
    HeldElsewhere {
        /// What was asked for.
        id: String,
        /// Where it is played.
        url: String,
    },
    /// The episode was begun by another build, which alone brings it to the same state.
    #[error(
        "this episode was begun by build {made_by} of the server and this is {this}, which would not bring it to the same state; start that build on the same runs folder to go on, or DELETE the episode; what was recorded is in {}", .folder.display()
    )]
    OtherBuild {
        /// The build that began it.
        made_by: String,
        /// This one.
        this: &'static str,
        /// Where it is recorded.
        folder: PathBuf,
    },
    /// The journal from which the episode is to be brought back cannot be read or written.
    #[error("the journal {}: {source}", .path.display())]
    Journal {
        /// The file.
        path: PathBuf,
        /// What the system said.
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
    /// The operator has commanded already.
    #[error(
        "robot {robot:?} has its command for this step already; its reply comes when {}",
        waiting_text(.waits_for)
    )]
    DoubleCommand {
        /// The operator's robot.
        robot: String,
        /// The robots whose operators have not commanded yet.
        waits_for: Vec<String>,
    },
    /// The operator has let the others' patience run out, and does not know it yet.
    #[error(
        "robot {robot:?} was held still from step {from_step} to {to_step}, because the others' patience ran out before a command came; look again, then command"
    )]
    LateCommand {
        /// The operator's robot.
        robot: String,
        /// Where it was held first.
        from_step: u32,
        /// Where it was held last, which is now.
        to_step: u32,
    },
    /// The operator has called finish.
    #[error(
        "robot {robot:?} has finished and holds still until the others have, too; observe and get_status still answer"
    )]
    OperatorFinished {
        /// The operator's robot.
        robot: String,
    },
    /// A call on an episode whose robots have operators, by none of them.
    #[error(
        "each robot of this episode is driven by its own operator; send its token, which the start of the episode returned, as Authorization: Bearer TOKEN"
    )]
    NeedsOperator,
    /// A request of an operator that concerns more than its robot.
    #[error(
        "an operator looks through its robot and commands it; this request is for who started the episode"
    )]
    HostsBusiness,
    /// Somebody else is to drive one robot of an episode whose robots one policy directs.
    #[error(
        "one policy directs all robots of this episode; start one and add \"operators\": \"per_robot\" for somebody else to drive one of them"
    )]
    OnePolicy,
    /// A client would start an episode where an evaluation in this process has the only one.
    #[error(
        "this server holds the one episode that an evaluation scores, and starts no other; play the one that your brief and the environment's TANDEM_EPISODE name"
    )]
    OneEpisode,
    /// A program of this process would drive in a person's place.
    #[error(
        "in a collection people drive, and nobody else in their place; demonstrations of the expert are tandem collect's without --operators"
    )]
    PeopleDrive,
    /// Nobody here can drive a robot of this task.
    #[error("{0}")]
    NoExpert(#[source] PlayerError),
    /// No policy can drive a robot here.
    #[error("{reason}")]
    NoPolicy {
        /// What is missing.
        reason: String,
    },
    /// Nobody may talk here.
    #[error(
        "nobody hears you: operators talk in an episode that was started with operators \"per_robot\" and talk true"
    )]
    NoTalk,
    /// Somebody has not heard what was said before.
    #[error(
        "robot {robot:?} has {unheard} messages that its operator has not heard yet; say more after its next call"
    )]
    TooMuchSaid {
        /// The robot of who does not listen.
        robot: String,
        /// How many wait.
        unheard: usize,
    },
    /// The key of a request that was another one.
    #[error(
        "this Idempotency-Key came with another request before; a key stands for one request, so take a new one for each"
    )]
    KeyUsed,
    /// No token for an operator.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A refusal of several callers at once.
    #[error(transparent)]
    Shared(Arc<HostingError>),
    /// The system gives no thread for the world.
    #[error("no thread for an episode: {0}")]
    Thread(#[source] io::Error),
}

impl HostingError {
    /// What this error is to its caller.
    pub fn refusal(&self) -> Refusal {
        use RefusalClass::{
            Conflict, Elsewhere, Failed, Forbidden, Gone, Invalid, NotFound, TooMany, Unavailable,
        };
        match self {
            HostingError::Episode(error) => error.refusal(),
            HostingError::UnknownEpisode { .. } => {
                Refusal::new("unknown-episode", "Unknown episode", NotFound)
                    .hint("start_episode (POST /v1/episodes) starts one")
            }
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
            HostingError::DoubleCommand { .. } => {
                Refusal::new("double-command", "Commanded already", Conflict)
            }
            HostingError::LateCommand { .. } => Refusal::new("late-command", "Commanded late", Conflict),
            HostingError::OperatorFinished { .. } => {
                Refusal::new("operator-finished", "Operator has finished", Conflict)
            }
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

    /// Whether operators' turns were in the way, so that the call has not reached the episode.
    pub fn is_of_the_team(&self) -> bool {
        match self {
            HostingError::DoubleCommand { .. }
            | HostingError::LateCommand { .. }
            | HostingError::OperatorFinished { .. }
            | HostingError::NoTalk
            | HostingError::TooMuchSaid { .. }
            | HostingError::Episode(EpisodeError::ForeignRobot { .. }) => true,
            HostingError::Episode(_)
            | HostingError::UnknownEpisode { .. }
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

    /// Whether the episode is another server's, or nobody's any more.
    pub fn is_elsewhere(&self) -> bool {
        match self {
            HostingError::HeldElsewhere { .. } | HostingError::UnknownEpisode { .. } => true,
            HostingError::Shared(error) => error.is_elsewhere(),
            _ => false,
        }
    }

    /// Whether another build alone can go on with the episode.
    pub fn is_of_other_build(&self) -> bool {
        match self {
            HostingError::OtherBuild { .. } => true,
            HostingError::Shared(error) => error.is_of_other_build(),
            _ => false,
        }
    }

    /// Where the episode is played, if another server plays it.
    pub fn elsewhere(&self) -> Option<&str> {
        match self {
            HostingError::HeldElsewhere { url, .. } => Some(url),
            HostingError::Shared(error) => error.elsewhere(),
            _ => None,
        }
    }

    /// Whether the same request will be refused again.
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
