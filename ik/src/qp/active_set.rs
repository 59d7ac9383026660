//! The active set: the next constraint to add, the length of the step towards it, and the constraints
//! dropped on the way.

use faer::Par;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;

use super::problem::{Constraint, Qp, QpFailure};

/// Constraint violation below which it counts as rounding error.
const TOLERANCE: f64 = 1e-11;
/// Relative size of the part of a normal outside the span of the active normals, below which it counts as
/// inside.
const DEPENDENT: f64 = 1e-20;

impl Qp {
    /// Returns the inactive constraint with the largest violation, the sign of its normal, and its
    /// (negative) slack.
    pub(super) fn most_violated(&self) -> Option<(Constraint, f64, f64)> {
        let mut worst: Option<(Constraint, f64, f64)> = None;
        let mut consider = |constraint: Constraint, sign: f64, slack: f64| {
            let limit = worst.map_or(-TOLERANCE, |(_, _, slack)| slack);
            if slack < limit && !self.active.iter().any(|(known, _)| *known == constraint) {
                worst = Some((constraint, sign, slack));
            }
        };
        for i in 0..self.n {
            consider(Constraint::Lower(i), 1.0, self.x[i] - self.lower[i]);
            consider(Constraint::Upper(i), -1.0, self.upper[i] - self.x[i]);
        }
        for (k, row) in self.rows[..self.used_rows].iter().enumerate() {
            let value: f64 = row.coefficients.iter().zip(&self.x).map(|(a, x)| a * x).sum();
            let slack = value - row.bound;
            if row.equality && slack > 0.0 {
                consider(Constraint::Row(k), -1.0, -slack);
            } else {
                consider(Constraint::Row(k), 1.0, slack);
            }
        }
        worst
    }

    /// Sets basis = L^-T.
    pub(super) fn start_basis(&mut self) {
        self.inverse.fill(0.0);
        for i in 0..self.n {
            self.inverse[(i, i)] = 1.0;
        }
        solve_upper_triangular_in_place(self.factor.transpose(), self.inverse.as_mut(), Par::Seq);
        for k in 0..self.n {
            for i in 0..self.n {
                self.basis[k * self.n + i] = self.inverse[(i, k)];
            }
        }
    }

    /// Makes one violated constraint active, dropping others on the way.
    pub(super) fn add(&mut self, constraint: Constraint, sign: f64, mut slack: f64) -> Result<(), QpFailure> {
        let n = self.n;
        self.multipliers[self.active.len()] = 0.0;
        loop {
            let active = self.active.len();
            self.project(constraint, sign);
            let complement: f64 = self.d[active..].iter().map(|d| d * d).sum();
            let whole: f64 = self.d.iter().map(|d| d * d).sum();
            let (dual_limit, blocking) = self.dual_limit();
            let independent = complement > DEPENDENT * whole.max(f64::MIN_POSITIVE);
            let primal_step = if independent { -slack / complement } else { f64::INFINITY };
            let step = dual_limit.min(primal_step);
            if !step.is_finite() {
                return Err(QpFailure::Infeasible(constraint));
            }
            for k in 0..active {
                self.multipliers[k] -= step * self.dual_step[k];
            }
            self.multipliers[active] += step;
            if independent {
                for i in 0..n {
                    self.x[i] += step * self.direction[i];
                }
                slack += step * complement;
            }
            if primal_step <= dual_limit {
                self.extend(constraint, sign);
                return Ok(());
            }
            self.remove(blocking);
        }
    }

    /// Computes d = basis' a, the primal direction in the complement of the active normals, and the dual
    /// direction.
    fn project(&mut self, constraint: Constraint, sign: f64) {
        let (n, active) = (self.n, self.active.len());
        for k in 0..n {
            let column = &self.basis[k * n..(k + 1) * n];
            self.d[k] = sign
                * match constraint {
                    Constraint::Lower(i) | Constraint::Upper(i) => column[i],
                    Constraint::Row(row) => {
                        self.rows[row].coefficients.iter().zip(column).map(|(a, j)| a * j).sum()
                    }
                };
        }
        self.direction.fill(0.0);
        for k in active..n {
            let column = &self.basis[k * n..(k + 1) * n];
            for (direction, j) in self.direction.iter_mut().zip(column) {
                *direction += self.d[k] * j;
            }
        }
        for i in (0..active).rev() {
            let known: f64 = (i + 1..active).map(|k| self.r[k * n + i] * self.dual_step[k]).sum();
            self.dual_step[i] = (self.d[i] - known) / self.r[i * n + i];
        }
    }

    /// Returns the largest dual step before a multiplier changes sign, and the index of that multiplier.
    /// Equalities stay active.
    fn dual_limit(&self) -> (f64, usize) {
        let mut limit = (f64::INFINITY, 0);
        for (k, (constraint, _)) in self.active.iter().enumerate() {
            let fixed = matches!(constraint, Constraint::Row(row) if self.rows[*row].equality);
            if !fixed && self.dual_step[k] > 0.0 {
                let step = self.multipliers[k] / self.dual_step[k];
                if step < limit.0 {
                    limit = (step, k);
                }
            }
        }
        limit
    }

    /// Appends a constraint to the active set: Givens rotations collect d beyond the active part in one
    /// entry.
    fn extend(&mut self, constraint: Constraint, sign: f64) {
        let (n, active) = (self.n, self.active.len());
        for k in (active + 1..n).rev() {
            let (a, b) = (self.d[k - 1], self.d[k]);
            let length = length(a, b);
            if b != 0.0 && length != 0.0 {
                self.d[k - 1] = length;
                self.rotate(k - 1, k, a / length, b / length);
            }
        }
        self.r[active * n..active * n + active + 1].copy_from_slice(&self.d[..active + 1]);
        self.active.push((constraint, sign));
    }

    /// Removes an active constraint and restores the triangle.
    fn remove(&mut self, index: usize) {
        let (n, active) = (self.n, self.active.len());
        self.active.remove(index);
        self.multipliers.copy_within(index + 1..active + 1, index);
        for column in index..active - 1 {
            self.r.copy_within((column + 1) * n..(column + 1) * n + column + 2, column * n);
        }
        for column in index..active - 1 {
            let (a, b) = (self.r[column * n + column], self.r[column * n + column + 1]);
            let length = length(a, b);
            if length == 0.0 {
                continue;
            }
            let (cos, sin) = (a / length, b / length);
            for k in column..active - 1 {
                let (x, y) = (self.r[k * n + column], self.r[k * n + column + 1]);
                self.r[k * n + column] = cos * x + sin * y;
                self.r[k * n + column + 1] = cos * y - sin * x;
            }
            self.rotate(column, column + 1, cos, sin);
        }
    }

    fn rotate(&mut self, first: usize, second: usize, cos: f64, sin: f64) {
        let n = self.n;
        let (before, after) = self.basis.split_at_mut(second * n);
        for (x, y) in before[first * n..first * n + n].iter_mut().zip(&mut after[..n]) {
            (*x, *y) = (cos * *x + sin * *y, cos * *y - sin * *x);
        }
    }
}

/// Returns the length of (a, b). Unlike `hypot` it does not guard against overflow: normals are of
/// moderate size, and this takes a third of the time.
fn length(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}
