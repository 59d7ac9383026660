//! A Python callable as the policy of an evaluation.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyTracebackMethods;
use serde_json::{Value, json};
use tandem::settings::{Layer, Settings};
use tandem_episodes::evaluation::{self, EpisodeEvent, EvaluationPlan, Shard, Starts};
use tandem_episodes::players::{EpisodeOutput, PlayError, PlayOutcome, Policy};
use tandem_episodes::results::{PlayedEpisode, PolicyCard};
use tandem_episodes::{EpisodeSpec, RobotFile, Session, tasks};
use tandem_tools_spec::{EndReason, Protocol};

use crate::episode::NativeEpisode;
use crate::refusal::failed;

/// How often the evaluation looks whether the user wants it to end.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// Plays episodes by `play`, which is called with each episode and its briefing as JSON, and returns what came of it as JSON. What `out`
/// holds already is not played again. `progress` is called with every episode's result as JSON, and whether it was played now.
#[pyfunction]
#[pyo3(signature = (play, name, settings, protocol, tasks, seeds, jobs, record, out, progress))]
#[allow(clippy::too_many_arguments, reason = "the package calls it, by names")]
pub fn evaluate(
    py: Python,
    play: Py<PyAny>,
    name: String,
    settings: &str,
    protocol: &str,
    tasks: Vec<String>,
    seeds: Vec<u32>,
    jobs: usize,
    record: bool,
    out: PathBuf,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let layer: Layer = serde_json::from_str(settings).map_err(|error| failed(py, &error))?;
    let settings = Settings::resolve(layer, None).map_err(|error| failed(py, &error))?;
    let found: Result<Vec<_>, _> = tasks.iter().map(|task| tasks::find(task)).collect();
    let protocol: Protocol =
        serde_json::from_value(Value::from(protocol)).map_err(|error| failed(py, &error))?;
    let player = Callable { play, name, interrupted: Arc::default() };
    let plan = EvaluationPlan {
        player: &player,
        protocol,
        scene: settings.scene.clone(),
        robot: RobotFile::default(),
        locomotion: settings.locomotion.clone(),
        sensing: settings.sensing,
        renderer: settings.renderer,
        assistance: settings.assistance,
        disclosure: settings.disclosure,
        hints: settings.hints,
        tasks: found.map_err(|error| failed(py, &error))?,
        seeds,
        starts: Starts::Task,
        shard: Shard::WHOLE,
        jobs,
        record,
        keep_failed: false,
    };
    play_all(py, &plan, &out, progress.as_ref(), &player.interrupted)
}

/// Plays on threads of their own, while this one hears signals: Python handles them on its main thread alone.
fn play_all(
    py: Python,
    plan: &EvaluationPlan,
    out: &Path,
    progress: Option<&Py<PyAny>>,
    interrupted: &AtomicBool,
) -> PyResult<String> {
    let (done, outcome) = channel();
    // Only this thread ever waits; Python's lock is given back meanwhile, and what does that has to be shareable.
    let outcome = Mutex::new(outcome);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let tell = |event: EpisodeEvent| tell(progress, event);
            // Who would hear it waits for this thread.
            let _ = done.send(evaluation::evaluate(plan, out, &tell));
        });
        let mut signal = None;
        let outcome = loop {
            let wait =
                || outcome.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(SIGNAL_INTERVAL);
            match py.detach(wait) {
                Ok(outcome) => break Some(outcome),
                Err(RecvTimeoutError::Disconnected) => break None,
                Err(RecvTimeoutError::Timeout) => {}
            }
            if let Err(raised) = py.check_signals() {
                interrupted.store(true, Ordering::Relaxed);
                signal.get_or_insert(raised);
            }
        };
        match (signal, outcome) {
            (Some(signal), _) => Err(signal),
            (None, Some(Ok(evaluation))) => Ok(json!(evaluation).to_string()),
            (None, Some(Err(error))) => Err(failed(py, &error)),
            (None, None) => Err(failed(py, &"the evaluation has panicked; what was played before is kept")),
        }
    })
}

/// Tells who looks on of an episode. What goes wrong with that does not concern the evaluation.
fn tell(progress: Option<&Py<PyAny>>, event: EpisodeEvent) {
    let (played, now): (&PlayedEpisode, bool) = match event {
        EpisodeEvent::Kept(played) => (played, false),
        EpisodeEvent::Played(played) => (played, true),
        EpisodeEvent::LeftOut => return,
    };
    let Some(progress) = progress else { return };
    Python::attach(|py| {
        if let Err(error) = progress.call1(py, (json!(played.result).to_string(), now)) {
            error.write_unraisable(py, Some(progress.bind(py)));
        }
    });
}

/// A policy that is a Python callable.
#[derive(Debug)]
struct Callable {
    play: Py<PyAny>,
    name: String,
    /// Whether the user wants it to end.
    interrupted: Arc<AtomicBool>,
}

impl Policy for Callable {
    fn card(&self) -> PolicyCard {
        PolicyCard { name: self.name.clone(), ..PolicyCard::default() }
    }

    fn play_episode(&self, spec: &EpisodeSpec, output: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        if self.interrupted.load(Ordering::Relaxed) {
            return Err(PlayError::Absent("interrupted".into()));
        }
        let session = Session::start(spec, output.recording())?;
        if let Some(reason) = session.recording_failed() {
            return Err(PlayError::Lost(reason.into()));
        }
        let briefing = json!(session.briefing()).to_string();
        let episode = NativeEpisode::of(session, output.record).until(self.interrupted.clone());
        let (episode, stopped) = Python::attach(|py| self.play(py, episode, briefing))
            .map_err(|error| PlayError::Absent(error.to_string()))?;
        if self.interrupted.load(Ordering::Relaxed) {
            // It does not count, and its recording is whole all the same.
            let _ = episode.get().end(Some(EndReason::Abandoned));
            return Err(PlayError::Absent("interrupted".into()));
        }
        let thought = episode.get().thought();
        let reason = stopped.is_some().then_some(EndReason::PolicyFailed);
        let result = episode.get().end(reason).map_err(|error| PlayError::Lost(error.to_string()))?;
        Ok(PlayOutcome { result, thought, stopped })
    }
}

impl Callable {
    /// Lets the callable play. Returns the episode, and what the callable raised, if it did.
    fn play(
        &self,
        py: Python,
        episode: NativeEpisode,
        briefing: String,
    ) -> PyResult<(Py<NativeEpisode>, Option<String>)> {
        let episode = Py::new(py, episode)?;
        let over = py.import("tandem.errors")?.getattr("EpisodeEnded")?;
        match self.play.call1(py, (episode.clone_ref(py), briefing)) {
            Ok(_) => Ok((episode, None)),
            // That it ends under way is no failure: the last phase may have been reached.
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
}
