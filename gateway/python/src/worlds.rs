//! Many worlds of one task that step together, for learning environments, and the layout of their rows.

use std::path::PathBuf;
use std::process;
use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, PyArray4, PyReadonlyArray3, PyReadwriteArray3, PyReadwriteArray5};
use pyo3::prelude::*;
use tandem::settings::{Layer, Settings};
use tandem_episodes::EpisodeSpec;
use tandem_episodes::rows::{
    ActionKind, ROW_CONTRACT_VERSION, ROW_RATES_HZ, RowContract, STATE_COLUMNS, steps_per_row,
};
use tandem_evaluation::batch::{
    Autoreset, Batch, BatchError, BatchSpec, BatchStep, RewardKind, SeenArrays, WorldStep,
};
use tandem_tools_spec::{Protocol, StartEpisode};

use crate::arrays::shaped;
use crate::refusal::{failed, forked, refused};

/// Worlds of one task. They may be used from any thread, but concurrent calls are serialized.
#[pyclass(frozen, name = "Worlds", module = "tandem._native")]
pub struct NativeWorlds {
    batch: Mutex<Option<Batch>>,
    /// Id of the process that created the worlds. A forked process has neither the threads nor the files of
    /// its parent.
    process: u32,
    worlds: usize,
    robots: usize,
    actions: ActionKind,
}

/// Outcomes by world: reward, terminated, truncated, phases, falls by robot, steps, seed of the episode, and
/// seed of the next episode if it has begun, otherwise -1. Then the worlds in which the simulator failed,
/// with the errors. The last array is the share of joint targets beyond the joints' limits, by world.
type Outcomes<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray2<bool>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<i64>>,
    Vec<(usize, String)>,
    Bound<'py, PyArray1<f64>>,
);

/// Output arrays of observations: states (worlds by robots by columns), and images (worlds by robots by
/// height by width by red, green, blue).
type Seen<'py> = (PyReadwriteArray3<'py, f32>, Option<PyReadwriteArray5<'py, u8>>);

#[pymethods]
impl NativeWorlds {
    /// Creates worlds without episodes. If `threads` is 0, there are as many threads as cores.
    #[new]
    #[pyo3(signature = (task, settings, worlds, threads, actions, rate_hz, reward, pictures, record))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python,
        task: String,
        settings: &str,
        worlds: usize,
        threads: usize,
        actions: &str,
        rate_hz: u32,
        reward: &str,
        pictures: Option<[u32; 2]>,
        record: Option<PathBuf>,
    ) -> PyResult<NativeWorlds> {
        let text = |error: &dyn std::fmt::Display| failed(py, error);
        let episode = benchmark_episode(py, task, settings)?;
        let robots = episode.task.robots.len();
        let actions = action_kind(py, actions)?;
        let steps_per_row = steps_per_row(rate_hz).map_err(|error| text(&error))?;
        let reward =
            one_of("reward", reward, &RewardKind::ALL, RewardKind::name).map_err(|error| text(&error))?;
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if threads == 0 { cores() } else { threads };
        let pictures_px = pictures;
        let spec =
            BatchSpec { episode, worlds, threads, actions, steps_per_row, reward, pictures_px, record };
        let batch = Mutex::new(Some(Batch::new(spec)));
        Ok(NativeWorlds { batch, process: process::id(), worlds, robots, actions })
    }

    /// Begins an episode in each chosen world. The seed is the given one, or that of the next round if the
    /// given one is negative.
    fn reset<'py>(
        &self,
        py: Python<'py>,
        chosen: Vec<bool>,
        seeds: Vec<i64>,
        seen: Seen<'py>,
    ) -> PyResult<Outcomes<'py>> {
        let seeds: Vec<Option<Option<u32>>> = chosen
            .into_iter()
            .zip(seeds)
            .map(|(chosen, seed)| chosen.then_some(u32::try_from(seed).ok()))
            .collect();
        let (mut states, mut pictures) = seen;
        let seen = self.seen(py, &mut states, &mut pictures)?;
        let begun = self.work(py, |batch| batch.reset(&seeds, seen))?;
        let begun = begun.into_iter().map(Option::unwrap_or_default).collect();
        self.outcomes(py, begun)
    }

    /// Executes a row for each robot in each world, given as worlds by robots by columns.
    fn step<'py>(
        &self,
        py: Python<'py>,
        actions: PyReadonlyArray3<'py, f32>,
        autoreset: &str,
        looks: bool,
        seen: Seen<'py>,
        last: Option<Seen<'py>>,
    ) -> PyResult<Outcomes<'py>> {
        let expected = [self.worlds, self.robots, self.actions.row_len()];
        let shape = numpy::PyUntypedArrayMethods::shape(&*actions);
        if shape != expected {
            return Err(failed(py, &format!("actions have the shape {shape:?}; give {expected:?}: {SHAPE}")));
        }
        let actions = actions.as_slice()?;
        let autoreset = one_of("autoreset", autoreset, &Autoreset::ALL, Autoreset::name)
            .map_err(|error| failed(py, &error))?;
        let (mut states, mut pictures) = seen;
        let seen = self.seen(py, &mut states, &mut pictures)?;
        let step = BatchStep { action_rows: actions, autoreset, looks };
        let stepped = match last {
            Some((mut states, mut pictures)) => {
                let last = self.seen(py, &mut states, &mut pictures)?;
                self.work(py, |batch| batch.step(step, seen, last))
            }
            None => self.work(py, |batch| batch.step(step, seen, SeenArrays::default())),
        }?;
        self.outcomes(py, stepped)
    }

    /// Renders the images of a world's robots: robots by height by width by red, green, blue.
    fn draw<'py>(&self, py: Python<'py>, world: usize, size: [u32; 2]) -> PyResult<Bound<'py, PyArray4<u8>>> {
        let pixels = self.work(py, |batch| batch.draw(world, size))?;
        let [width, height] = size.map(|length| length as usize);
        shaped(py, &pixels, [self.robots, height, width, 3])
    }

    /// Returns the hash of a world's physical state: 16 hexadecimal digits, which are equal for equal states.
    fn state_hash(&self, py: Python, world: usize) -> PyResult<String> {
        self.work(py, |batch| batch.state_hash(world))
    }

    /// Ends all episodes and closes their recordings.
    fn close(&self, py: Python) {
        if process::id() == self.process {
            py.detach(|| drop(self.held().take()));
        }
    }
}

const SHAPE: &str = "worlds by robots by the numbers of a row";

impl NativeWorlds {
    fn held(&self) -> MutexGuard<'_, Option<Batch>> {
        self.batch.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs `work` on the worlds. Other Python threads run meanwhile.
    fn work<T: Send>(
        &self,
        py: Python,
        work: impl FnOnce(&mut Batch) -> Result<T, BatchError> + Send,
    ) -> PyResult<T> {
        if process::id() != self.process {
            return Err(failed(py, &forked(self.process)));
        }
        match py.detach(|| self.held().as_mut().map(work)) {
            Some(Ok(done)) => Ok(done),
            Some(Err(BatchError::Episode(error))) => Err(refused(py, &error.into())),
            Some(Err(error)) => Err(failed(py, &error)),
            None => Err(failed(py, &"these worlds have been closed; make new ones")),
        }
    }

    /// Returns the output arrays if they are large enough.
    fn seen<'a>(
        &self,
        py: Python,
        states: &'a mut PyReadwriteArray3<f32>,
        pictures: &'a mut Option<PyReadwriteArray5<u8>>,
    ) -> PyResult<SeenArrays<'a>> {
        let state_rows = states.as_slice_mut()?;
        if state_rows.len() != self.worlds * self.robots * STATE_COLUMNS {
            return Err(failed(py, &"the array for states has another size"));
        }
        let pictures: &mut [u8] = match pictures {
            Some(pictures) => pictures.as_slice_mut()?,
            None => &mut [],
        };
        Ok(SeenArrays { state_rows, pictures })
    }

    fn outcomes<'py>(&self, py: Python<'py>, steps: Vec<WorldStep>) -> PyResult<Outcomes<'py>> {
        fn array<'py, T: numpy::Element>(
            py: Python<'py>,
            steps: &[WorldStep],
            of: impl Fn(&WorldStep) -> T,
        ) -> Bound<'py, PyArray1<T>> {
            PyArray1::from_iter(py, steps.iter().map(of))
        }
        let fallen = |[world, robot]: [usize; 2]| steps[world].fallen.get(robot) == Some(&true);
        let fallen =
            Array2::from_shape_fn([self.worlds, self.robots], |(world, robot)| fallen([world, robot]));
        let failures =
            steps.iter().enumerate().filter_map(|(world, step)| Some((world, step.failure.clone()?)));
        Ok((
            array(py, &steps, |step| step.reward),
            array(py, &steps, |step| step.terminated),
            array(py, &steps, |step| step.truncated),
            array(py, &steps, |step| step.phases as i64),
            PyArray2::from_owned_array(py, fallen),
            array(py, &steps, |step| i64::from(step.env_steps)),
            array(py, &steps, |step| i64::from(step.seed)),
            array(py, &steps, |step| step.next_seed.map_or(-1, i64::from)),
            failures.collect(),
            array(py, &steps, |step| step.joints_clamped_share),
        ))
    }
}

/// Leaks the worlds in a forked process, because their files belong to the parent.
impl Drop for NativeWorlds {
    fn drop(&mut self) {
        if process::id() != self.process {
            std::mem::forget(self.batch.get_mut().unwrap_or_else(PoisonError::into_inner).take());
        }
    }
}

/// Returns the layout of a robot's rows in environments of a task, as JSON.
#[pyfunction]
pub fn row_contract(py: Python, task: String, settings: &str, actions: &str) -> PyResult<String> {
    let episode = benchmark_episode(py, task, settings)?;
    contract_json(py, &episode, action_kind(py, actions)?)
}

/// Returns the rates in Hz at which rows are written and played. The control rate is first.
#[pyfunction]
pub fn row_rates_hz() -> Vec<u32> {
    ROW_RATES_HZ.to_vec()
}

/// Returns the number of values of a robot's state.
#[pyfunction]
pub fn row_state_columns() -> usize {
    STATE_COLUMNS
}

/// Returns the version of the layout.
#[pyfunction]
pub fn row_contract_version() -> u32 {
    ROW_CONTRACT_VERSION
}

/// Returns the layout of the rows of an episode's robots, as JSON.
pub fn contract_json(py: Python, episode: &EpisodeSpec, actions: ActionKind) -> PyResult<String> {
    let contract = RowContract::of(episode, actions).map_err(|error| failed(py, &error))?;
    serde_json::to_string(&contract).map_err(|error| failed(py, &error))
}

fn benchmark_episode(py: Python, task: String, settings: &str) -> PyResult<EpisodeSpec> {
    let layer: Layer = serde_json::from_str(settings).map_err(|error| failed(py, &error))?;
    let settings = Settings::resolve(layer, None).map_err(|error| failed(py, &error))?;
    let start = StartEpisode { task, seed: 0, protocol: Some(Protocol::Benchmark), short: false };
    settings.spec(&start).map_err(|error| refused(py, &error.into()))
}

fn action_kind(py: Python, actions: &str) -> PyResult<ActionKind> {
    one_of("actions", actions, &ActionKind::ALL, ActionKind::name).map_err(|error| failed(py, &error))
}

fn one_of<T: Copy>(what: &str, asked: &str, all: &[T], name: fn(T) -> &'static str) -> Result<T, String> {
    all.iter().copied().find(|one| name(*one) == asked).ok_or_else(|| {
        let have: Vec<&str> = all.iter().map(|one| name(*one)).collect();
        format!("no {what} {asked:?}; have: {}", have.join(", "))
    })
}
