//! Spread of measured values, and CPU time of a thread.

use std::time::{Duration, Instant};

use serde::Serialize;

/// A measured value and its spread: median and quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    pub median: f64,
    pub quartiles: [f64; 2],
}

/// Linux file that begins with the CPU time of this thread in nanoseconds.
const BUSY: &str = "/proc/thread-self/schedstat";

/// Returns the CPU time of this thread, or the time since `started` if the system does not report it.
pub fn busy_since(started: Instant) -> Duration {
    let text = std::fs::read_to_string(BUSY).unwrap_or_default();
    let ns = text.split_whitespace().next().and_then(|word| word.parse().ok());
    ns.map_or_else(|| started.elapsed(), Duration::from_nanos)
}

impl Spread {
    /// Computes the spread of `values`, which it sorts.
    ///
    /// # Panics
    ///
    /// Panics if `values` is empty.
    pub fn of(values: &mut [f64]) -> Spread {
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
        Spread { median: at(0.5), quartiles: [at(0.25), at(0.75)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_leave_a_quarter_on_each_side() {
        let mut values = [5.0, 1.0, 4.0, 2.0, 3.0];
        assert_eq!(Spread::of(&mut values), Spread { median: 3.0, quartiles: [2.0, 4.0] });
        assert_eq!(Spread::of(&mut [7.0]), Spread { median: 7.0, quartiles: [7.0, 7.0] });
    }
}
