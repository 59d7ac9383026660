//! Complete solutions: steps with a clamped error and a line search, until the frames reach their targets or
//! the joints no longer move.

use super::report::{ClampedJoint, Outcome, SolveReport, saturated};
use super::step::{Solver, frame_errors};
use crate::model::{Configuration, Joint};
use crate::tasks::Task;

/// Limits on the effort of a solution.
#[derive(Clone, Debug)]
pub struct SolveOptions {
    /// Maximum number of steps of one attempt.
    pub max_iterations: usize,
    /// Further attempts from random coordinates after a stall. They are for planning, never for streaming.
    pub restarts: usize,
    /// Seed of these random coordinates.
    pub seed: u64,
    /// Tasks that hold exactly, as in [`Solver::step`].
    pub constraints: Vec<Task>,
}

impl Default for SolveOptions {
    /// Returns options with 200 steps and no restarts.
    fn default() -> Self {
        SolveOptions { max_iterations: 200, restarts: 0, seed: 1, constraints: Vec::new() }
    }
}

/// Number of steps without the squared error falling by [`PROGRESS`] after which an attempt has stalled.
const PATIENCE: usize = 20;
const PROGRESS: f64 = 0.98;
/// Joint speed below which the last attempt ends, rad/s or m/s.
const REST_SPEED: f64 = 0.04;
/// Share of each joint's range that random starts use.
const START_RANGE: f64 = 0.8;

/// Final state of an attempt.
struct Attempt {
    outcome: Outcome,
    q: Vec<f64>,
    squared_error: f64,
    clamped: Vec<ClampedJoint>,
    final_speed: f64,
}

impl Solver {
    /// Moves `configuration` to `tasks`. If no attempt succeeds, it is left at the best coordinates found.
    pub fn solve(
        &mut self,
        configuration: &mut Configuration,
        tasks: &[Task],
        options: &SolveOptions,
    ) -> SolveReport {
        let mut random = options.seed.max(1);
        let start = configuration.q().to_vec();
        let mut iterations = 0;
        let to_rest = |attempt| attempt == options.restarts;
        let mut best = self.attempt(configuration, tasks, options, to_rest(0), &mut iterations);
        let mut restarts = 0;
        while best.outcome != Outcome::Reached && restarts < options.restarts {
            restarts += 1;
            let mut held =
                start.iter().zip(&self.limits.velocity).map(|(q, speed)| (*speed == 0.0).then_some(*q));
            configuration.place(|joint| {
                let drawn = random_coordinate(joint, &mut random);
                held.next().flatten().unwrap_or(drawn)
            });
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
        let outcome = self.iterate(configuration, tasks, options, to_rest, iterations);
        Attempt {
            outcome,
            q: configuration.q().to_vec(),
            squared_error: squared_error(configuration, tasks),
            clamped: self.clamped(configuration).collect(),
            final_speed: self.fastest(),
        }
    }

    /// Runs the steps of an attempt and returns its outcome.
    fn iterate(
        &mut self,
        configuration: &mut Configuration,
        tasks: &[Task],
        options: &SolveOptions,
        to_rest: bool,
        iterations: &mut usize,
    ) -> Outcome {
        let (mut least, mut since) = (f64::INFINITY, 0);
        for _ in 0..options.max_iterations {
            if self.is_reached(configuration, tasks) {
                return Outcome::Reached;
            }
            let error = squared_error(configuration, tasks);
            if error < PROGRESS * least {
                (least, since) = (error, 0);
            } else {
                since += 1;
                if since > PATIENCE && (!to_rest || self.fastest() < REST_SPEED) {
                    return Outcome::Stalled { saturated: saturated(configuration) };
                }
            }
            *iterations += 1;
            if let Err(failure) = self.guarded_step(configuration, tasks, &options.constraints) {
                self.rest();
                return self.infeasible(configuration.model(), &options.constraints, failure);
            }
        }
        if self.is_reached(configuration, tasks) { Outcome::Reached } else { Outcome::Moving }
    }
}

fn squared_error(configuration: &Configuration, tasks: &[Task]) -> f64 {
    frame_errors(configuration, tasks).map(|error| error.squared()).sum()
}

/// Draws a coordinate uniformly in the middle of a joint's range; xorshift64 (Marsaglia 2003).
pub(crate) fn random_coordinate(joint: &Joint, state: &mut u64) -> f64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    let unit = (*state >> 11) as f64 / (1_u64 << 53) as f64;
    let (lower, upper) = (joint.lower.max(-std::f64::consts::PI), joint.upper.min(std::f64::consts::PI));
    0.5 * (lower + upper) + 0.5 * START_RANGE * (upper - lower) * (2.0 * unit - 1.0)
}
