//! How fast environments of learners step: batches of two and three robots that stand, without pictures, against the core alone.

use std::thread::available_parallelism;
use std::time::Instant;

use serde::Serialize;
use tandem_sim::bench::Spread;
use tandem_sim::{RobotCommand, World};
use tandem_tools_spec::Protocol;

use super::BenchError;
use crate::batch::{
    ActionKind, Autoreset, Batch, BatchError, BatchSpec, BatchStep, RewardKind, STATE_COLUMNS, SeenArrays,
};
use crate::session::build;
use crate::spec::EpisodeSpec;
use crate::{EpisodeError, tasks};

const TASKS: [&str; 2] = ["handover", "big_table"];
const WORLDS: usize = 8;
const ROUNDS: usize = 5;
/// Steps in which robots come to rest, and those that are timed.
const SETTLING_STEPS: u32 = 25;
const STEPS: u32 = 75;
const FIRST_SEED: u32 = 2000;

/// All cases.
#[derive(Clone, Debug, Serialize)]
pub struct EnvReport {
    pub cases: Vec<EnvCase>,
}

/// Environments of one task on so many threads.
#[derive(Clone, Debug, Serialize)]
pub struct EnvCase {
    pub task: &'static str,
    pub robots: usize,
    pub worlds: usize,
    pub threads: usize,
    /// Steps of environments, of all worlds together.
    pub steps_per_s: Spread,
    /// Control steps of such worlds one after another on one thread, with physics, sensing and balance, and nothing around them.
    pub core_steps_per_s: Spread,
    /// The first over the second, each measured right after the other.
    pub of_core: Spread,
    /// What the beginning of an episode takes, on one thread.
    pub reset_ms: Spread,
}

/// Times every case; `done` hears of each as it ends.
pub fn env(mut done: impl FnMut(&EnvCase)) -> Result<EnvReport, BenchError> {
    let most = available_parallelism().map_or(1, usize::from).min(WORLDS);
    let mut threads = vec![1];
    threads.extend((most > 1).then_some(2));
    threads.extend((most > 2).then_some(most));
    let mut cases = Vec::new();
    for task in TASKS {
        for threads in threads.iter().copied() {
            let case = measure(task, threads)?;
            done(&case);
            cases.push(case);
        }
    }
    Ok(EnvReport { cases })
}

fn measure(task: &'static str, threads: usize) -> Result<EnvCase, BenchError> {
    let episode = EpisodeSpec::new(tasks::find(task).map_err(Box::new)?, FIRST_SEED, Protocol::Benchmark);
    let robots = episode.task.robots.len();
    let [mut steps, mut core, mut of_core, mut reset_ms] = [const { Vec::new() }; 4];
    for _ in 0..ROUNDS {
        let alone = core_steps_per_s(&episode)?;
        let (begin_ms, batch) = batch_steps_per_s(&episode, threads)?;
        core.push(alone);
        steps.push(batch);
        of_core.push(batch / alone);
        reset_ms.push(begin_ms);
    }
    let [steps_per_s, core_steps_per_s, of_core, reset_ms] =
        [steps, core, of_core, reset_ms].map(|mut values| Spread::of(&mut values));
    Ok(EnvCase { task, robots, worlds: WORLDS, threads, steps_per_s, core_steps_per_s, of_core, reset_ms })
}

/// The worlds of these episodes under their rest commands, taking turns as those of a batch do.
fn core_steps_per_s(episode: &EpisodeSpec) -> Result<f64, BenchError> {
    let begin = |seed: usize| -> Result<(World, Vec<RobotCommand>), BenchError> {
        let seed = FIRST_SEED + seed as u32;
        let world = build(&EpisodeSpec { seed, ..episode.clone() }).map_err(Box::new)?.world;
        let commands = (0..world.robots().len()).map(|robot| world.rest_command(robot)).collect();
        Ok((world, commands))
    };
    let mut worlds = (0..WORLDS).map(begin).collect::<Result<Vec<_>, _>>()?;
    let mut run = |steps: u32| -> Result<f64, BenchError> {
        let started = Instant::now();
        for step in 1..=steps {
            for (world, commands) in &mut worlds {
                let stepped = world.control_step(commands);
                stepped.map_err(|source| Box::new(EpisodeError::Diverged { step: step.into(), source }))?;
            }
        }
        Ok(f64::from(steps) * WORLDS as f64 / started.elapsed().as_secs_f64())
    };
    run(SETTLING_STEPS)?;
    run(STEPS)
}

/// The same as environments: how long an episode takes to begin, and steps per second.
fn batch_steps_per_s(episode: &EpisodeSpec, threads: usize) -> Result<(f64, f64), BenchError> {
    let world = build(episode).map_err(Box::new)?.world;
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
        reward: RewardKind::Sparse,
        pictures_px: None,
        record: None,
    });
    let mut states = vec![0.0; WORLDS * robots * STATE_COLUMNS];
    let started = Instant::now();
    let seeds: Vec<_> = (0..WORLDS as u32).map(|world| Some(Some(FIRST_SEED + world))).collect();
    batch.reset(&seeds, SeenArrays::of_states(&mut states)).map_err(failed)?;
    let begin_ms = started.elapsed().as_secs_f64() * 1e3 * threads as f64 / WORLDS as f64;
    let mut run = |steps: u32| -> Result<f64, BenchError> {
        let started = Instant::now();
        for _ in 0..steps {
            let step = BatchStep { actions: &actions, autoreset: Autoreset::NextStep, looks: false };
            batch.step(step, SeenArrays::of_states(&mut states), SeenArrays::default()).map_err(failed)?;
        }
        Ok(f64::from(steps) * WORLDS as f64 / started.elapsed().as_secs_f64())
    };
    run(SETTLING_STEPS)?;
    Ok((begin_ms, run(STEPS)?))
}

fn failed(error: BatchError) -> BenchError {
    BenchError::Batch(Box::new(error))
}
