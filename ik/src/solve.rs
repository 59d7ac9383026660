//! Whole solutions: steps with a clamped error and a line search, until the frames are there or nothing moves.

use nalgebra::{Isometry3, UnitQuaternion};

use crate::Configuration;
use crate::report::{ClampedJoint, Outcome, SolveReport, saturated};
use crate::solver::{Solver, frame_errors};
use crate::task::Task;

/// How long and how hard to try.
#[derive(Clone, Debug)]
pub struct SolveOptions {
    /// Steps of one attempt.
    pub max_iterations: usize,
    /// A frame's error is cut to this distance (m) and angle (rad) in each step: far targets do not upset near joints.
    pub error_clamp: Option<(f64, f64)>,
    /// Halve a step until the error does not grow.
    pub line_search: bool,
    /// Further attempts from random coordinates after a stall; for planning, never for streaming.
    pub restarts: usize,
    /// Seed of those coordinates.
    pub seed: u64,
    /// Tasks that hold exactly, as in [`Solver::step`].
    pub constraints: Vec<Task>,
}

impl Default for SolveOptions {
    /// 200 steps, error clamp 0.3 m and 0.9 rad, line search, no restarts.
    fn default() -> Self {
        SolveOptions {
            max_iterations: 200,
            error_clamp: Some((0.3, 0.9)),
            line_search: true,
            restarts: 0,
            seed: 1,
            constraints: Vec::new(),
        }
    }
}

const MAX_HALVINGS: usize = 5;
/// An attempt has stalled after this many steps without the squared error falling by [`PROGRESS`].
const PATIENCE: usize = 20;
const PROGRESS: f64 = 0.98;
/// The last attempt goes on until the joints are slower than this, rad/s or m/s.
const REST_SPEED: f64 = 0.04;
/// Random starts keep this part of each joint's range.
const START_RANGE: f64 = 0.8;

/// Where an attempt ended.
struct Attempt {
    outcome: Outcome,
    q: Vec<f64>,
    squared_error: f64,
    clamped: Vec<ClampedJoint>,
    final_speed: f64,
}

impl Solver {
    /// Moves `configuration` to `tasks`. If no attempt gets there, it is left at the best coordinates found.
    pub fn solve(
        &mut self,
        configuration: &mut Configuration,
        tasks: &[Task],
        options: &SolveOptions,
    ) -> SolveReport {
        let mut random = options.seed.max(1);
        let mut iterations = 0;
        let to_rest = |attempt| attempt == options.restarts;
        let mut best = self.attempt(configuration, tasks, options, to_rest(0), &mut iterations);
        let mut restarts = 0;
        while best.outcome != Outcome::Reached && restarts < options.restarts {
            restarts += 1;
            configuration.place(|joint| random_coordinate(joint, &mut random));
            let attempt = self.attempt(configuration, tasks, options, to_rest(restarts), &mut iterations);
            if attempt.outcome == Outcome::Reached || attempt.squared_error < best.squared_error {
                best = attempt;
            }
        }
        let mut q = best.q.iter();
        configuration.place(|_| *q.next().expect("one coordinate per joint"));
        SolveReport {
            outcome: best.outcome,
            iterations,
            restarts,
            errors: frame_errors(configuration, tasks).collect(),
            clamped: best.clamped,
            closest_pair: self.closest_pair(configuration),
            final_speed: best.final_speed,
        }
    }

    fn attempt(
        &mut self,
        configuration: &mut Configuration,
        tasks: &[Task],
        options: &SolveOptions,
        to_rest: bool,
        iterations: &mut usize,
    ) -> Attempt {
        self.rest();
        let (outcome, final_speed) = self.iterate(configuration, tasks, options, to_rest, iterations);
        Attempt {
            outcome,
            q: configuration.q().to_vec(),
            squared_error: squared_error(configuration, tasks),
            clamped: self.clamped(configuration).collect(),
            final_speed,
        }
    }

    /// How an attempt ended, and the largest joint speed in its last step.
    fn iterate(
        &mut self,
        configuration: &mut Configuration,
        tasks: &[Task],
        options: &SolveOptions,
        to_rest: bool,
        iterations: &mut usize,
    ) -> (Outcome, f64) {
        let mut clamped = tasks.to_vec();
        let mut damping = 1.0_f64;
        let mut error = squared_error(configuration, tasks);
        let (mut least, mut since, mut speed) = (f64::INFINITY, 0, 0.0);
        for _ in 0..options.max_iterations {
            if self.is_reached(configuration, tasks) {
                return (Outcome::Reached, speed);
            }
            if error < PROGRESS * least {
                (least, since) = (error, 0);
            } else {
                since += 1;
                if since > PATIENCE && (!to_rest || speed < REST_SPEED) {
                    return (Outcome::Stalled { saturated: saturated(configuration) }, speed);
                }
            }
            *iterations += 1;
            prepare(&mut clamped, tasks, configuration, options, damping);
            if let Err(failure) = self.displacement(configuration, &clamped, &options.constraints) {
                return (self.infeasible(configuration.model(), &options.constraints, failure), 0.0);
            }
            let step = self.last_displacement();
            let fastest = step.iter().fold(0.0_f64, |fastest, dq| fastest.max(dq.abs())) / self.dt_s;
            speed = fastest;
            configuration.advance(step, 1.0);
            let mut after = squared_error(configuration, tasks);
            if !options.line_search {
                error = after;
                continue;
            }
            let mut scale = 1.0;
            let grows = |after: f64| after > error * (1.0 + 1e-9);
            for _ in 1..MAX_HALVINGS {
                if !grows(after) {
                    break;
                }
                scale *= 0.5;
                configuration.advance(step, -scale);
                after = squared_error(configuration, tasks);
            }
            if grows(after) {
                configuration.advance(step, -scale);
                damping = (damping * 3.0).min(1e3);
                speed = 0.0;
            } else {
                speed = fastest * scale;
                damping = (damping * 0.5).max(1.0);
                error = after;
            }
        }
        let outcome = if self.is_reached(configuration, tasks) { Outcome::Reached } else { Outcome::Moving };
        (outcome, speed)
    }
}

/// Copies what one step works on: frame targets within reach of the clamp, damping scaled up after failed steps.
fn prepare(
    prepared: &mut [Task],
    tasks: &[Task],
    configuration: &Configuration,
    options: &SolveOptions,
    damping: f64,
) {
    for (prepared, task) in prepared.iter_mut().zip(tasks) {
        match (prepared, task) {
            (Task::Frame(prepared), Task::Frame(task)) => {
                let now = configuration.root_from_frame(task.frame);
                prepared.target = clamped(&task.target, &now, options.error_clamp);
            }
            (Task::RelativeFrame(prepared), Task::RelativeFrame(task)) => {
                let reference_from_root = configuration.root_from_frame(task.reference).inverse();
                let now = reference_from_root * configuration.root_from_frame(task.frame);
                prepared.target = clamped(&task.target, &now, options.error_clamp);
            }
            (Task::Damping(prepared), Task::Damping(task)) => prepared.cost = task.cost * damping,
            _ => {}
        }
    }
}

/// The target, pulled towards where the frame is now until it is within the clamp's distance and angle of it.
fn clamped(target: &Isometry3<f64>, now: &Isometry3<f64>, clamp: Option<(f64, f64)>) -> Isometry3<f64> {
    let Some((position_m, angle_rad)) = clamp else { return *target };
    let way = target.translation.vector - now.translation.vector;
    let turn = now.rotation.inverse() * target.rotation;
    let translation =
        now.translation.vector + way * (position_m / way.norm().max(f64::MIN_POSITIVE)).min(1.0);
    let part = (angle_rad / turn.angle().max(f64::MIN_POSITIVE)).min(1.0);
    let rotation = now.rotation * UnitQuaternion::from_scaled_axis(turn.scaled_axis() * part);
    Isometry3::from_parts(translation.into(), rotation)
}

fn squared_error(configuration: &Configuration, tasks: &[Task]) -> f64 {
    frame_errors(configuration, tasks).map(|error| error.squared()).sum()
}

/// Uniform in the middle of a joint's range; xorshift64 (Marsaglia 2003).
pub(crate) fn random_coordinate(joint: &crate::Joint, state: &mut u64) -> f64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    let unit = (*state >> 11) as f64 / (1_u64 << 53) as f64;
    let (lower, upper) = (joint.lower.max(-std::f64::consts::PI), joint.upper.min(std::f64::consts::PI));
    0.5 * (lower + upper) + 0.5 * START_RANGE * (upper - lower) * (2.0 * unit - 1.0)
}
