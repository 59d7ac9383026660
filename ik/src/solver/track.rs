//! Steps that do not increase the objective, unless limits or barriers demand it: errors are clamped,
//! steps halved, and failures make the solver cautious.
//!
//! Near a singular posture, for example a straight arm, a step along J^+ e overshoots, and the next one
//! overshoots back. Here a step is halved until it lowers the objective  sum over tasks
//! alpha/2 |W e|^2,  of which the quadratic program's solution is a descent direction. If halving does
//! not help, the joints stay and further steps are damped by
//!   mu = CAUTION^2 (caution^2 - 1),
//! with caution tripled if no part of a step helps, raised by half if only a part does, and halved after a
//! whole step. Source: Levenberg 1944; Nocedal and Wright, Numerical Optimization, 2006, chapters 3 and 10.

use super::report::Outcome;
use super::step::Solver;
use crate::model::Configuration;
use crate::qp::QpFailure;
use crate::tasks::{ERROR_CLAMP, Task};

const MAX_HALVINGS: usize = 5;
/// Damping per joint at a caution of 1, 1/rad or 1/m.
const CAUTION: f64 = 1e-2;
const MAX_CAUTION: f64 = 1e3;
/// Relative growth of an objective that counts as rounding.
const SAME: f64 = 1e-9;
/// Violations above which a step must correct them at once, without a line search, rad or m per step.
const URGENT: f64 = 1e-4;

impl Solver {
    /// Takes one step like [`Solver::step`], for targets that may move and may be out of reach, where
    /// the joints come to rest.
    pub fn track(
        &mut self,
        configuration: &mut Configuration,
        tasks: &[Task],
        constraints: &[Task],
    ) -> Outcome {
        match self.guarded_step(configuration, tasks, constraints) {
            Ok(()) => self.outcome(configuration, tasks),
            Err(failure) => {
                self.rest();
                self.infeasible(configuration.model(), constraints, failure)
            }
        }
    }

    /// Moves by the part of the quadratic program's solution that lowers the objective, possibly none.
    pub(crate) fn guarded_step(
        &mut self,
        configuration: &mut Configuration,
        tasks: &[Task],
        constraints: &[Task],
    ) -> Result<(), QpFailure> {
        let before = objective(configuration, tasks);
        let damping = CAUTION * CAUTION * (self.caution * self.caution - 1.0);
        self.displacement(configuration, tasks, constraints, Some(ERROR_CLAMP), damping)?;
        // Joints that must brake or come back, and shapes that must part, do so at any cost.
        let urgent = self.crosses_barrier(configuration) || !self.qp.accepts_standstill(URGENT);
        let mut scale = 1.0;
        configuration.advance(&self.qp.x, scale);
        if !urgent {
            let worse =
                |configuration: &Configuration| objective(configuration, tasks) > before * (1.0 + SAME);
            let mut halvings = 0;
            while worse(configuration) {
                halvings += 1;
                let next = if halvings < MAX_HALVINGS { 0.5 * scale } else { 0.0 };
                configuration.advance(&self.qp.x, next - scale);
                scale = next;
                if scale == 0.0 {
                    break;
                }
            }
        }
        self.caution = match scale {
            1.0 => (self.caution * 0.5).max(1.0),
            0.0 => (self.caution * 3.0).min(MAX_CAUTION),
            _ => (self.caution * 1.5).min(MAX_CAUTION),
        };
        self.remember(scale);
        Ok(())
    }
}

fn objective(configuration: &Configuration, tasks: &[Task]) -> f64 {
    tasks.iter().map(|task| task.goal().objective(configuration)).sum()
}
