//! Data and work space of a problem, and the steps from the unconstrained minimum to the solution. Rows are
//! rewritten for every solution in retained memory.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
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
    /// Coefficients a.
    pub coefficients: Vec<f64>,
    /// Bound b.
    pub bound: f64,
    /// True for a' x = b, false for a' x >= b.
    pub equality: bool,
}

/// Reason for a missing solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QpFailure {
    /// H is not positive definite.
    NotConvex,
    /// This constraint contradicts others.
    Infeasible(Constraint),
    /// Rounding errors kept the active set from settling.
    Unsettled,
}

/// Problem data and work space for `n` variables.
pub struct Qp {
    pub(super) n: usize,
    /// Hessian H. Only its lower triangle is read.
    pub hessian: Mat<f64>,
    /// Linear cost c.
    pub linear: Vec<f64>,
    /// Lower bounds on x; may be infinite.
    pub lower: Vec<f64>,
    /// Upper bounds on x; may be infinite.
    pub upper: Vec<f64>,
    /// Further constraints; only the first `used_rows` count.
    pub(super) rows: Vec<Row>,
    pub(super) used_rows: usize,
    /// The solution after [`Qp::solve`].
    pub x: Vec<f64>,
    pub(super) factor: Mat<f64>,
    pub(super) inverse: Mat<f64>,
    rhs: Mat<f64>,
    scratch: MemBuffer,
    /// Columns span the active normals first, then their complement: L^-T Q.
    pub(super) basis: Vec<f64>,
    /// Upper triangular factor of the active normals, column major.
    pub(super) r: Vec<f64>,
    /// Active constraints with the sign of their normal, and their multipliers.
    pub(super) active: Vec<(Constraint, f64)>,
    pub(super) multipliers: Vec<f64>,
    pub(super) d: Vec<f64>,
    pub(super) direction: Vec<f64>,
    pub(super) dual_step: Vec<f64>,
}

impl Qp {
    /// Allocates the work space for `n` variables.
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

    /// Returns the constraints that hold with equality at the solution.
    pub fn active(&self) -> impl Iterator<Item = Constraint> + '_ {
        self.active.iter().map(|(constraint, _)| *constraint)
    }

    /// Solves the present problem; the result is in [`Qp::x`].
    ///
    /// # Errors
    ///
    /// Returns a [`QpFailure`] if the problem is not convex or infeasible, or if the active set does not
    /// settle.
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
}

/// Writer of rows. Each row has an owner.
pub(crate) struct Rows<'a, Owner> {
    pub qp: &'a mut Qp,
    pub owners: &'a mut Vec<Owner>,
}

impl<Owner> Rows<'_, Owner> {
    /// Adds a row of zeros and returns it.
    pub fn push(&mut self, owner: Owner) -> &mut Row {
        self.owners.push(owner);
        self.qp.push_row()
    }
}

impl Qp {
    /// Removes all rows; their memory is retained.
    pub fn clear_rows(&mut self) {
        self.used_rows = 0;
    }

    /// Adds a row of zeros and returns it.
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

    /// Returns the rows since [`Qp::clear_rows`].
    pub fn rows(&self) -> &[Row] {
        &self.rows[..self.used_rows]
    }

    /// Returns true if x = 0 satisfies all bounds and equalities to `tolerance`.
    pub fn accepts_standstill(&self, tolerance: f64) -> bool {
        let within = |(lower, upper): (&f64, &f64)| *lower <= tolerance && *upper >= -tolerance;
        let keeps = |row: &Row| !row.equality || row.bound.abs() <= tolerance;
        self.lower.iter().zip(&self.upper).all(within) && self.rows().iter().all(keeps)
    }

    /// Lowers the bound of every inequality that x = 0 violates to at most `cap(largest)`, with `largest` the
    /// maximum of  a' x  within the bounds on x. Returns true if any bound was lowered.
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
}
