//! Parallel worlds, each on a separate thread. After the first error, the other threads stop when their
//! present episode ends.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, mpsc};

use tandem_episodes::EpisodeSpec;

use super::cache::{EpisodeCache, PlannedOutcome};
use super::{EpisodeEvent, EvaluationError};
use crate::results::PlayedEpisode;

/// Plays or loads every episode of `work`, and returns the episodes in the same order. Episodes that could
/// not be started are added to `left_out`.
pub fn play_all(
    cache: &EpisodeCache,
    work: &[EpisodeSpec],
    left_out: &mut Vec<String>,
    progress: &(dyn Fn(EpisodeEvent) + Sync),
) -> Result<Vec<PlayedEpisode>, EvaluationError> {
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    // Episodes that other processes play are handled last, when they are most likely finished.
    let elsewhere = Mutex::new(Vec::new());
    let (done, played) = mpsc::channel();
    let mut outcomes: Vec<(usize, PlannedOutcome)> = std::thread::scope(|scope| {
        for _ in 0..cache.plan.jobs.max(1) {
            let done = done.clone();
            let queue = Queue { next: &next, elsewhere: &elsewhere, episodes: work.len() };
            let failure = &failure;
            scope.spawn(move || {
                while let Some((number, wait)) = queue.next() {
                    if lock(failure).is_some() {
                        break;
                    }
                    let outcome = match wait {
                        false => cache.load_or_play(&work[number]),
                        true => cache.wait_and_play(&work[number]),
                    };
                    match outcome {
                        Ok(PlannedOutcome::Elsewhere) => queue.postpone(number),
                        Ok(outcome) => drop(done.send((number, outcome))),
                        Err(error) => {
                            lock(failure).get_or_insert(error);
                            queue.stop();
                        }
                    }
                }
            });
        }
        drop(done);
        played.iter().inspect(|(_, outcome)| progress(outcome.into())).collect()
    });
    if let Some(error) = lock(&failure).take() {
        // Counts all episodes that the next run will find, including cached episodes that this run did not
        // reach.
        let kept = work.iter().filter(|spec| cache.load(spec).is_some()).count();
        return Err(error.after(kept, work.len()));
    }
    outcomes.sort_by_key(|(number, _)| *number);
    let mut episodes = Vec::with_capacity(outcomes.len());
    for (number, outcome) in outcomes {
        match outcome {
            PlannedOutcome::Kept(played) | PlannedOutcome::Played(played) => episodes.push(*played),
            // The thread that waits for this episode plays it, or finds its result.
            PlannedOutcome::Elsewhere => {}
            PlannedOutcome::LeftOut(reason) => {
                let EpisodeSpec { task, seed, .. } = &work[number];
                left_out.push(format!("{} seed {seed}: {reason}", task.id));
            }
        }
    }
    Ok(episodes)
}

/// Queue of the episodes that no thread has started yet.
#[derive(Clone, Copy)]
struct Queue<'a> {
    next: &'a AtomicUsize,
    elsewhere: &'a Mutex<Vec<usize>>,
    episodes: usize,
}

impl Queue<'_> {
    /// Returns the index of the next episode, and `true` if the thread must wait for another process that
    /// plays it.
    fn next(self) -> Option<(usize, bool)> {
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        if number < self.episodes {
            return Some((number, false));
        }
        lock(self.elsewhere).pop().map(|number| (number, true))
    }

    fn postpone(self, number: usize) {
        lock(self.elsewhere).push(number);
    }

    /// Empties the queue, so that no thread starts another episode.
    fn stop(self) {
        self.next.store(self.episodes, Ordering::Relaxed);
        lock(self.elsewhere).clear();
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // No thread panics while it holds one of these locks.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<'a> From<&'a PlannedOutcome> for EpisodeEvent<'a> {
    fn from(outcome: &'a PlannedOutcome) -> EpisodeEvent<'a> {
        match outcome {
            PlannedOutcome::Kept(kept) => EpisodeEvent::Kept(kept),
            PlannedOutcome::Played(played) => EpisodeEvent::Played(played),
            PlannedOutcome::LeftOut(_) | PlannedOutcome::Elsewhere => EpisodeEvent::LeftOut,
        }
    }
}
