//! Invariants of the repository. Each failure gives the place and a remedy.

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
mod words;
