//! Worlds side by side, each on a thread of its own; the first failure stops the others after their present episode.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, mpsc};

use super::EvaluationError;
use super::keep::{Keeper, Outcome};
use crate::results::Played;
use crate::spec::EpisodeSpec;

/// Every episode of `work`, kept or played, in its order; those that could not be begun are added to `left_out`.
pub fn play_all(
    keeper: &Keeper,
    work: &[EpisodeSpec],
    left_out: &mut Vec<String>,
    progress: &(dyn Fn(&Played) + Sync),
) -> Result<Vec<Played>, EvaluationError> {
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let (done, played) = mpsc::channel();
    let mut outcomes: Vec<(usize, Outcome)> = std::thread::scope(|scope| {
        for _ in 0..keeper.plan.jobs.max(1) {
            let done = done.clone();
            let (next, failure) = (&next, &failure);
            scope.spawn(move || {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(spec) = work.get(number) else { break };
                    match keeper.kept_or_played(spec) {
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
        played.iter().inspect(|(_, outcome)| tell(outcome, progress)).collect()
    });
    if let Some(error) = failure.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()) {
        return Err(error);
    }
    outcomes.sort_by_key(|(number, _)| *number);
    let mut episodes = Vec::with_capacity(outcomes.len());
    for (number, outcome) in outcomes {
        match outcome {
            Outcome::Played(played) => episodes.push(*played),
            Outcome::LeftOut(reason) => {
                let EpisodeSpec { task, seed, .. } = &work[number];
                left_out.push(format!("{} seed {seed}: {reason}", task.id));
            }
        }
    }
    Ok(episodes)
}

fn tell(outcome: &Outcome, progress: &(dyn Fn(&Played) + Sync)) {
    match outcome {
        Outcome::Played(played) => progress(played),
        Outcome::LeftOut(_) => {}
    }
}
