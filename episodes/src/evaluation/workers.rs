//! Worlds side by side, each on a thread of its own; the first failure stops the others after their present episode.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, mpsc};

use super::EvaluationError;
use super::keep::{Keeper, Played};
use crate::tasks::Task;

/// Every episode of the plan, kept or played, in the plan's order.
pub fn play_all(
    keeper: &Keeper,
    progress: &(dyn Fn(&Played) + Sync),
) -> Result<Vec<Played>, EvaluationError> {
    let plan = keeper.plan;
    let work: Vec<(&'static Task, u32)> =
        plan.tasks.iter().flat_map(|task| plan.seeds.iter().map(|seed| (*task, *seed))).collect();
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let (done, played) = mpsc::channel();
    let mut episodes: Vec<Played> = std::thread::scope(|scope| {
        for _ in 0..plan.jobs.max(1) {
            let done = done.clone();
            let (work, next, failure) = (&work, &next, &failure);
            scope.spawn(move || {
                while let Some((task, seed)) = work.get(next.fetch_add(1, Ordering::Relaxed)) {
                    match keeper.kept_or_played(task, *seed) {
                        Ok(episode) => drop(done.send(episode)),
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
        played.iter().inspect(progress).collect()
    });
    if let Some(error) = failure.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()) {
        return Err(error);
    }
    let rank = |episode: &Played| plan.tasks.iter().position(|task| task.id == episode.result.task);
    episodes.sort_by_key(|episode| (rank(episode), episode.result.seed));
    Ok(episodes)
}
