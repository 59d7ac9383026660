//! Where an episode stands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is left of the episode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Budget {
    /// Control steps of 20 ms.
    pub steps_left: u32,
    /// Seconds that the policy may still spend between calls; the simulator's own time is not counted. Null where the
    /// protocol sets no limit.
    pub wall_clock_left_s: Option<f64>,
    /// The most steps that one command may ask for.
    pub steps_per_command: u32,
}

/// A phase of the task, and when it was reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PhaseReached {
    /// What the phase is called, as `grasp_and_lift`.
    pub id: String,
    /// `p1`, `p2`, ... in the order they have to be reached.
    pub number: String,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
}

/// Whether a robot has fallen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotFallen {
    /// The robot, as "A".
    pub robot: String,
    /// True from the moment it fell.
    pub fallen: bool,
}
