//! Worlds side by side, each on a thread of its own; the first failure stops the others after their present episode.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, mpsc};

use super::cache::{EpisodeCache, PlannedOutcome};
use super::{EpisodeEvent, EvaluationError};
use crate::results::PlayedEpisode;
use crate::spec::EpisodeSpec;

/// Every episode of `work`, cached or played, in its order; those that could not be begun are added to `left_out`.
pub fn play_all(
    cache: &EpisodeCache,
    work: &[EpisodeSpec],
    left_out: &mut Vec<String>,
    progress: &(dyn Fn(EpisodeEvent) + Sync),
) -> Result<Vec<PlayedEpisode>, EvaluationError> {
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let (done, played) = mpsc::channel();
    let mut outcomes: Vec<(usize, PlannedOutcome)> = std::thread::scope(|scope| {
        for _ in 0..cache.plan.jobs.max(1) {
            let done = done.clone();
            let (next, failure) = (&next, &failure);
            scope.spawn(move || {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(spec) = work.get(number) else { break };
                    match cache.load_or_play(spec) {
                        Ok(outcome) => drop(done.send((number, outcome))),
                        Err(error) => {
                            // Nobody else begins another episode.
                            next.store(work.len(), Ordering::Relaxed);
                            failure
                                .lock()
                                .unwrap_or_else(|poisoned| poisoned.into_inner())
                                .get_or_insert(error);
                        }
                    }
                }
            });
        }
        drop(done);
        played.iter().inspect(|(_, outcome)| progress(outcome.into())).collect()
    });
    if let Some(error) = failure.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()) {
        // As the next run will find it: also what lies there from before, and was not come to.
        let kept = work.iter().filter(|spec| cache.load(spec).is_some()).count();
        return Err(error.after(kept, work.len()));
    }
    outcomes.sort_by_key(|(number, _)| *number);
    let mut episodes = Vec::with_capacity(outcomes.len());
    for (number, outcome) in outcomes {
        match outcome {
            PlannedOutcome::Kept(played) | PlannedOutcome::Played(played) => episodes.push(*played),
            PlannedOutcome::LeftOut(reason) => {
                let EpisodeSpec { task, seed, .. } = &work[number];
                left_out.push(format!("{} seed {seed}: {reason}", task.id));
            }
        }
    }
    Ok(episodes)
}

impl<'a> From<&'a PlannedOutcome> for EpisodeEvent<'a> {
    fn from(outcome: &'a PlannedOutcome) -> EpisodeEvent<'a> {
        match outcome {
            PlannedOutcome::Kept(kept) => EpisodeEvent::Kept(kept),
            PlannedOutcome::Played(played) => EpisodeEvent::Played(played),
            PlannedOutcome::LeftOut(_) => EpisodeEvent::LeftOut,
        }
    }
}
