//! The rows of a problem: written anew for every solution, in memory that is kept.

use super::constraint::Row;
use super::problem::Qp;

/// Adds rows under one owner after the other.
pub(crate) struct Rows<'a, Owner> {
    pub qp: &'a mut Qp,
    pub owners: &'a mut Vec<Owner>,
}

impl<Owner> Rows<'_, Owner> {
    /// A new row, zero so far.
    pub fn push(&mut self, owner: Owner) -> &mut Row {
        self.owners.push(owner);
        self.qp.push_row()
    }
}

impl Qp {
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
}
