//! Tests of the program against the benchmark's published numbers: a table of the numbers, and checks on both
//! sides of each.

mod rules;
mod scene;
mod table;
mod thresholds;
mod walking;
