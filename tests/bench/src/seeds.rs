//! Cases by name, and trials over seeds.

use std::num::NonZero;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Returns true if a case's name contains one of the comma-separated words of `filter`.
pub fn is_asked(filter: &str, case: &str) -> bool {
    filter.split(',').any(|word| case.contains(word))
}

/// Returns the result of `trial` for each of these seeds. Trials run in parallel, one per processor.
pub fn over_seeds<T: Send>(seeds: &RangeInclusive<u32>, trial: impl Fn(u32) -> T + Sync) -> Vec<T> {
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    let seeds: Vec<u32> = seeds.clone().collect();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let Some(seed) = seeds.get(next.fetch_add(1, Ordering::Relaxed)) else { return done };
            done.push((*seed, trial(*seed)));
        }
    };
    let mut trials: Vec<_> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.min(seeds.len())).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("a trial never panics")).collect()
    });
    trials.sort_by_key(|(seed, _)| *seed);
    trials.into_iter().map(|(_, trial)| trial).collect()
}
