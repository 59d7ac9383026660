//! Latency stress: commands reach all robots late, with the same delay.

use super::StressLevel;

/// Delays in control steps of 20 ms: 40, 100 and 200 ms.
const STEPS: [usize; 3] = [2, 5, 10];

/// Returns the delay of commands in control steps.
pub fn steps(level: StressLevel) -> usize {
    level.of(STEPS)
}
