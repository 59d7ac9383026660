//! Inverse kinematics on a G1's arms and waist: models, limits, barriers, tracking, and comparisons with
//! other solvers.

mod allocation;
mod barriers;
mod common;
mod limits;
mod models;
mod pink;
mod qp;
mod spatial;
mod track;
