//! Single episodes: each is kept in a file of its own, and taken from there by the next run if it is the same.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tandem_tools_spec::ResultReply;

use super::{EvaluationError, Plan};
use crate::error::CheckpointError;
use crate::output::write_whole;
use crate::players::InProcess;
use crate::reports::RESULT_FILE;
use crate::scoring::Phase;
use crate::spec::{EpisodeSpec, Start};
use crate::{EpisodeError, Session};

/// Folder of single episodes in the folder of an evaluation.
pub const EPISODES: &str = "episodes";

/// One episode that was played, as it is kept in a file of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Played {
    /// Name of the player.
    pub policy: String,
    pub spec: EpisodeSpec,
    /// Which base controller the robots had; the name tells files of different content apart.
    pub locomotion: String,
    /// Version and fingerprint of the program; what another build played is played again.
    pub build: String,
    #[serde(flatten)]
    pub result: ResultReply,
    /// How long the policy thought.
    #[serde(default)]
    pub thought_s: f64,
    /// Why the episode fell short: what stopped the policy, or the first phase that was missed.
    pub note: Option<String>,
}

impl Played {
    /// Index of the phase that it began at and that alone counts; `None` where it began at the task's beginning.
    pub fn begun_phase(&self) -> Option<usize> {
        begun_phase(&self.spec)
    }
}

fn begun_phase(spec: &EpisodeSpec) -> Option<usize> {
    match &spec.start {
        Start::Phase(start) => (0..spec.task.phases.len()).find(|phase| Phase::number(*phase) == start.phase),
        Start::Task | Start::Checkpoint(_) => None,
    }
}

/// The folder of single episodes, and what has to agree for one of them to be taken instead of played.
pub struct Keeper<'a> {
    pub plan: &'a Plan,
    pub folder: &'a Path,
    pub locomotion: String,
    pub build: &'static str,
}

impl Keeper<'_> {
    /// `None` where there is no such episode: the demonstration did not come to the phase that it begins at.
    pub fn kept_or_played(&self, spec: &EpisodeSpec) -> Result<Option<Played>, EvaluationError> {
        match self.kept(spec) {
            Some(kept) => Ok(Some(kept)),
            None => match self.play(spec) {
                Err(EvaluationError::Episode(EpisodeError::Checkpoint(CheckpointError::NoPhase {
                    ..
                }))) => Ok(None),
                played => played.map(Some),
            },
        }
    }

    /// An earlier run's episode, if it is this one: a file that is torn, renamed or from other rules counts as missing.
    pub fn kept(&self, spec: &EpisodeSpec) -> Option<Played> {
        let bytes = std::fs::read(self.folder.join(format!("{}.json", name(spec)))).ok()?;
        let kept: Played = serde_json::from_slice(&bytes).ok()?;
        let by = (kept.policy.as_str(), kept.locomotion.as_str(), kept.build.as_str());
        let same = by == (self.plan.player.name, &self.locomotion, self.build)
            && kept.spec == *spec
            && (kept.result.task.as_str(), kept.result.seed) == (spec.task.id, spec.seed)
            && self.recording(spec).is_none_or(|folder| folder.join(RESULT_FILE).exists());
        same.then_some(kept)
    }

    /// Where the episode is recorded, if it is. Its `result.json` is written last.
    fn recording(&self, spec: &EpisodeSpec) -> Option<PathBuf> {
        self.plan.record.then(|| self.folder.join(name(spec)))
    }

    fn play(&self, spec: &EpisodeSpec) -> Result<Played, EvaluationError> {
        let session = Session::start(spec, self.recording(spec).as_deref())?;
        let mut episode = match begun_phase(spec) {
            Some(phase) => InProcess::until(phase + 1, session),
            None => InProcess::new(session),
        };
        let outcome = self.plan.player.play(spec, &mut episode);
        let thought_s = episode.session.thought().as_secs_f64();
        let result = episode.session.close();
        if let Some(reason) = result.recording_failed.clone() {
            return Err(EvaluationError::Recording { task: spec.task.id, seed: spec.seed, reason });
        }
        let gave_up = outcome.err().map(|error| error.to_string());
        let fell_short = missed(&result, begun_phase(spec));
        let played = Played {
            policy: self.plan.player.name.into(),
            spec: spec.clone(),
            locomotion: self.locomotion.clone(),
            build: self.build.into(),
            note: gave_up.or(fell_short),
            thought_s,
            result,
        };
        let text = serde_json::to_string_pretty(&played)?;
        write_whole(&self.folder.join(format!("{}.json", name(spec))), text.as_bytes())?;
        Ok(played)
    }
}

/// What the episode's file and folder are called.
fn name(spec: &EpisodeSpec) -> String {
    let (task, seed) = (spec.task.id, spec.seed);
    match &spec.start {
        Start::Phase(start) => format!("{task}-{seed}-{}", start.phase),
        Start::Task | Start::Checkpoint(_) => format!("{task}-{seed}"),
    }
}

/// The first phase that was not reached; where one phase counts, that one.
pub fn missed(result: &ResultReply, counts: Option<usize>) -> Option<String> {
    let counted = |index: usize| counts.is_none_or(|only| only == index);
    let phases = result.phases.0.iter().enumerate();
    let (_, (phase, _)) =
        phases.filter(|(index, _)| counted(*index)).find(|(_, (_, time_s))| time_s.is_none())?;
    Some(format!("{phase} was not reached in {} steps", result.env_steps))
}
