//! Robots of files, and the base controllers that move them, by cases of the bench.

mod described;
mod files;
mod locomotion;
