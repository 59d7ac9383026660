//! Signals that end this process while an evaluation is played: what is to be said is said, and programs end first.

use std::thread;

use super::program::end_all_programs;
use crate::http::shutdown_signal;

/// Exit status that shells report of a process that SIGINT has ended.
const INTERRUPTED: i32 = 130;

/// Does `work`. A signal that ends the process in the middle of it has `say` speak, and the programs of policies end, before it does.
pub fn with_last_words<T>(say: impl Fn() + Sync, work: impl FnOnce() -> T) -> T {
    let (working, done) = tokio::sync::oneshot::channel::<()>();
    thread::scope(|scope| {
        let say = &say;
        scope.spawn(move || {
            // Without a runtime, signals do what they do to any process.
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
