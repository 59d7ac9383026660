//! Policies that play the episodes of an evaluation: a built-in player, or an external policy.

mod open_loop;

use std::any::Any;
use std::fmt::{self, Debug};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Duration;

use tandem_episodes::players::{InProcess, LocalEpisode, PlayerEntry, PlayerError};
use tandem_episodes::{EpisodeError, EpisodeSpec, RunFolder, Session, monotonic};
use tandem_tools_spec::{EndReason, ResultReply};

pub use open_loop::{OpenLoop, OpenLoopError};

use crate::results::PolicyCard;

/// A policy that plays episodes, several of them in parallel.
pub trait Policy: Debug + Send + Sync {
    /// Returns the description of the policy for results.
    fn card(&self) -> PolicyCard;

    /// Plays `spec` from its start to its end.
    fn play_episode(&self, spec: &EpisodeSpec, output: EpisodeOutput) -> Result<PlayOutcome, PlayError>;

    /// Returns the reason why an episode cannot begin yet; `None` if the policy is ready.
    fn waiting(&self) -> Option<PolicyWait> {
        None
    }

    /// Returns `true` if the user has interrupted the policy.
    fn is_interrupted(&self) -> bool {
        false
    }
}

/// A remote policy that can drive one robot of an episode. It computes commands for all robots, but only
/// those for its own robot are executed.
pub trait PartnerPolicy: Debug + Send + Sync {
    /// Returns the name by which people select the policy and recordings identify it.
    fn name(&self) -> String;

    /// Connects for an episode of `spec`, calls `connected` once connected, and plays.
    ///
    /// # Errors
    ///
    /// Returns a [`PlayError`] if it cannot connect. The inner [`PlayerError`] is the reason why the play
    /// ended.
    fn play(
        &self,
        spec: &EpisodeSpec,
        episode: &mut dyn LocalEpisode,
        connected: &mut dyn FnMut(),
    ) -> Result<Result<(), PlayerError>, PlayError>;
}

/// A wait of a policy, with its reason and duration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PolicyWait {
    /// Subject of the wait, for example the addresses of the policy's servers.
    pub target: String,
    pub lasted: Duration,
}

impl fmt::Display for PolicyWait {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "waiting for {}, {} s", self.target, self.lasted.as_secs())
    }
}

/// Destination of an episode's files.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeOutput<'a> {
    /// The folder for this episode alone, which does not exist yet.
    pub folder: &'a Path,
    /// True if the episode is to be recorded there.
    pub record: bool,
    /// True if a recorded episode also gets an image strip and a page.
    pub pages: bool,
}

impl<'a> EpisodeOutput<'a> {
    /// Returns the folder of the recording; `None` if the episode is not recorded.
    pub fn recording(self) -> Option<&'a Path> {
        self.record.then_some(self.folder)
    }

    /// Returns the run folder of the recording, with its option for pages.
    fn run_folder(self) -> Option<RunFolder> {
        self.recording().map(|folder| RunFolder { pages: self.pages, ..RunFolder::from(folder) })
    }
}

/// Outcome of an episode that a policy played.
#[derive(Debug)]
pub struct PlayOutcome {
    pub result: ResultReply,
    /// The policy's thinking time.
    pub thought: Duration,
    /// Reason why it stopped before the episode's end; `None` if it did not.
    pub stopped: Option<String>,
}

/// Reason why an episode has no result.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// The policy was not ready, so no episode was played. A later attempt may succeed.
    #[error("{0}")]
    NotReady(String),
    /// The policy is absent, so it can play neither this episode nor any other.
    #[error("{0}")]
    Absent(String),
    /// The episode was played, but its outcome is lost.
    #[error("{0}")]
    Lost(String),
}

impl Policy for PlayerEntry {
    fn card(&self) -> PolicyCard {
        self.name.into()
    }

    fn play_episode(&self, spec: &EpisodeSpec, output: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        self.check(spec).map_err(|error| PlayError::NotReady(error.to_string()))?;
        Ok(play_in_process(spec, output, |episode| self.play(spec, episode))?)
    }
}

/// Plays `spec` in this process; `act` makes the calls. An episode that ends during a call is no error. A
/// panic counts as a failure of the policy, and ends only this episode.
pub fn play_in_process(
    spec: &EpisodeSpec,
    output: EpisodeOutput,
    act: impl FnOnce(&mut InProcess) -> Result<(), PlayerError>,
) -> Result<PlayOutcome, EpisodeError> {
    let session = Session::start_with_clock(spec, output.run_folder(), monotonic())?;
    let mut episode = match spec.start_phase() {
        Some(phase) => InProcess::until(phase + 1, session),
        None => InProcess::new(session),
    };
    let acted = match episode.session.recording_failed() {
        // A caller that requests a recording has no use for an unrecorded episode.
        Some(reason) => Err(PlayerError::GaveUp(reason.into())),
        None => catch_unwind(AssertUnwindSafe(|| act(&mut episode))).unwrap_or_else(|panic| {
            Err(PlayerError::Failed(format!("it panicked: {}", panic_text(&*panic))))
        }),
    };
    let stopped = match acted {
        Ok(()) | Err(PlayerError::EpisodeOver) => None,
        Err(error) => {
            if let PlayerError::Failed(_) = error {
                episode.session.end(EndReason::PolicyFailed);
            }
            Some(error.to_string())
        }
    };
    let thought = episode.session.thought();
    Ok(PlayOutcome { result: episode.session.close(), thought, stopped })
}

/// Returns the message of a panic.
fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let literal = || panic.downcast_ref::<&str>().copied();
    panic.downcast_ref::<String>().map(String::as_str).or_else(literal).unwrap_or("without a word")
}

#[cfg(test)]
mod tests {
    use tandem_tools_spec::Protocol;

    use super::*;
    use tandem_episodes::tasks;

    #[test]
    fn a_panic_of_a_player_ends_its_episode_as_a_failed_policy() {
        let spec = EpisodeSpec::new(&tasks::find("handover").unwrap(), 2000, Protocol::Benchmark);
        let output = EpisodeOutput { folder: Path::new(""), record: false, pages: false };
        let played = play_in_process(&spec, output, |_| panic!("no plan for seed {}", 2000)).unwrap();
        assert_eq!(played.result.ended, EndReason::PolicyFailed);
        assert_eq!(played.stopped.as_deref(), Some("it panicked: no plan for seed 2000"));
    }
}
