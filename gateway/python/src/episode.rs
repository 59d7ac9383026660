//! One episode in the caller's process.

use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use numpy::{PyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::{Value, json};
use tandem::hosting::{Answer, EpisodeMetrics, HostingError, PanicGuard};
use tandem::settings::{Layer, Settings};
use tandem_episodes::{Checkpoint, EpisodeError, EpisodeSpec, RobotObservation, Session};
use tandem_tools_spec::{
    ActCall, Assistance, Call, CommandReply, DepthFormat, Disclosure, EndReason, Formats, ImageFormat,
    JointChunk, Look, Observe, ResultReply, SendJointChunk, Tool as _, ToolReply, parse_args,
};

use crate::arrays::{Colours, Depths, shaped, state_names, state_row};
use crate::refusal::{failed, forked, refused};

/// An episode from its start to its result. It may be used from any thread, but concurrent calls are
/// serialized.
#[pyclass(frozen, name = "Episode", module = "tandem._native")]
pub struct NativeEpisode {
    held: Mutex<Held>,
    robots: Vec<String>,
    course: Course,
    assistance: Assistance,
    disclosure: Disclosure,
    /// Id of the process that created the episode. A forked process has neither the threads nor the files of
    /// its parent.
    process: u32,
    /// Set by another thread once the policy has to stop.
    interrupted: Arc<AtomicBool>,
}

/// Purpose of an episode, which determines whether earlier states may be restored.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Course {
    /// An episode of the caller, in which earlier states may be restored.
    Free,
    /// A recorded episode.
    Recorded,
    /// An episode that an evaluation scores at the first attempt.
    Scored,
}

impl Course {
    /// Returns the reason why no other state may be restored; `None` if it may.
    fn forward_only(self) -> Option<&'static str> {
        match self {
            Course::Free => None,
            Course::Recorded => {
                Some("a recorded episode goes forward only; start one without `record` to go back in it")
            }
            Course::Scored => Some(
                "an evaluation scores this episode, which goes forward only and has no snapshots; an episode of your own, \
                 tandem.Episode(task, seed), has them",
            ),
        }
    }
}

/// State of an episode.
enum Held {
    Open(Box<PanicGuard>),
    /// The result, if there is one.
    Closed(Option<Box<ResultReply>>),
}

/// Snapshot of an episode, which can be restored.
#[pyclass(frozen, module = "tandem._native")]
pub struct Snapshot {
    checkpoint: Checkpoint,
}

/// Outcome of a step: number of executed steps, stop reason, simulated time in seconds, numbers of reached
/// phases, falls of the robots, and true if the episode has ended.
type Stepped = (u32, String, f64, Vec<String>, Vec<bool>, bool);

/// States and calibrations as JSON, and the images of each robot.
type Seen<'py> = (String, Vec<(Colours<'py>, Option<Depths<'py>>)>);

impl NativeEpisode {
    /// Wraps an episode that has begun.
    pub fn of(session: Session, course: Course) -> NativeEpisode {
        let robots = session.spec().task.robots.iter().map(|robot| robot.name.to_owned()).collect();
        let EpisodeSpec { assistance, disclosure, .. } = *session.spec();
        let guard = PanicGuard::new(session, EpisodeMetrics::new(Arc::default()));
        NativeEpisode {
            held: Mutex::new(Held::Open(guard.into())),
            robots,
            course,
            assistance,
            disclosure,
            process: process::id(),
            interrupted: Arc::default(),
        }
    }

    /// Makes calls of the episode raise KeyboardInterrupt once `interrupted` is set.
    pub fn until(mut self, interrupted: Arc<AtomicBool>) -> NativeEpisode {
        self.interrupted = interrupted;
        self
    }

    /// Returns the policy's thinking time up to its last call.
    pub fn thought(&self) -> Duration {
        match &*self.held() {
            Held::Open(guard) => guard.thought().unwrap_or_default(),
            Held::Closed(_) => Duration::ZERO,
        }
    }

    fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns an error in a forked process.
    fn check_process(&self, py: Python) -> PyResult<()> {
        match process::id() == self.process {
            true => Ok(()),
            false => Err(failed(py, &forked(self.process))),
        }
    }

    /// Runs `work` on the session. Other Python threads run meanwhile.
    fn work<T: Send>(
        &self,
        py: Python,
        work: impl FnOnce(&mut Session) -> Result<T, EpisodeError> + Send,
    ) -> PyResult<T> {
        self.check_process(py)?;
        if self.interrupted.load(Ordering::Relaxed) {
            return Err(PyKeyboardInterrupt::new_err("the evaluation was interrupted"));
        }
        let worked = py.detach(|| match &mut *self.held() {
            Held::Open(guard) => guard.run(|session| Ok(work(session)?)).flatten(),
            Held::Closed(_) => Err(HostingError::EpisodeStopped),
        });
        worked.map_err(|error| refused(py, &error))
    }

    /// Ends the episode, for the given reason if any, and closes its recording. The result remains available.
    pub fn end(&self, reason: Option<EndReason>) -> Result<ResultReply, HostingError> {
        let mut held = self.held();
        let result = match std::mem::replace(&mut *held, Held::Closed(None)) {
            Held::Open(mut guard) => {
                if let Some(reason) = reason {
                    // An episode that has panicked has ended already.
                    let _ = guard.run(|session| session.end(reason));
                }
                guard.close().map(Box::new)
            }
            Held::Closed(result) => result.ok_or(HostingError::EpisodeStopped),
        }?;
        *held = Held::Closed(Some(result.clone()));
        Ok(*result)
    }
}

#[pymethods]
impl NativeEpisode {
    /// Starts an episode. `start` contains the arguments of start_episode, and `settings` those of a server,
    /// both as JSON. Returns the episode with its briefing.
    #[staticmethod]
    fn start(
        py: Python,
        start: &str,
        settings: &str,
        record: Option<PathBuf>,
    ) -> PyResult<(NativeEpisode, String)> {
        let started = py.detach(|| begin(start, settings, record.as_deref()));
        let (session, briefing) = started.map_err(|problem| problem.raise(py))?;
        if let Some(reason) = session.recording_failed() {
            return Err(failed(py, &reason));
        }
        let course = if record.is_some() { Course::Recorded } else { Course::Free };
        Ok((NativeEpisode::of(session, course), briefing))
    }

    /// Returns the names of the robots, in order.
    #[getter]
    fn robots(&self) -> Vec<String> {
        self.robots.clone()
    }

    /// Makes a call and returns its reply, both as JSON.
    fn call(&self, py: Python, tool: &str, arguments: &str) -> PyResult<String> {
        self.work(py, |session| {
            let call = Call::parse(tool, read(arguments))?;
            let reply = session.ask(None, call)?;
            Ok(json!(Answer::new(reply, session)).to_string())
        })
    }

    /// Observes all requested robots. Returns states and calibrations as JSON. For each robot, also returns
    /// the colour image and, on request, the depth image.
    #[pyo3(signature = (arguments, depth))]
    fn observe<'py>(&self, py: Python<'py>, arguments: &str, depth: bool) -> PyResult<Seen<'py>> {
        let formats =
            Formats { images: Some(ImageFormat::Rgb), depth: depth.then_some(DepthFormat::Float16) };
        let seen = self.work(py, |session| {
            session.observe_as_told(&Look { observe: parse_args::<Observe>(read(arguments))?, formats })
        })?;
        let views = seen.robots.iter().map(|RobotObservation { view, .. }| {
            let (height, width) = (view.picture.height as usize, view.picture.width as usize);
            let colours = shaped(py, view.picture.rgb(), [height, width, 3])?;
            let depth = depth.then(|| shaped(py, view.depth_m(), [height, width])).transpose()?;
            Ok((colours, depth))
        });
        let views = views.collect::<PyResult<_>>()?;
        let (states, cameras): (Vec<&_>, Vec<&_>) =
            seen.robots.iter().map(|robot| (&robot.state, &robot.calibration)).unzip();
        Ok((json!({ "time_s": seen.time_s, "states": states, "cameras": cameras }).to_string(), views))
    }

    /// Returns the sensed states, with one row per robot.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let numbers = self.work(py, |session| {
            let (assistance, step) = session.read_states()?;
            let mut numbers = Vec::new();
            step.robots.iter().for_each(|robot| state_row(robot, assistance, &mut numbers));
            Ok(numbers)
        })?;
        shaped(py, &numbers, [self.robots.len(), numbers.len() / self.robots.len()])
    }

    /// Returns the names of the columns of the state.
    fn state_columns(&self, py: Python) -> PyResult<Vec<String>> {
        self.work(py, |session| Ok(state_names(session.spec().assistance)))
    }

    /// Executes action rows of all robots, given as robots by steps by columns.
    fn step(&self, py: Python, rows: PyReadonlyArray3<'_, f32>) -> PyResult<Stepped> {
        let rows = rows.as_array();
        let chunk = |(robot, rows): (&String, numpy::ndarray::ArrayView2<f32>)| JointChunk {
            robot: robot.clone(),
            rows: rows.outer_iter().map(|row| row.iter().copied().map(f64::from).collect()).collect(),
        };
        if rows.shape()[0] != self.robots.len() {
            let have =
                format!("rows are of {} robots and this episode has {}", rows.shape()[0], self.robots.len());
            return Err(failed(py, &format!("{have}; give an array of robots by steps by 35")));
        }
        let robots = self.robots.iter().zip(rows.outer_iter()).map(chunk).collect();
        let (CommandReply { executed_steps, stop_reason, time_s, fallen, phases, .. }, ended) =
            self.work(py, |session| {
                let reply = match session.call(SendJointChunk { robots }.into())? {
                    ToolReply::Act(reply) => reply,
                    ToolReply::Look(_) | ToolReply::Plan(_) | ToolReply::Manage(_) | ToolReply::Talk(_) => {
                        unreachable!("{} is of {:?}", SendJointChunk::NAME, ActCall::TOOLS)
                    }
                };
                Ok((reply, session.ended().is_some()))
            })?;
        let phases = phases.into_iter().map(|phase| phase.number).collect();
        let fallen = fallen.iter().map(|robot| robot.fallen).collect();
        let reason = json!(stop_reason).as_str().unwrap_or_default().to_owned();
        Ok((executed_steps, reason, time_s, phases, fallen, ended))
    }

    /// Takes a snapshot of the episode.
    fn snapshot(&self, py: Python) -> PyResult<Snapshot> {
        if let (Course::Scored, Some(way)) = (self.course, self.course.forward_only()) {
            return Err(failed(py, &way));
        }
        self.work(py, |session| session.checkpoint()).map(|checkpoint| Snapshot { checkpoint })
    }

    /// Restores the state of a snapshot, which may be earlier or later.
    fn restore(&self, py: Python, snapshot: &Snapshot) -> PyResult<()> {
        if let Some(way) = self.course.forward_only() {
            return Err(failed(py, &way));
        }
        self.work(py, |session| session.resume(&snapshot.checkpoint))
    }

    /// Returns 16 hexadecimal digits that are equal for equal physical states.
    fn state_hash(&self, py: Python) -> PyResult<String> {
        if self.course == Course::Scored && self.assistance == Assistance::Paper {
            let way = "an evaluation scores this episode and tells its policy no hash; results.json has that of its end";
            return Err(failed(py, &way));
        }
        self.work(py, |session| Ok(session.state_hash()))
    }

    /// Returns the contract's name of the reason for the episode's end; `None` before the end.
    fn ended(&self, py: Python) -> PyResult<Option<String>> {
        Ok(py.detach(|| match &*self.held() {
            Held::Open(guard) => guard.ended().map(name_of),
            Held::Closed(result) => result.as_ref().map(|result| name_of(result.ended)),
        }))
    }

    /// Ends the episode, closes its recording, and returns the result as JSON. Repeated calls return the same
    /// result.
    fn close(&self, py: Python) -> PyResult<String> {
        self.check_process(py)?;
        let result = py.detach(|| self.end(None)).map_err(|error| refused(py, &error))?;
        // An episode of the caller has no secrets.
        let told = if self.course == Course::Scored { result.disclosed(self.disclosure) } else { result };
        Ok(json!(told).to_string())
    }
}

/// Closes the episode, so that its files are complete. In a forked process, the episode is leaked, because
/// its files belong to the parent.
impl Drop for NativeEpisode {
    fn drop(&mut self) {
        if process::id() == self.process {
            // There may be no caller left to receive an error.
            let _ = self.end(None);
        } else if let Ok(held) = self.held.get_mut() {
            std::mem::forget(std::mem::replace(held, Held::Closed(None)));
        }
    }
}

#[pymethods]
impl Snapshot {
    /// Returns the snapshot in its file format, which the same build can read.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| self.checkpoint.to_bytes()).map_err(|error| refused(py, &error.into()))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Reads a snapshot from the output of `to_bytes`.
    #[staticmethod]
    fn from_bytes(py: Python, bytes: &[u8]) -> PyResult<Snapshot> {
        let read = py.detach(|| Checkpoint::from_bytes(bytes, Path::new("snapshot")));
        read.map(|checkpoint| Snapshot { checkpoint }).map_err(|error| refused(py, &error.into()))
    }
}

/// Reason why an episode cannot begin.
enum StartProblem {
    Refused(HostingError),
    Settings(String),
}

impl StartProblem {
    fn raise(&self, py: Python) -> PyErr {
        match self {
            StartProblem::Refused(error) => refused(py, error),
            StartProblem::Settings(text) => failed(py, text),
        }
    }
}

fn begin(start: &str, settings: &str, folder: Option<&Path>) -> Result<(Session, String), StartProblem> {
    let refuse = |error: EpisodeError| StartProblem::Refused(error.into());
    let layer: Layer =
        serde_json::from_str(settings).map_err(|error| StartProblem::Settings(error.to_string()))?;
    let settings =
        Settings::resolve(layer, None).map_err(|error| StartProblem::Settings(error.to_string()))?;
    let start = parse_args(read(start)).map_err(|error| refuse(error.into()))?;
    let spec = settings.spec(&start).map_err(refuse)?;
    let session = Session::start(&spec, folder).map_err(refuse)?;
    let briefing = json!(session.briefing()).to_string();
    Ok((session, briefing))
}

/// Parses JSON that the package has written.
fn read(json: &str) -> Value {
    serde_json::from_str(json).unwrap_or_default()
}

fn name_of(reason: EndReason) -> String {
    json!(reason).as_str().unwrap_or_default().into()
}
