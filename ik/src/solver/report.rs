//! Reports of steps and solutions.

use super::limits::LimitKind;
use crate::barriers::ClosestPair;
use crate::model::{Configuration, Joint};
use crate::tasks::FrameError;

/// Outcome of a step or a solution.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// Every frame and centre of mass that has a target is within [`Tolerance`], and no barrier is crossed.
    Reached,
    /// The joints are moving towards the targets.
    Moving,
    /// No further progress.
    Stalled {
        /// Joints at a limit of their range, which may prevent progress.
        saturated: Vec<usize>,
    },
    /// The constraints contradict each other.
    Infeasible {
        /// The joint, equality task or barrier that cannot be satisfied.
        constraint: String,
    },
}

/// Errors within which a frame counts as reached.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Position error, m.
    pub position_m: f64,
    /// Orientation error, rad.
    pub orientation_rad: f64,
}

impl Default for Tolerance {
    /// Returns 1 mm and half a degree.
    fn default() -> Self {
        Tolerance { position_m: 1e-3, orientation_rad: 0.5_f64.to_radians() }
    }
}

impl Tolerance {
    /// Returns true if an error is within the tolerance.
    pub fn accepts(&self, error: &FrameError) -> bool {
        error.position_m <= self.position_m && error.orientation_rad <= self.orientation_rad
    }
}

/// A joint whose step was cut short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClampedJoint {
    /// Index in the model.
    pub joint: usize,
    /// The limit that cut it short.
    pub limit: LimitKind,
    /// Remaining range of the joint in the direction in which it was stopped, rad or m.
    pub margin: f64,
}

/// Report of a solution.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveReport {
    /// Outcome; `Moving` if the iterations ran out.
    pub outcome: Outcome,
    /// Steps over all attempts.
    pub iterations: usize,
    /// Attempts after the first.
    pub restarts: usize,
    /// Errors of the tasks that have one, in order; see [`crate::Task::error`].
    pub errors: Vec<FrameError>,
    /// Joints that a limit stopped in the last step of the reported attempt.
    pub clamped: Vec<ClampedJoint>,
    /// The pair of shapes nearest to touching.
    pub closest_pair: Option<ClosestPair>,
    /// Largest joint speed of the last step, rad/s or m/s: a stalled solution has come to rest.
    pub final_speed: f64,
}

/// Distance to a limit within which a joint counts as saturated, rad or m.
const SATURATED: f64 = 1e-3;

/// Returns the joints at a limit of their range.
pub fn saturated(configuration: &Configuration) -> Vec<usize> {
    let at_limit = |joint: &Joint, q: f64| q < joint.lower + SATURATED || q > joint.upper - SATURATED;
    let joints = configuration.model().joints().iter().zip(configuration.q());
    joints.enumerate().filter(|(_, (joint, q))| at_limit(joint, **q)).map(|(index, _)| index).collect()
}
