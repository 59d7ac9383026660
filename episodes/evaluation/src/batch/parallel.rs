//! Threads on which worlds step.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvError, Sender, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

/// Time for which an idle thread polls for work before it blocks. Waking a blocked thread takes a tenth of a
/// world's step, and the caller requests the next step soon after the last.
const AWAKE: Duration = Duration::from_micros(200);

/// Threads that work alongside the calling one for the lifetime of this value. They do not exist in a
/// forked child process, which must not use this value.
pub struct Threads {
    helpers: Vec<Sender<Round>>,
}

/// Work of all threads in one round, called with the thread's number.
type Round = Arc<dyn Fn(usize) + Send + Sync>;

impl Threads {
    /// Starts the threads; their number includes the caller's. There are fewer if the operating system
    /// refuses more.
    pub fn start(threads: usize) -> Threads {
        let helper = |thread| {
            let (rounds, asked) = channel::<Round>();
            let work = move || {
                while let Ok(round) = next(&asked) {
                    round(thread);
                }
            };
            let started = thread::Builder::new().name("worlds".into()).spawn(work);
            started.ok().map(|_| rounds)
        };
        Threads { helpers: (1..threads).filter_map(helper).collect() }
    }

    /// Runs jobs and returns their results. A thread begins with the jobs that it had in the last round,
    /// because their data are in its caches. It then takes over jobs of other threads, because worlds differ
    /// in the cost of a step.
    pub fn map<R: Send + 'static>(
        &self,
        jobs: usize,
        work: impl Fn(usize) -> R + Send + Sync + 'static,
    ) -> Vec<R> {
        if self.helpers.is_empty() {
            return (0..jobs).map(work).collect();
        }
        let threads = self.helpers.len() + 1;
        let (done, results) = channel();
        let begun: Vec<AtomicBool> = (0..jobs).map(|_| AtomicBool::new(false)).collect();
        let round: Round = Arc::new(move |thread| {
            let own = thread * jobs / threads..(thread + 1) * jobs / threads;
            for job in own.chain((0..jobs).rev()) {
                if !begun[job].swap(true, Ordering::Relaxed) {
                    // The receiver is gone if another job has panicked.
                    let _ = done.send((job, catch_unwind(AssertUnwindSafe(|| work(job)))));
                }
            }
        });
        for helper in &self.helpers {
            // A missing thread does no harm: the others run its jobs.
            let _ = helper.send(round.clone());
        }
        round(0);
        in_order(jobs, &results)
    }
}

/// Returns the results of all jobs in their order. Resumes a job's panic in the caller.
fn in_order<R>(jobs: usize, results: &Receiver<(usize, thread::Result<R>)>) -> Vec<R> {
    let mut found: Vec<Option<R>> = (0..jobs).map(|_| None).collect();
    for _ in 0..jobs {
        let (job, result) = next(results).expect("every job ends");
        found[job] = Some(result.unwrap_or_else(|panic| resume_unwind(panic)));
    }
    found.into_iter().flatten().collect()
}

/// Receives the next message: polls first, then blocks.
fn next<T>(inbox: &Receiver<T>) -> Result<T, RecvError> {
    let begin = Instant::now();
    while begin.elapsed() < AWAKE {
        match inbox.try_recv() {
            Ok(next) => return Ok(next),
            Err(TryRecvError::Disconnected) => return Err(RecvError),
            // On a busy machine, another thread may use the core.
            Err(TryRecvError::Empty) => thread::yield_now(),
        }
    }
    inbox.recv()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_job_is_done_once_and_told_in_order() {
        for threads in [1, 2, 5] {
            let threads = Threads::start(threads);
            for jobs in [0, 1, 3, 40] {
                let squares = threads.map(jobs, |job| job * job);
                assert_eq!(squares, (0..jobs).map(|job| job * job).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn threads_live_on_and_jobs_of_a_slow_one_are_taken_over() {
        let threads = Threads::start(2);
        let slow = || {
            threads.map(8, |job| {
                thread::sleep(Duration::from_millis(if job == 0 { 100 } else { 1 }));
                thread::current().id()
            })
        };
        let (first, second) = (slow(), slow());
        let of = |ids: &[thread::ThreadId]| ids.iter().map(|id| format!("{id:?}")).collect::<BTreeSet<_>>();
        assert_eq!((of(&first).len(), of(&first)), (2, of(&second)));
        // The other thread finishes all other jobs long before the slow one ends.
        assert!(first[1..].iter().all(|id| *id == first[7] && *id != first[0]), "{first:?}");
    }

    #[test]
    fn a_panic_reaches_the_caller_and_threads_go_on() {
        let threads = Threads::start(2);
        let failed = catch_unwind(AssertUnwindSafe(|| {
            threads.map(6, |job| assert!(job != 5, "job {job}"));
        }));
        let panic = failed.unwrap_err();
        assert_eq!(panic.downcast_ref::<String>().map(String::as_str), Some("job 5"));
        assert_eq!(threads.map(4, |job| job), [0, 1, 2, 3]);
    }
}
