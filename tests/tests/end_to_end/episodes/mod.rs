//! Episodes from start to result, as players of every kind play them.

mod demo;
mod endings;
mod evaluate;
mod experts;
mod learned;
#[cfg(target_os = "linux")]
mod memory;
mod task_files;
mod unprivileged;
