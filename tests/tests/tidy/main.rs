//! Invariants of the repository itself. Each failure names the place and says what mends it.

mod circles;
mod crates;
mod functions;
mod lengths;
mod modules;
mod order;
mod paths;
mod readme_steps;
mod sources;
mod text;
mod units;
