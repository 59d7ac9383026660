//! How long things took.

use std::time::Duration;

/// Upper ends of the buckets, in seconds: calls without physics take less than a millisecond, commands and pictures a few hundred.
pub const BOUNDS_S: [f64; 12] = [0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0];

/// Times, counted in buckets.
#[derive(Debug, Default)]
pub struct Histogram {
    /// How many fell into each bucket, and above all of them.
    counts: [u64; BOUNDS_S.len() + 1],
    sum: Duration,
}

impl Histogram {
    /// Counts one.
    pub fn add(&mut self, took: Duration) {
        let bucket = BOUNDS_S.iter().position(|bound_s| took.as_secs_f64() <= *bound_s);
        self.counts[bucket.unwrap_or(BOUNDS_S.len())] += 1;
        self.sum += took;
    }

    /// How many took at most as long as each bound, and how many there are.
    pub fn cumulative(&self) -> [u64; BOUNDS_S.len() + 1] {
        let mut sum = 0;
        self.counts.map(|count| {
            sum += count;
            sum
        })
    }

    /// All of them together.
    pub fn sum(&self) -> Duration {
        self.sum
    }
}
