//! Evaluations that Python requests.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use serde_json::{Value, json};
use tandem::commands::read_seed_key;
use tandem::settings::{Layer, Settings};
use tandem_episodes::Variation;
use tandem_evaluation::evaluation::{
    self, EpisodeEvent, EvaluationPlan, ExistingRun, KeptFiles, Shard, Starts,
};
use tandem_evaluation::results::PlayedEpisode;
use tandem_tools_spec::Protocol;

use crate::players::{PlayedBy, PythonPolicy};
use crate::refusal::failed;

/// Interval between two checks for signals.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// Plays episodes with `play` and returns the evaluation as JSON.
///
/// `play` is called with each episode and its briefing as JSON. Without `play`, the player called `name`
/// plays. With `elsewhere`, another process plays the episodes: `play` is called with task, seed and a
/// function that returns true once the user wants to stop. It returns true and the episode as JSON with the
/// files of its recording, or false and the reason.
///
/// Existing results in `out` are not played again. `progress` is called with the result of every episode as
/// JSON, and true if it was played now. `existing_run` is the treatment of a different run in `out`:
/// `refuse`, `resume_with_new_build` or `overwrite`. `seed_key` is the file with an evaluator's key.
#[pyfunction]
#[pyo3(signature = (play, name, settings, protocol, tasks, seeds, jobs, record, out, progress, elsewhere, existing_run, seed_key))]
#[allow(clippy::too_many_arguments, reason = "the package calls it, by names")]
pub fn evaluate(
    py: Python,
    play: Option<Py<PyAny>>,
    name: String,
    settings: &str,
    protocol: &str,
    tasks: Vec<String>,
    seeds: Vec<u32>,
    jobs: usize,
    record: bool,
    out: PathBuf,
    progress: Option<Py<PyAny>>,
    elsewhere: bool,
    existing_run: &str,
    seed_key: Option<PathBuf>,
) -> PyResult<String> {
    let by = PlayedBy::new(play, &name, elsewhere).map_err(|error| failed(py, &error))?;
    let player = PythonPolicy { name, by, interrupted: Arc::default() };
    let existing = existing(py, existing_run)?;
    let plan = plan_of(py, &player, settings, protocol, &tasks, seeds, seed_key)?;
    let plan = EvaluationPlan { jobs, record, existing, ..plan };
    play_all(py, &plan, &out, progress.as_ref(), &player.interrupted)
}

/// Returns the default folder of demonstrations, in the folder `runs`.
#[pyfunction]
pub fn demonstrations_folder(
    py: Python,
    settings: &str,
    protocol: &str,
    tasks: Vec<String>,
    seeds: Vec<u32>,
    seed_key: Option<PathBuf>,
) -> PyResult<PathBuf> {
    let name = "expert".to_owned();
    let by = PlayedBy::new(None, &name, false).map_err(|error| failed(py, &error))?;
    let player = PythonPolicy { name, by, interrupted: Arc::default() };
    let plan = plan_of(py, &player, settings, protocol, &tasks, seeds, seed_key)?;
    Ok(evaluation::default_folder(&plan, Some("demonstrations"), Path::new("runs")))
}

/// Returns the plan for these episodes. They are played in sequence and without recordings.
fn plan_of<'a>(
    py: Python,
    player: &'a PythonPolicy,
    settings: &str,
    protocol: &str,
    tasks: &[String],
    seeds: Vec<u32>,
    seed_key: Option<PathBuf>,
) -> PyResult<EvaluationPlan<'a>> {
    let layer: Layer = serde_json::from_str(settings).map_err(|error| failed(py, &error))?;
    let settings = Settings::resolve(layer, None).map_err(|error| failed(py, &error))?;
    let found: Result<Vec<_>, _> = tasks.iter().map(|task| settings.tasks.find(task).cloned()).collect();
    let protocol: Protocol =
        serde_json::from_value(Value::from(protocol)).map_err(|error| failed(py, &error))?;
    let key = seed_key.map(|file| read_seed_key(&file, &seeds)).transpose();
    Ok(EvaluationPlan {
        player,
        protocol,
        scene: settings.scene.clone(),
        robot: settings.robot.clone(),
        locomotion: settings.locomotion.clone(),
        sensing: settings.sensing,
        renderer: settings.renderer,
        camera: settings.camera,
        assistance: settings.assistance,
        disclosure: settings.disclosure,
        hints: settings.hints,
        instructions: settings.instructions.clone(),
        variation: Variation::default(),
        stress: settings.stress,
        thinking_limit_s: settings.thinking_limit_s,
        tasks: found.map_err(|error| failed(py, &error))?,
        seeds,
        starts: Starts::Task,
        shard: Shard::WHOLE,
        jobs: 1,
        record: false,
        files: KeptFiles::default(),
        retries: EvaluationPlan::DEFAULT_RETRIES,
        seed_key: key.map_err(|error| failed(py, &error))?,
        existing: ExistingRun::Refuse,
    })
}

fn existing(py: Python, name: &str) -> PyResult<ExistingRun> {
    match name {
        "refuse" => Ok(ExistingRun::Refuse),
        "resume_with_new_build" => Ok(ExistingRun::ResumeWithNewBuild),
        "overwrite" => Ok(ExistingRun::Overwrite),
        other => Err(failed(py, &format!("nothing becomes of a run by {other:?}"))),
    }
}

/// Plays on separate threads, while this thread handles signals, because Python handles them only on its main
/// thread.
fn play_all(
    py: Python,
    plan: &EvaluationPlan,
    out: &Path,
    progress: Option<&Py<PyAny>>,
    interrupted: &AtomicBool,
) -> PyResult<String> {
    let (done, outcome) = channel();
    // Only this thread ever waits. It releases Python's lock meanwhile, which requires a receiver that can be
    // shared.
    let outcome = Mutex::new(outcome);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let tell = |event: EpisodeEvent| tell(progress, event);
            // The receiver waits for this thread.
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

/// Reports an episode to the progress callback. Errors of the callback do not affect the evaluation.
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
