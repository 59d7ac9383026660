//! Dense strictly convex quadratic programs by the dual active set method.
//!
//!   minimise    1/2 x' H x + c' x
//!   subject to  lower <= x <= upper,   a_k' x >= b_k   (or = b_k)
//!
//! H: n x n, positive definite. The method starts at the unconstrained minimum and adds the most violated
//! constraint until none is violated, so a problem whose optimum is inside its bounds costs one Cholesky
//! factorisation. Source: Goldfarb and Idnani, A numerically stable dual method for solving strictly convex
//! quadratic programs, 1983.

mod active_set;
mod problem;

pub(crate) use problem::Rows;
pub use problem::{Constraint, Qp, QpFailure, Row};
