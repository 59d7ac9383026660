//! What a test cannot try here. Rust's harness knows no skipping while a test runs, and keeps what a passing test prints to itself.
//! So this line goes past it, to the terminal: every run of `cargo test` shows it. Other crates' tests take in this file, too.

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// What has been said; once is enough.
static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Says that the test on this thread leaves out something, and why.
pub fn skipped(reason: &str) {
    let thread = thread::current();
    let line = match thread.name() {
        Some(test) => format!("skipped: {test}: {reason}\n"),
        None => format!("skipped: {reason}\n"),
    };
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if said.insert(line.clone()) {
        // The macros that print would be captured.
        let _ = io::stderr().write_all(line.as_bytes());
    }
}
