//! What restricts a solution: bounds on single variables, and linear rows.

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
