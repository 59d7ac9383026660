//! State of bodies that may sleep.

use serde::{Deserialize, Serialize};

/// State of a body that may sleep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    /// Number of steps for which the body has been still, at most [`STILL_STEPS`].
    still_steps: u32,
    pub is_asleep: bool,
}

/// Maximum velocity of a still body, m/s or rad/s along each of its degrees of freedom.
const STILL: f64 = 0.002;
/// Number of still steps after which a body may fall asleep.
const STILL_STEPS: u32 = 40;

impl Rest {
    /// Counts a step at whose end the body has this speed.
    pub fn count(&mut self, speed: f64) {
        self.still_steps = if speed < STILL { (self.still_steps + 1).min(STILL_STEPS) } else { 0 };
    }

    /// Returns true if the body has been still for long enough.
    pub fn is_ready(self) -> bool {
        self.still_steps == STILL_STEPS
    }
}
