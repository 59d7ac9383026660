//! Tests of robots from files, and of the base controllers that move them, with cases of the bench.

mod described;
mod files;
mod locomotion;
