//! The quadratic program of one step: bounds, cost and rows from limits, tasks and barriers, and its
//! solution.

use super::program::{Cost, Equalities, RowOwner, name_failure};
use super::report::Outcome;
use super::step::Solver;
use crate::model::{Configuration, Model};
use crate::qp::{QpFailure, Rows};
use crate::tasks::{FrameError, Sink, StepContext, Task};

/// Term on the Hessian's diagonal: joints that no task moves stay where they are.
const REGULARIZATION: f64 = 1e-12;
/// Maximum recovery speed of a violated barrier, as a share of the speed that the joints can provide.
const RECOVERY: f64 = 0.5;

impl Solver {
    /// Sets up and solves the quadratic program; the displacement is in `self.qp.x`.
    ///
    /// A violated barrier demands a recovery motion. The demand is limited to a share of the joints' maximum
    /// motion. If such demands contradict each other, the joints stand still.
    pub(crate) fn displacement(
        &mut self,
        configuration: &Configuration,
        tasks: &[Task],
        constraints: &[Task],
        error_clamp: Option<FrameError>,
        damping: f64,
    ) -> Result<(), QpFailure> {
        self.write_bounds(configuration);
        self.write_cost(configuration, tasks, error_clamp, REGULARIZATION + damping);
        self.write_rows(configuration, constraints);
        match self.qp.solve() {
            Err(QpFailure::Infeasible(_)) if self.qp.cap_inequalities(|_| 0.0) => self.qp.solve(),
            result => result,
        }
    }

    fn write_bounds(&mut self, configuration: &Configuration) {
        for joint in 0..configuration.model().nv() {
            let interval = self.limits.interval(configuration, joint, self.dt_s, self.last_velocity[joint]);
            self.bounds[joint] = interval;
            (self.qp.lower[joint], self.qp.upper[joint]) = (interval[0].0, interval[1].0);
        }
    }

    fn write_cost(
        &mut self,
        configuration: &Configuration,
        tasks: &[Task],
        error_clamp: Option<FrameError>,
        damping: f64,
    ) {
        self.qp.hessian.fill(0.0);
        self.qp.linear.fill(0.0);
        let context = StepContext { dt_s: self.dt_s, last_velocity: &self.last_velocity, error_clamp };
        let mut cost = Cost { qp: &mut self.qp };
        cost.damp(damping);
        for task in tasks {
            task.goal().write(configuration, &context, &mut self.scratch, &mut cost);
        }
    }

    fn write_rows(&mut self, configuration: &Configuration, constraints: &[Task]) {
        self.qp.clear_rows();
        self.row_owners.clear();
        let context = StepContext { dt_s: self.dt_s, last_velocity: &self.last_velocity, error_clamp: None };
        let mut rows = Rows { qp: &mut self.qp, owners: &mut self.row_owners };
        for (task, constraint) in constraints.iter().enumerate() {
            let mut equalities = Equalities { rows: &mut rows, task };
            constraint.goal().write(configuration, &context, &mut self.scratch, &mut equalities);
        }
        if let Some(self_collision) = &self.self_collision {
            self_collision.write(configuration, &mut self.segments, &mut rows, RowOwner::SelfCollision);
        }
        for (index, barrier) in self.position_barriers.iter().enumerate() {
            barrier.write(configuration, rows.push(RowOwner::Position(index)));
        }
        self.qp.cap_inequalities(|attainable| RECOVERY * attainable);
    }

    pub(crate) fn infeasible(&self, model: &Model, constraints: &[Task], failure: QpFailure) -> Outcome {
        let (self_collision, barriers) = (self.self_collision.as_ref(), &self.position_barriers);
        let constraint =
            name_failure(failure, model, &self.row_owners, constraints, self_collision, barriers);
        Outcome::Infeasible { constraint }
    }
}
