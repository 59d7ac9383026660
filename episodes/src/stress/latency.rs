//! What robots are told reaches them late, all of them alike.

use super::StressLevel;

/// Control steps of 20 ms: 40, 100 and 200 ms.
const STEPS: [usize; 3] = [2, 5, 10];

/// By how many control steps a command is late.
pub fn steps(level: StressLevel) -> usize {
    level.of(STEPS)
}
