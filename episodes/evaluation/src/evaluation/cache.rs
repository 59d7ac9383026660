//! Cache of single episodes. Each episode has a file, which the next run uses if the episode is the same.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use tandem_episodes::{
    CheckpointError, EpisodeError, EpisodeSpec, FileLock, LockKind, Locking, RESULT_FILE, Recorder, Start,
    write_whole,
};
use tandem_tools_spec::{EndReason, ResultReply};

use super::retry::again_name;
use super::{EvaluationError, EvaluationPlan, KeptFiles};
use crate::policies::{EpisodeOutput, PlayError, PlayOutcome};
use crate::results::{Attempt, PlayedEpisode, episode_note, failures_of_policy, utc_text};

/// Outcome of a planned episode.
pub enum PlannedOutcome {
    /// An earlier run has played it. Boxed to keep the enum small.
    Kept(Box<PlayedEpisode>),
    Played(Box<PlayedEpisode>),
    /// It could not be started, for this reason.
    LeftOut(String),
    /// Another process plays it.
    Elsewhere,
}

/// The folder of single episodes, and the properties on which reuse of an episode depends.
#[derive(Clone)]
pub struct EpisodeCache<'a> {
    pub plan: &'a EvaluationPlan<'a>,
    pub folder: PathBuf,
    pub locomotion: String,
    pub build: &'static str,
    /// Builds whose results are reused.
    pub builds: Vec<String>,
}

impl EpisodeCache<'_> {
    /// Returns the episode from the cache, or plays it now. If another process plays it, returns
    /// [`PlannedOutcome::Elsewhere`].
    pub fn load_or_play(&self, spec: &EpisodeSpec) -> Result<PlannedOutcome, EvaluationError> {
        if let Some(kept) = self.load_kept(spec)? {
            return Ok(kept);
        }
        let path = self.lock_path(spec);
        let locking = FileLock::attempt(&path, LockKind::Exclusive);
        let _lock = match locking.map_err(|source| EvaluationError::Io { path: path.clone(), source })? {
            Locking::Locked(lock) => Some(lock.removing(&path)),
            Locking::Held => return Ok(PlannedOutcome::Elsewhere),
            Locking::Unsupported => None,
        };
        self.load_or_play_alone(spec)
    }

    /// Waits until no other process plays the episode, then does what [`EpisodeCache::load_or_play`] does.
    pub fn wait_and_play(&self, spec: &EpisodeSpec) -> Result<PlannedOutcome, EvaluationError> {
        let path = self.lock_path(spec);
        let lock = FileLock::wait(&path, || !self.plan.player.is_interrupted());
        let _lock = lock.map_err(|source| EvaluationError::Io { path, source })?;
        self.load_or_play_alone(spec)
    }

    /// Returns the path of the lock that a process holds while it plays the episode.
    fn lock_path(&self, spec: &EpisodeSpec) -> PathBuf {
        self.folder.join(format!("{}.lock", name(spec)))
    }

    fn load_kept(&self, spec: &EpisodeSpec) -> Result<Option<PlannedOutcome>, EvaluationError> {
        let kept = self.load(spec).map(|cached| self.keep(spec, cached)).transpose()?;
        Ok(kept.map(|kept| PlannedOutcome::Kept(Box::new(kept))))
    }

    fn load_or_play_alone(&self, spec: &EpisodeSpec) -> Result<PlannedOutcome, EvaluationError> {
        // Another process may have played it since the last check.
        if let Some(kept) = self.load_kept(spec)? {
            return Ok(kept);
        }
        let attempts = self.earlier(spec).map(PlayedEpisode::into_attempts).unwrap_or_default();
        let folder = self.folder.join(name(spec));
        if self.plan.record {
            // Until the recording is whole, no result may claim that it is.
            forget_result(&folder)?;
        }
        let KeptFiles { pages, .. } = self.plan.files;
        let output = EpisodeOutput { folder: &folder, record: self.plan.record, pages };
        match self.plan.player.play_episode(spec, output) {
            Ok(outcome) => {
                self.store(spec, outcome, attempts).map(|played| PlannedOutcome::Played(Box::new(played)))
            }
            Err(PlayError::Episode(EpisodeError::Checkpoint(CheckpointError::NoPhase { .. }))) => {
                Ok(PlannedOutcome::LeftOut("its demonstration did not come so far".into()))
            }
            // The world failed before the policy could act. Other episodes may still work.
            Err(PlayError::Episode(error @ EpisodeError::Diverged { .. })) => {
                Ok(PlannedOutcome::LeftOut(format!("the simulator failed before the policy's turn: {error}")))
            }
            Err(PlayError::NotReady(reason)) => Ok(PlannedOutcome::LeftOut(reason)),
            Err(PlayError::Episode(error)) => Err(error.into()),
            Err(PlayError::Absent(reason)) => {
                Err(EvaluationError::PolicyAbsent { reason, kept: 0, planned: 0 })
            }
            Err(PlayError::Lost(reason)) => Err(unrecorded(spec, reason)),
        }
    }

    /// Returns an earlier run's episode if it is the same episode and counts. A file that is damaged, renamed
    /// or from other rules is ignored.
    pub fn load(&self, spec: &EpisodeSpec) -> Option<PlayedEpisode> {
        let cached = self.earlier(spec)?;
        let is_whole = self.is_not_kept(&cached)
            || self.recording(spec).is_none_or(|folder| is_recorded(&folder, &cached.result));
        (is_whole && cached.counts()).then_some(cached)
    }

    /// Returns an earlier run's result of this episode, even if the result does not count.
    fn earlier(&self, spec: &EpisodeSpec) -> Option<PlayedEpisode> {
        let cached: PlayedEpisode = serde_json::from_slice(&self.read(spec)?).ok()?;
        let by = (&cached.policy, cached.locomotion.as_str());
        let same = by == (&self.plan.player.card(), &self.locomotion)
            && self.builds.contains(&cached.build)
            && cached.spec == *spec
            && (cached.result.task.as_str(), cached.result.seed) == (spec.task.id.as_str(), Some(spec.seed));
        let keep_failed = self.keeps_failure(&cached.result, &cached.attempts);
        same.then_some(PlayedEpisode { keep_failed, ..cached })
    }

    /// Returns `true` if the episode has a result that this build cannot parse.
    pub fn is_unreadable(&self, spec: &EpisodeSpec) -> bool {
        self.read(spec).is_some_and(|bytes| serde_json::from_slice::<PlayedEpisode>(&bytes).is_err())
    }

    fn read(&self, spec: &EpisodeSpec) -> Option<Vec<u8>> {
        std::fs::read(self.folder.join(format!("{}.json", name(spec)))).ok()
    }

    /// Returns `true` if the policy itself failed, and the episode has been retried as often as the plan
    /// allows.
    fn keeps_failure(&self, result: &ResultReply, attempts: &[Attempt]) -> bool {
        result.ended == EndReason::PolicyFailed && failures_of_policy(attempts) >= self.plan.retries as usize
    }

    /// Returns `true` if the plan drops the recording of this episode because it failed.
    fn is_not_kept(&self, played: &PlayedEpisode) -> bool {
        self.plan.files.only_successful && !played.succeeded()
    }

    /// Updates the file of a cached episode if its failure counts now.
    fn keep(&self, spec: &EpisodeSpec, kept: PlayedEpisode) -> Result<PlayedEpisode, EvaluationError> {
        match kept.keep_failed {
            true => self.write(spec, kept),
            false => Ok(kept),
        }
    }

    /// Returns the folder of the episode's recording; `None` if it is not recorded.
    fn recording(&self, spec: &EpisodeSpec) -> Option<PathBuf> {
        self.plan.record.then(|| self.folder.join(name(spec)))
    }

    /// Stores the outcome of an episode, with the earlier attempts.
    fn store(
        &self,
        spec: &EpisodeSpec,
        outcome: PlayOutcome,
        attempts: Vec<Attempt>,
    ) -> Result<PlayedEpisode, EvaluationError> {
        let PlayOutcome { result, thought, stopped } = outcome;
        if let Some(reason) = result.recording_failed {
            return Err(unrecorded(spec, reason));
        }
        let played = PlayedEpisode {
            policy: self.plan.player.card(),
            spec: spec.clone(),
            locomotion: self.locomotion.clone(),
            build: self.build.into(),
            // After a failure of the simulator, the simulator's own text is more informative than the
            // policy's.
            note: stopped
                .filter(|_| result.simulator_failure.is_none())
                .or_else(|| episode_note(&result, spec.start_phase())),
            thought_s: thought.as_secs_f64(),
            keep_failed: self.keeps_failure(&result, &attempts),
            attempts,
            ended_at: Some(utc_text(SystemTime::now())),
            result,
        };
        if let Some(folder) = self.recording(spec).filter(|_| self.is_not_kept(&played)) {
            std::fs::remove_dir_all(&folder)
                .map_err(|source| EvaluationError::Io { path: folder, source })?;
        }
        self.write(spec, played)
    }

    fn write(&self, spec: &EpisodeSpec, played: PlayedEpisode) -> Result<PlayedEpisode, EvaluationError> {
        let text = serde_json::to_string_pretty(&played)?;
        write_whole(&self.folder.join(format!("{}.json", name(spec))), text.as_bytes())?;
        Ok(played)
    }
}

/// Returns `true` if the recording in `folder` is complete and belongs to the episode with this result. Its
/// `result.json` is written last.
fn is_recorded(folder: &Path, result: &ResultReply) -> bool {
    let bytes = std::fs::read(folder.join(RESULT_FILE)).unwrap_or_default();
    let recorded = serde_json::from_slice::<ResultReply>(&bytes);
    folder.join(Recorder::FILE_NAME).exists()
        && recorded.is_ok_and(|recorded| {
            let of = |result: &ResultReply| (result.state_hash.clone(), result.env_steps, result.tool_calls);
            of(&recorded) == of(result)
        })
}

/// Removes the result of an earlier recording in `folder`.
fn forget_result(folder: &Path) -> Result<(), EvaluationError> {
    let path = folder.join(RESULT_FILE);
    match std::fs::remove_file(&path) {
        Err(source) if !matches!(source.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            Err(EvaluationError::Io { path, source })
        }
        _ => Ok(()),
    }
}

fn unrecorded(spec: &EpisodeSpec, reason: String) -> EvaluationError {
    EvaluationError::Recording { task: spec.task.id.clone(), seed: spec.seed, reason }
}

/// Returns the name of the episode's file and folder.
fn name(spec: &EpisodeSpec) -> String {
    let (task, seed) = (&spec.task.id, spec.seed);
    match &spec.start {
        Start::Phase(start) => format!("{task}-{seed}-{}", start.phase),
        Start::Moment(_) => again_name(spec),
        Start::Task | Start::Checkpoint(_) => format!("{task}-{seed}"),
    }
}
