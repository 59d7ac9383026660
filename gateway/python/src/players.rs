//! Players of the episodes of an evaluation that Python requests.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCFunction, PyTracebackMethods};
use serde_json::json;
use tandem_episodes::players::{self, Episode, PlayerEntry, PlayerError, PrivilegedEpisode};
use tandem_episodes::{EpisodeSpec, Facts, RESULT_FILE, Session, build, create_private_folder, write_whole};
use tandem_evaluation::policies::{EpisodeOutput, PlayError, PlayOutcome, Policy, play_in_process};
use tandem_evaluation::results::{PlayedEpisode, PolicyCard};
use tandem_tools_spec::{EndReason, ToolCall, ToolReply};

use crate::episode::{Course, NativeEpisode};

/// A policy that Python provides.
#[derive(Debug)]
pub struct PythonPolicy {
    pub name: String,
    pub by: PlayedBy,
    /// Set once the user wants the policy to end.
    pub interrupted: Arc<AtomicBool>,
}

/// Origin of the calls.
#[derive(Debug)]
pub enum PlayedBy {
    /// A built-in player.
    BuiltIn(&'static PlayerEntry),
    /// A callable that is called with each episode and its briefing as JSON.
    Callable(Py<PyAny>),
    /// A callable that lets another process play whole episodes.
    Elsewhere(Py<PyAny>),
}

impl PlayedBy {
    /// Selects the callable `play`, which plays episodes itself or, with `elsewhere`, lets another process
    /// play them. Without a callable, selects the player called `name`.
    pub fn new(play: Option<Py<PyAny>>, name: &str, elsewhere: bool) -> Result<PlayedBy, PlayerError> {
        Ok(match play {
            None => PlayedBy::BuiltIn(players::find(name)?),
            Some(play) if elsewhere => PlayedBy::Elsewhere(play),
            Some(play) => PlayedBy::Callable(play),
        })
    }
}

impl Policy for PythonPolicy {
    fn card(&self) -> PolicyCard {
        PolicyCard { name: self.name.clone(), ..PolicyCard::default() }
    }

    fn play_episode(&self, spec: &EpisodeSpec, output: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        self.check_interrupt()?;
        match &self.by {
            PlayedBy::BuiltIn(entry) => self.play_built_in(entry, spec, output),
            PlayedBy::Callable(play) => self.play_callable(play, spec, output),
            PlayedBy::Elsewhere(play) => self.play_elsewhere(play, spec, output),
        }
    }

    fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}

impl PythonPolicy {
    fn check_interrupt(&self) -> Result<(), PlayError> {
        match self.is_interrupted() {
            true => Err(PlayError::Absent("interrupted".into())),
            false => Ok(()),
        }
    }

    fn play_built_in(
        &self,
        entry: &PlayerEntry,
        spec: &EpisodeSpec,
        output: EpisodeOutput,
    ) -> Result<PlayOutcome, PlayError> {
        let outcome = play_in_process(spec, output, |episode| {
            entry.play(spec, &mut Interruptible { episode, interrupted: &self.interrupted })
        })?;
        self.check_interrupt()?;
        Ok(outcome)
    }

    fn play_callable(
        &self,
        play: &Py<PyAny>,
        spec: &EpisodeSpec,
        output: EpisodeOutput,
    ) -> Result<PlayOutcome, PlayError> {
        let session = Session::start(spec, output.recording())?;
        if let Some(reason) = session.recording_failed() {
            return Err(PlayError::Lost(reason.into()));
        }
        let briefing = json!(session.briefing()).to_string();
        let episode = NativeEpisode::of(session, Course::Scored).until(self.interrupted.clone());
        let (episode, stopped) = Python::attach(|py| self.call(py, play, episode, briefing))
            .map_err(|error| PlayError::Absent(error.to_string()))?;
        if self.is_interrupted() {
            // The episode does not count, but its recording is complete.
            let _ = episode.get().end(Some(EndReason::Abandoned));
            return Err(PlayError::Absent("interrupted".into()));
        }
        let thought = episode.get().thought();
        let reason = stopped.is_some().then_some(EndReason::PolicyFailed);
        let result = episode.get().end(reason).map_err(|error| PlayError::Lost(error.to_string()))?;
        Ok(PlayOutcome { result, thought, stopped })
    }

    /// Lets the callable play. Returns the episode, and the exception that the callable raised; `None`
    /// without one.
    fn call(
        &self,
        py: Python,
        play: &Py<PyAny>,
        episode: NativeEpisode,
        briefing: String,
    ) -> PyResult<(Py<NativeEpisode>, Option<String>)> {
        let episode = Py::new(py, episode)?;
        let over = py.import("tandem.errors")?.getattr("EpisodeEnded")?;
        match play.call1(py, (episode.clone_ref(py), briefing)) {
            Ok(_) => Ok((episode, None)),
            // An end during the play is not a failure, because the last phase may have been reached.
            Err(error) if error.is_instance(py, &over) => Ok((episode, None)),
            Err(error) if error.is_instance_of::<PyKeyboardInterrupt>(py) => {
                self.interrupted.store(true, Ordering::Relaxed);
                Ok((episode, None))
            }
            Err(error) => {
                let trace = error.traceback(py).and_then(|trace| trace.format().ok());
                Ok((episode, Some(format!("{}{error}", trace.unwrap_or_default()))))
            }
        }
    }

    fn play_elsewhere(
        &self,
        play: &Py<PyAny>,
        spec: &EpisodeSpec,
        output: EpisodeOutput,
    ) -> Result<PlayOutcome, PlayError> {
        let answered = Python::attach(|py| self.ask_elsewhere(py, play, spec));
        let (played, files) = match answered {
            Ok(Elsewhere::Played { played, files }) => (played, files),
            Ok(Elsewhere::NotPlayed { reason }) => return Err(PlayError::NotReady(reason)),
            Err(error) => {
                self.check_interrupt()?;
                return Err(PlayError::Absent(error.to_string()));
            }
        };
        let played: PlayedEpisode = serde_json::from_str(&played).map_err(|error| {
            PlayError::Absent(format!("another build has played an episode ({error}); {SAME_WHEEL}"))
        })?;
        let own = build().map_err(tandem_episodes::EpisodeError::Build)?;
        if played.build != own {
            let text = format!("the build {} has played an episode of {own}; {SAME_WHEEL}", played.build);
            return Err(PlayError::Absent(text));
        }
        if played.spec != *spec {
            let text = "an episode of other settings was played; give every machine the same scene and environment variables";
            return Err(PlayError::Absent(text.into()));
        }
        if let Some(folder) = output.recording() {
            keep(folder, files).map_err(PlayError::Lost)?;
        }
        let thought = Duration::try_from_secs_f64(played.thought_s).unwrap_or_default();
        Ok(PlayOutcome { result: played.result, thought, stopped: played.note })
    }

    fn ask_elsewhere(&self, py: Python, play: &Py<PyAny>, spec: &EpisodeSpec) -> PyResult<Elsewhere> {
        let interrupted = self.interrupted.clone();
        let is_interrupted =
            PyCFunction::new_closure(py, None, None, move |_, _| interrupted.load(Ordering::Relaxed))?;
        let (played, said): (bool, Bound<PyAny>) =
            play.bind(py).call1((spec.task.id.as_str(), spec.seed, is_interrupted))?.extract()?;
        if !played {
            return Ok(Elsewhere::NotPlayed { reason: said.extract()? });
        }
        let (played, files): (String, Vec<(String, Bound<PyBytes>)>) = said.extract()?;
        let files = files.into_iter().map(|(name, bytes)| (name, bytes.as_bytes().to_vec())).collect();
        Ok(Elsewhere::Played { played, files })
    }
}

/// Advice for machines with different builds.
const SAME_WHEEL: &str = "install the same wheel on every machine";

/// Outcome of an episode that another process was asked to play.
enum Elsewhere {
    /// The episode in the format of its file, and the files of its recording.
    Played {
        played: String,
        files: Vec<(String, Vec<u8>)>,
    },
    NotPlayed {
        reason: String,
    },
}

/// Writes the files of a recording. The result is written last, because it marks the recording as complete.
fn keep(folder: &Path, mut files: Vec<(String, Vec<u8>)>) -> Result<(), String> {
    create_private_folder(folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))?;
    files.sort_by_key(|(name, _)| name == RESULT_FILE);
    for (name, bytes) in files {
        write_whole(&folder.join(name), &bytes).map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// An episode whose calls fail once the user interrupts.
struct Interruptible<'a, E> {
    episode: &'a mut E,
    interrupted: &'a AtomicBool,
}

impl<E: Episode> Episode for Interruptible<'_, E> {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        match self.interrupted.load(Ordering::Relaxed) {
            true => Err(PlayerError::EpisodeOver),
            false => self.episode.call(call),
        }
    }
}

impl<E: PrivilegedEpisode> PrivilegedEpisode for Interruptible<'_, E> {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.episode.facts()
    }
}
