//! Dense strictly convex quadratic programs by the dual active set method.
//!
//!   minimise    1/2 x' H x + c' x
//!   subject to  lower <= x <= upper,   a_k' x >= b_k   (or = b_k)
//!
//! H: n x n, positive definite. The method starts at the unconstrained minimum and adds the most violated constraint
//! until none is left, so a problem whose optimum is inside its bounds costs one Cholesky factorisation.
//! Source: Goldfarb and Idnani, A numerically stable dual method for solving strictly convex quadratic programs, 1983.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Mat, Par};

/// A constraint of the problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Constraint {
    /// `x[i] >= lower[i]`.
    Lower(usize),
    /// `x[i] <= upper[i]`.
    Upper(usize),
    /// `a_k' x >= b_k`, or equality.
    Row(usize),
}

/// One linear constraint with dense coefficients.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// a.
    pub coefficients: Vec<f64>,
    /// b.
    pub bound: f64,
    /// a' x = b instead of a' x >= b.
    pub equality: bool,
}

/// Why there is no solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QpFailure {
    /// H is not positive definite.
    NotConvex,
    /// This constraint contradicts others.
    Infeasible(Constraint),
    /// Rounding kept the active set from settling.
    Unsettled,
}

/// A violation below this is rounding.
const TOLERANCE: f64 = 1e-11;
/// Relative size below which a constraint's normal lies in the span of the active ones.
const DEPENDENT: f64 = 1e-20;

/// Problem data and work space for `n` variables.
pub struct Qp {
    n: usize,
    /// Lower triangle is read.
    pub hessian: Mat<f64>,
    /// c.
    pub linear: Vec<f64>,
    /// Bounds on x; may be infinite.
    pub lower: Vec<f64>,
    /// Bounds on x; may be infinite.
    pub upper: Vec<f64>,
    /// Further constraints; only the first `used_rows` count.
    rows: Vec<Row>,
    used_rows: usize,
    /// The solution after [`Qp::solve`].
    pub x: Vec<f64>,
    factor: Mat<f64>,
    inverse: Mat<f64>,
    rhs: Mat<f64>,
    scratch: MemBuffer,
    /// Columns span the active normals first, then their complement: L^-T Q.
    basis: Vec<f64>,
    /// Upper triangular factor of the active normals, column major.
    r: Vec<f64>,
    /// Active constraints with the sign of their normal, and their multipliers.
    active: Vec<(Constraint, f64)>,
    multipliers: Vec<f64>,
    d: Vec<f64>,
    direction: Vec<f64>,
    dual_step: Vec<f64>,
}

impl Qp {
    /// Work space for `n` variables.
    pub fn new(n: usize) -> Qp {
        let scratch =
            MemBuffer::new(llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default()));
        Qp {
            n,
            hessian: Mat::zeros(n, n),
            linear: vec![0.0; n],
            lower: vec![f64::NEG_INFINITY; n],
            upper: vec![f64::INFINITY; n],
            rows: Vec::new(),
            used_rows: 0,
            x: vec![0.0; n],
            factor: Mat::zeros(n, n),
            inverse: Mat::zeros(n, n),
            rhs: Mat::zeros(n, 1),
            scratch,
            basis: vec![0.0; n * n],
            r: vec![0.0; n * n],
            active: Vec::with_capacity(n + 1),
            multipliers: vec![0.0; n + 1],
            d: vec![0.0; n],
            direction: vec![0.0; n],
            dual_step: vec![0.0; n],
        }
    }

    /// Forgets all rows; their memory is kept.
    pub fn clear_rows(&mut self) {
        self.used_rows = 0;
    }

    /// A new row, zero so far.
    pub fn push_row(&mut self) -> &mut Row {
        if self.used_rows == self.rows.len() {
            self.rows.push(Row { coefficients: vec![0.0; self.n], bound: 0.0, equality: false });
        }
        self.used_rows += 1;
        let row = &mut self.rows[self.used_rows - 1];
        row.coefficients.fill(0.0);
        row.equality = false;
        row
    }

    /// Rows since [`Qp::clear_rows`].
    pub fn rows(&self) -> &[Row] {
        &self.rows[..self.used_rows]
    }

    /// Whether x = 0 keeps all bounds and equalities to `tolerance`.
    pub fn accepts_standstill(&self, tolerance: f64) -> bool {
        let within = |(lower, upper): (&f64, &f64)| *lower <= tolerance && *upper >= -tolerance;
        let keeps = |row: &Row| !row.equality || row.bound.abs() <= tolerance;
        self.lower.iter().zip(&self.upper).all(within) && self.rows().iter().all(keeps)
    }

    /// Lowers the bound of every inequality that the start x = 0 violates to `cap` of the largest  a' x  within the
    /// bounds on x; says whether there was any.
    pub fn cap_inequalities(&mut self, cap: impl Fn(f64) -> f64) -> bool {
        let mut lowered = false;
        for row in self.rows[..self.used_rows].iter_mut().filter(|row| !row.equality && row.bound > 0.0) {
            let largest = row.coefficients.iter().enumerate().filter(|(_, a)| **a != 0.0);
            let attainable: f64 = largest.map(|(i, a)| (a * self.lower[i]).max(a * self.upper[i])).sum();
            let capped = row.bound.min(cap(attainable.max(0.0)));
            lowered |= capped < row.bound;
            row.bound = capped;
        }
        lowered
    }

    /// Constraints that hold with equality at the solution.
    pub fn active(&self) -> impl Iterator<Item = Constraint> + '_ {
        self.active.iter().map(|(constraint, _)| *constraint)
    }

    /// Solves the problem as it stands; the result is in [`Qp::x`].
    pub fn solve(&mut self) -> Result<(), QpFailure> {
        self.unconstrained_minimum()?;
        self.active.clear();
        let mut has_basis = false;
        for _ in 0..10 * self.n + 100 {
            let Some((constraint, sign, violation)) = self.most_violated() else {
                for i in 0..self.n {
                    self.x[i] = self.x[i].clamp(self.lower[i], self.upper[i].max(self.lower[i]));
                }
                return Ok(());
            };
            if !has_basis {
                self.start_basis();
                has_basis = true;
            }
            self.add(constraint, sign, violation)?;
        }
        Err(QpFailure::Unsettled)
    }

    fn unconstrained_minimum(&mut self) -> Result<(), QpFailure> {
        self.factor.copy_from(&self.hessian);
        let stack = MemStack::new(&mut self.scratch);
        llt::factor::cholesky_in_place(
            self.factor.as_mut(),
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        )
        .map_err(|_| QpFailure::NotConvex)?;
        for i in 0..self.n {
            self.rhs[(i, 0)] = -self.linear[i];
        }
        llt::solve::solve_in_place(self.factor.as_ref(), self.rhs.as_mut(), Par::Seq, stack);
        for i in 0..self.n {
            self.x[i] = self.rhs[(i, 0)];
        }
        Ok(())
    }

    /// The inactive constraint with the largest violation, the sign of its normal, and its (negative) slack.
    fn most_violated(&self) -> Option<(Constraint, f64, f64)> {
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

    /// basis = L^-T.
    fn start_basis(&mut self) {
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
    fn add(&mut self, constraint: Constraint, sign: f64, mut slack: f64) -> Result<(), QpFailure> {
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

    /// d = basis' a, the primal direction in the complement of the active normals, and the dual direction.
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

    /// Largest dual step before a multiplier changes sign, and whose it is. Equalities never leave.
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

    /// Appends a constraint to the active set: Givens rotations collect d beyond the active part in one entry.
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

    /// Takes an active constraint out and restores the triangle.
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

/// Unlike `hypot` without care for overflow: normals are of moderate size, and this takes a third of the time.
fn length(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}
