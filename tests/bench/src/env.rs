//! Speed of learning environments: batches with two or three standing robots each, without images, compared
//! with the simulation core alone.

use std::thread::available_parallelism;
use std::time::{Duration, Instant};

use serde::Serialize;
use tandem_episodes::{
    EpisodeError, EpisodeSpec, build_world,
    rows::{ActionKind, STATE_COLUMNS},
    tasks::{self, Task},
};
use tandem_evaluation::batch::{Autoreset, Batch, BatchError, BatchSpec, BatchStep, RewardKind, SeenArrays};
use tandem_sim::{RobotCommand, World};
use tandem_tools_spec::Protocol;

use crate::error::BenchError;
use crate::spread::{Spread, busy_since};

const WORLDS: usize = 8;
const ROUNDS: usize = 5;
/// Number of steps in which robots come to rest; `STEPS` is the number of timed steps.
const SETTLING_STEPS: u32 = 25;
const STEPS: u32 = 75;
const FIRST_SEED: u32 = 2000;

/// Results of all cases.
#[derive(Clone, Debug, Serialize)]
pub struct EnvReport {
    pub cases: Vec<EnvCase>,
}

/// Results for environments of one task on `threads` threads.
#[derive(Clone, Debug, Serialize)]
pub struct EnvCase {
    pub task: String,
    pub robots: usize,
    pub worlds: usize,
    pub threads: usize,
    /// Environment steps per second, over all worlds.
    pub steps_per_s: Spread,
    /// Control steps per second of the same worlds, one after another on one thread, with physics, sensing
    /// and balance control only.
    pub core_steps_per_s: Spread,
    /// Ratio of `steps_per_s` to `core_steps_per_s`, measured in direct succession.
    pub of_core: Spread,
    /// Ratio of the core's CPU time per step to the environment's, on one thread only. It shows the overhead
    /// around the core even on a busy machine.
    pub busy_of_core: Option<Spread>,
    /// Time to start an episode on one thread.
    pub reset_ms: Spread,
}

/// Times every case. Calls `done` after each.
///
/// # Errors
///
/// Returns an error if a world cannot be built or stepped.
pub fn env(mut done: impl FnMut(&EnvCase)) -> Result<EnvReport, BenchError> {
    let most = available_parallelism().map_or(1, usize::from).min(WORLDS);
    let mut threads = vec![1];
    threads.extend((most > 1).then_some(2));
    threads.extend((most > 2).then_some(most));
    let mut cases = Vec::new();
    // The first task has two robots, the last three.
    for task in [tasks::cohub().first(), tasks::cohub().last()].into_iter().flatten() {
        for threads in threads.iter().copied() {
            let case = measure(task, threads)?;
            done(&case);
            cases.push(case);
        }
    }
    Ok(EnvReport { cases })
}

fn measure(task: &Task, threads: usize) -> Result<EnvCase, BenchError> {
    let episode = EpisodeSpec::new(task, FIRST_SEED, Protocol::Benchmark);
    let (task, robots) = (task.id.clone(), task.robots.len());
    let [mut steps, mut core, mut of_core, mut busy, mut reset_ms] = [const { Vec::new() }; 5];
    for _ in 0..ROUNDS {
        let alone = core_pace(&episode)?;
        let (begin_ms, batch) = batch_pace(&episode, threads)?;
        core.push(alone.steps_per_s);
        steps.push(batch.steps_per_s);
        of_core.push(batch.steps_per_s / alone.steps_per_s);
        busy.push(alone.busy_s / batch.busy_s);
        reset_ms.push(begin_ms);
    }
    let [steps_per_s, core_steps_per_s, of_core, busy, reset_ms] =
        [steps, core, of_core, busy, reset_ms].map(|mut values| Spread::of(&mut values));
    let busy_of_core = (threads == 1).then_some(busy);
    let worlds = WORLDS;
    Ok(EnvCase {
        task,
        robots,
        worlds,
        threads,
        steps_per_s,
        core_steps_per_s,
        of_core,
        busy_of_core,
        reset_ms,
    })
}

/// Step rate, and this thread's CPU time for all steps.
struct Pace {
    steps_per_s: f64,
    busy_s: f64,
}

/// Stopwatch for wall-clock time and CPU time.
struct Stopwatch {
    started: Instant,
    busy: Duration,
}

impl Stopwatch {
    fn start() -> Stopwatch {
        let started = Instant::now();
        Stopwatch { started, busy: busy_since(started) }
    }

    /// Returns the pace of this number of steps of every world.
    fn pace(&self, steps: u32) -> Pace {
        let elapsed_s = self.started.elapsed().as_secs_f64();
        let busy_s = (busy_since(self.started) - self.busy).as_secs_f64();
        Pace { steps_per_s: f64::from(steps) * WORLDS as f64 / elapsed_s, busy_s }
    }
}

/// Times the worlds of these episodes under their rest commands. The worlds are stepped in turn, like the
/// worlds of a batch.
fn core_pace(episode: &EpisodeSpec) -> Result<Pace, BenchError> {
    let begin = |seed: usize| -> Result<(World, Vec<RobotCommand>), BenchError> {
        let seed = FIRST_SEED + seed as u32;
        let world = build_world(&episode.seeded(seed)).map_err(Box::new)?.world;
        let commands = (0..world.robots().len()).map(|robot| world.rest_command(robot)).collect();
        Ok((world, commands))
    };
    let mut worlds = (0..WORLDS).map(begin).collect::<Result<Vec<_>, _>>()?;
    let mut run = |steps: u32| -> Result<Pace, BenchError> {
        let watch = Stopwatch::start();
        for step in 1..=steps {
            for (world, commands) in &mut worlds {
                let stepped = world.control_step(commands);
                stepped.map_err(|source| Box::new(EpisodeError::Diverged { step: step.into(), source }))?;
            }
        }
        Ok(watch.pace(steps))
    };
    run(SETTLING_STEPS)?;
    run(STEPS)
}

/// Times the same worlds as environments. Returns the time to start an episode, and the pace of the steps.
fn batch_pace(episode: &EpisodeSpec, threads: usize) -> Result<(f64, Pace), BenchError> {
    let world = build_world(episode).map_err(Box::new)?.world;
    let row = |robot: usize| {
        let RobotCommand { upper_rad, base } = world.rest_command(robot);
        let base = [base.vx_m_s, base.vy_m_s, base.yaw_rate_rad_s, base.pelvis_height_m];
        upper_rad.into_iter().chain(base)
    };
    let robots = episode.task.robots.len();
    let actions = (0..robots).flat_map(row).collect::<Vec<f32>>().repeat(WORLDS);
    let mut batch = Batch::new(BatchSpec {
        episode: episode.clone(),
        worlds: WORLDS,
        threads,
        actions: ActionKind::Joints,
        steps_per_row: 1,
        reward: RewardKind::Sparse,
        pictures_px: None,
        record: None,
    });
    let mut states = vec![0.0; WORLDS * robots * STATE_COLUMNS];
    let started = Instant::now();
    let seeds: Vec<_> = (0..WORLDS as u32).map(|world| Some(Some(FIRST_SEED + world))).collect();
    batch.reset(&seeds, SeenArrays::of_states(&mut states)).map_err(failed)?;
    let begin_ms = started.elapsed().as_secs_f64() * 1e3 * threads as f64 / WORLDS as f64;
    let mut run = |steps: u32| -> Result<Pace, BenchError> {
        let watch = Stopwatch::start();
        for _ in 0..steps {
            let step = BatchStep { action_rows: &actions, autoreset: Autoreset::NextStep, looks: false };
            batch.step(step, SeenArrays::of_states(&mut states), SeenArrays::default()).map_err(failed)?;
        }
        Ok(watch.pace(steps))
    };
    run(SETTLING_STEPS)?;
    Ok((begin_ms, run(STEPS)?))
}

fn failed(error: BatchError) -> BenchError {
    BenchError::Batch(Box::new(error))
}
