//! Handling of signals that end this process during an evaluation. Before the end, a last message is printed
//! and programs are stopped.

use std::thread;

use super::program::end_all_programs;
use crate::http::shutdown_signal;

/// Exit status that shells report for a process that SIGINT has ended.
const INTERRUPTED: i32 = 130;

/// Runs `work`. If a signal ends the process during that time, calls `say` and stops the policies' programs
/// first.
pub fn with_last_words<T>(say: impl Fn() + Sync, work: impl FnOnce() -> T) -> T {
    let (working, done) = tokio::sync::oneshot::channel::<()>();
    thread::scope(|scope| {
        let say = &say;
        scope.spawn(move || {
            // Without a runtime, signals keep their default effect.
            let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() else {
                return;
            };
            let is_asked_to_end = runtime.block_on(async {
                tokio::select! {
                    _ = shutdown_signal() => true,
                    _ = done => false,
                }
            });
            if is_asked_to_end {
                say();
                end_all_programs();
                std::process::exit(INTERRUPTED);
            }
        });
        let result = work();
        drop(working);
        result
    })
}
