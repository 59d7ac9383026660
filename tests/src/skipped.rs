//! Reports of skipped tests. Rust's test harness cannot skip a test at run time, and it captures the output
//! of passing tests. These reports bypass the capture, so every run of `cargo test` shows them. Tests of
//! other crates include this file, too.

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Lines already printed; each line is printed only once.
static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Reports that the test on this thread skips a check, and the reason.
pub fn skipped(reason: &str) {
    let thread = thread::current();
    let line = match thread.name() {
        Some(test) => format!("skipped: {test}: {reason}\n"),
        None => format!("skipped: {reason}\n"),
    };
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if said.insert(line.clone()) {
        // The printing macros would be captured.
        let _ = io::stderr().write_all(line.as_bytes());
    }
}
