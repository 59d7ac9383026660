//! Worlds side by side, each on a thread of its own; the first failure stops the others after their present episode.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, mpsc};

use super::EvaluationError;
use super::keep::{Keeper, Played};
use crate::spec::EpisodeSpec;

/// Every episode of `work`, kept or played, in its order; those that do not exist are added to `left_out`.
pub fn play_all(
    keeper: &Keeper,
    work: &[EpisodeSpec],
    left_out: &mut Vec<String>,
    progress: &(dyn Fn(&Played) + Sync),
) -> Result<Vec<Played>, EvaluationError> {
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let (done, played) = mpsc::channel();
    let mut episodes: Vec<(usize, Option<Played>)> = std::thread::scope(|scope| {
        for _ in 0..keeper.plan.jobs.max(1) {
            let done = done.clone();
            let (next, failure) = (&next, &failure);
            scope.spawn(move || {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(spec) = work.get(number) else { break };
                    match keeper.kept_or_played(spec) {
                        Ok(episode) => drop(done.send((number, episode))),
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
        played.iter().inspect(|(_, episode)| episode.iter().for_each(progress)).collect()
    });
    if let Some(error) = failure.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()) {
        return Err(error);
    }
    episodes.sort_by_key(|(number, _)| *number);
    for (number, _) in episodes.iter().filter(|(_, episode)| episode.is_none()) {
        let EpisodeSpec { task, seed, .. } = &work[*number];
        left_out.push(format!("{} seed {seed}: its demonstration did not come so far", task.id));
    }
    Ok(episodes.into_iter().filter_map(|(_, episode)| episode).collect())
}
