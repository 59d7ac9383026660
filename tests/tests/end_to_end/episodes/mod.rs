//! Tests of episodes from start to result, with players of every kind.

mod demo;
mod endings;
mod evaluate;
mod experts;
mod learned;
#[cfg(target_os = "linux")]
mod memory;
mod task_files;
mod unprivileged;
