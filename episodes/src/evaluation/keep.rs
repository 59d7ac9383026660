//! Single episodes: each is kept in a file of its own, and taken from there by the next run if it is the same.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tandem_tools_spec::ResultReply;

use super::{EvaluationError, Plan};
use crate::Session;
use crate::output::write_whole;
use crate::players::InProcess;
use crate::reports::RESULT_FILE;
use crate::spec::EpisodeSpec;
use crate::tasks::Task;

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
    /// Why the episode fell short: what stopped the policy, or the first phase that was missed.
    pub note: Option<String>,
}

/// The folder of single episodes, and what has to agree for one of them to be taken instead of played.
pub struct Keeper<'a> {
    pub plan: &'a Plan,
    pub folder: &'a Path,
    pub locomotion: String,
    pub build: &'static str,
}

impl Keeper<'_> {
    pub fn kept_or_played(&self, task: &'static Task, seed: u32) -> Result<Played, EvaluationError> {
        match self.kept(task, seed) {
            Some(kept) => Ok(kept),
            None => self.play(task, seed),
        }
    }

    /// An earlier run's episode, if it is this one: a file that is torn, renamed or from other rules counts as missing.
    pub fn kept(&self, task: &'static Task, seed: u32) -> Option<Played> {
        let bytes = std::fs::read(self.folder.join(file_name(task, seed))).ok()?;
        let kept: Played = serde_json::from_slice(&bytes).ok()?;
        let by = (kept.policy.as_str(), kept.locomotion.as_str(), kept.build.as_str());
        let same = by == (self.plan.player.name, &self.locomotion, self.build)
            && kept.spec == self.plan.spec(task, seed)
            && (kept.result.task.as_str(), kept.result.seed) == (task.id, seed)
            && self.recording(task, seed).is_none_or(|folder| folder.join(RESULT_FILE).exists());
        same.then_some(kept)
    }

    /// Where the episode is recorded, if it is. Its `result.json` is written last.
    fn recording(&self, task: &Task, seed: u32) -> Option<PathBuf> {
        self.plan.record.then(|| self.folder.join(format!("{}-{seed}", task.id)))
    }

    fn play(&self, task: &'static Task, seed: u32) -> Result<Played, EvaluationError> {
        let spec = self.plan.spec(task, seed);
        let session = Session::start(&spec, self.recording(task, seed).as_deref())?;
        let mut episode = InProcess(session);
        let outcome = self.plan.player.play(&spec, &mut episode);
        let result = episode.0.close();
        if let Some(reason) = result.recording_failed.clone() {
            return Err(EvaluationError::Recording { task: task.id, seed, reason });
        }
        let played = Played {
            policy: self.plan.player.name.into(),
            spec,
            locomotion: self.locomotion.clone(),
            build: self.build.into(),
            note: outcome.err().map(|error| error.to_string()).or_else(|| missed(&result)),
            result,
        };
        let text = serde_json::to_string_pretty(&played)?;
        write_whole(&self.folder.join(file_name(task, seed)), text.as_bytes())?;
        Ok(played)
    }
}

fn file_name(task: &Task, seed: u32) -> String {
    format!("{}-{seed}.json", task.id)
}

/// The first phase that was not reached.
pub fn missed(result: &ResultReply) -> Option<String> {
    let (phase, _) = result.phases.0.iter().find(|(_, time_s)| time_s.is_none())?;
    Some(format!("{phase} was not reached in {} steps", result.env_steps))
}
