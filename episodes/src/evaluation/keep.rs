//! Single episodes: each is kept in a file of its own, and taken from there by the next run if it is the same.

use std::path::{Path, PathBuf};

use super::{EvaluationError, Plan};
use crate::output::write_whole;
use crate::players::{Fared, Place, PlayError};
use crate::results::{Played, RESULT_FILE, missed};
use crate::spec::{EpisodeSpec, Start};
use crate::{CheckpointError, EpisodeError};

/// What became of an episode of the plan.
pub enum Outcome {
    /// Boxed, because the other is small.
    Played(Box<Played>),
    /// It could not be begun, and why.
    LeftOut(String),
}

/// The folder of single episodes, and what has to agree for one of them to be taken instead of played.
pub struct Keeper<'a> {
    pub plan: &'a Plan<'a>,
    pub folder: &'a Path,
    pub locomotion: String,
    pub build: &'static str,
}

impl Keeper<'_> {
    pub fn kept_or_played(&self, spec: &EpisodeSpec) -> Result<Outcome, EvaluationError> {
        if let Some(kept) = self.kept(spec) {
            return Ok(Outcome::Played(Box::new(kept)));
        }
        let folder = self.folder.join(name(spec));
        match self.plan.player.play_whole(spec, Place { folder: &folder, record: self.plan.record }) {
            Ok(fared) => self.keep(spec, fared).map(|played| Outcome::Played(Box::new(played))),
            Err(PlayError::Episode(EpisodeError::Checkpoint(CheckpointError::NoPhase { .. }))) => {
                Ok(Outcome::LeftOut("its demonstration did not come so far".into()))
            }
            Err(PlayError::NotReady(reason)) => Ok(Outcome::LeftOut(reason)),
            Err(PlayError::Episode(error)) => Err(error.into()),
            Err(PlayError::Lost(reason)) => Err(unrecorded(spec, reason)),
        }
    }

    /// An earlier run's episode, if it is this one: a file that is torn, renamed or from other rules counts as missing.
    pub fn kept(&self, spec: &EpisodeSpec) -> Option<Played> {
        let bytes = std::fs::read(self.folder.join(format!("{}.json", name(spec)))).ok()?;
        let kept: Played = serde_json::from_slice(&bytes).ok()?;
        let by = (&kept.by, kept.locomotion.as_str(), kept.build.as_str());
        let same = by == (&self.plan.player.card(), &self.locomotion, self.build)
            && kept.spec == *spec
            && (kept.result.task.as_str(), kept.result.seed) == (spec.task.id, spec.seed)
            && self.recording(spec).is_none_or(|folder| folder.join(RESULT_FILE).exists());
        same.then_some(kept)
    }

    /// Where the episode is recorded, if it is. Its `result.json` is written last.
    fn recording(&self, spec: &EpisodeSpec) -> Option<PathBuf> {
        self.plan.record.then(|| self.folder.join(name(spec)))
    }

    /// Writes what an episode came to.
    fn keep(&self, spec: &EpisodeSpec, fared: Fared) -> Result<Played, EvaluationError> {
        let Fared { result, thought, stopped } = fared;
        if let Some(reason) = result.recording_failed {
            return Err(unrecorded(spec, reason));
        }
        let played = Played {
            by: self.plan.player.card(),
            spec: spec.clone(),
            locomotion: self.locomotion.clone(),
            build: self.build.into(),
            note: stopped.or_else(|| missed(&result, spec.begun_phase())),
            thought_s: thought.as_secs_f64(),
            result,
        };
        let text = serde_json::to_string_pretty(&played)?;
        write_whole(&self.folder.join(format!("{}.json", name(spec))), text.as_bytes())?;
        Ok(played)
    }
}

fn unrecorded(spec: &EpisodeSpec, reason: String) -> EvaluationError {
    EvaluationError::Recording { task: spec.task.id, seed: spec.seed, reason }
}

/// What the episode's file and folder are called.
fn name(spec: &EpisodeSpec) -> String {
    let (task, seed) = (spec.task.id, spec.seed);
    match &spec.start {
        Start::Phase(start) => format!("{task}-{seed}-{}", start.phase),
        Start::Task | Start::Checkpoint(_) => format!("{task}-{seed}"),
    }
}
