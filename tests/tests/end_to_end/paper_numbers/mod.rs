//! What the benchmark has published against what the program does: one table of numbers, and tests on both sides of each.

mod rules;
mod scene;
mod table;
mod thresholds;
mod walking;
