//! Invariants of the repository itself. Each failure names the place and says what mends it.

mod circles;
mod crates;
mod extending;
mod files;
mod lengths;
mod modules;
mod order;
mod paths;
mod sources;
mod types;
mod units;
