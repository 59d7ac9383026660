//! Work that several threads share.

use std::sync::{Mutex, PoisonError};
use std::thread;

/// Does every job on one of so many threads, this one among them. A thread that is done takes the next job: worlds differ in what a
/// step costs. Threads live as long as the call, so that none is missing in a process that was forked, and none waits for work.
pub fn for_each<J: Send>(threads: usize, jobs: Vec<J>, work: impl Fn(J) + Sync) {
    let threads = threads.min(jobs.len());
    if threads <= 1 {
        return jobs.into_iter().for_each(work);
    }
    let jobs = Mutex::new(jobs.into_iter());
    let next = || jobs.lock().unwrap_or_else(PoisonError::into_inner).next();
    let run = || {
        while let Some(job) = next() {
            work(job);
        }
    };
    thread::scope(|scope| {
        (1..threads).for_each(|_| drop(scope.spawn(run)));
        run();
    });
}
