//! Writing of tasks, constraints and barriers into the quadratic program, with the owner of each row.

use crate::barriers::{PositionBarrier, SelfCollision};
use crate::model::Model;
use crate::qp::{Constraint, Qp, QpFailure, Rows};
use crate::tasks::{Sink, Task};

/// Writer of tasks into the cost; only the lower triangle of the Hessian is written.
pub(crate) struct Cost<'a> {
    pub qp: &'a mut Qp,
}

impl Sink for Cost<'_> {
    fn row(&mut self, entries: &[(usize, f64)], error: f64) {
        for (position, &(i, a)) in entries.iter().enumerate() {
            self.qp.linear[i] -= a * error;
            for &(j, b) in &entries[..=position] {
                self.qp.hessian[(i.max(j), i.min(j))] += a * b;
            }
        }
    }

    fn diagonal(&mut self, weight: f64, error: &dyn Fn(usize) -> f64) {
        let square = weight * weight;
        for joint in 0..self.qp.linear.len() {
            self.qp.hessian[(joint, joint)] += square;
            self.qp.linear[joint] -= square * error(joint);
        }
    }

    fn damp(&mut self, mu: f64) {
        for joint in 0..self.qp.linear.len() {
            self.qp.hessian[(joint, joint)] += mu;
        }
    }
}

/// Owner of a row of the quadratic program, by position in its list.
#[derive(Clone, Copy, Debug)]
pub(crate) enum RowOwner {
    Equality(usize),
    SelfCollision(usize),
    Position(usize),
}

/// Writer of one task as equations.
pub(crate) struct Equalities<'a, 'b> {
    pub rows: &'a mut Rows<'b, RowOwner>,
    pub task: usize,
}

impl Sink for Equalities<'_, '_> {
    fn row(&mut self, entries: &[(usize, f64)], error: f64) {
        let row = self.rows.push(RowOwner::Equality(self.task));
        for (joint, value) in entries {
            row.coefficients[*joint] += *value;
        }
        row.bound = error;
        row.equality = true;
    }

    fn diagonal(&mut self, weight: f64, error: &dyn Fn(usize) -> f64) {
        for joint in 0..self.rows.qp.linear.len() {
            self.row(&[(joint, weight)], weight * error(joint));
        }
    }

    fn damp(&mut self, _: f64) {}
}

/// Returns the name of the constraint that cannot be satisfied.
pub(crate) fn name_failure(
    failure: QpFailure,
    model: &Model,
    owners: &[RowOwner],
    constraints: &[Task],
    self_collision: Option<&SelfCollision>,
    position_barriers: &[PositionBarrier],
) -> String {
    match failure {
        QpFailure::Infeasible(Constraint::Lower(joint)) => {
            format!("lower limit of {}", model.joints()[joint].name)
        }
        QpFailure::Infeasible(Constraint::Upper(joint)) => {
            format!("upper limit of {}", model.joints()[joint].name)
        }
        QpFailure::Infeasible(Constraint::Row(row)) => match (owners[row], self_collision) {
            (RowOwner::SelfCollision(pair), Some(barrier)) => {
                let [a, b] =
                    barrier.pairs[pair].map(|capsule| model.frame_name(barrier.capsules[capsule].frame));
                format!("distance between {a} and {b}")
            }
            (RowOwner::Position(index), _) => {
                format!("position barrier of {}", model.frame_name(position_barriers[index].frame))
            }
            (RowOwner::Equality(index), _) => {
                format!("equality: {}", constraints[index].goal().describe(model))
            }
            (RowOwner::SelfCollision(pair), None) => format!("distance of pair {pair}"),
        },
        QpFailure::NotConvex => "the cost: a task holds numbers that are not finite".into(),
        QpFailure::Unsettled => "the active set: constraints are nearly dependent".into(),
    }
}
