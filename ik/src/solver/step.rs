//! One differential step: solves the quadratic program and moves the joints.

use super::limits::{LimitKind, Limits};
use super::program::RowOwner;
use super::report::{ClampedJoint, Outcome, Tolerance, saturated};
use crate::barriers::{ClosestPair, PositionBarrier, Segment, SelfCollision};
use crate::model::{Configuration, Model};
use crate::qp::{Constraint, Qp};
use crate::tasks::{FrameError, Task, TaskScratch};

/// Solver for joint displacements of one model. It retains its work space, so that a step that moves
/// does not allocate.
pub struct Solver {
    /// Length of a step, s.
    pub dt_s: f64,
    /// Joint limits.
    pub limits: Limits,
    /// Pairs of shapes to keep apart.
    pub self_collision: Option<SelfCollision>,
    /// Planes on whose free sides frames stay.
    pub position_barriers: Vec<PositionBarrier>,
    /// Tolerance within which a frame counts as reached.
    pub tolerance: Tolerance,
    /// State of [`Solver::track`]: caution after failed steps, at least 1. Save it along with the joint
    /// coordinates.
    pub caution: f64,
    pub(super) qp: Qp,
    pub(super) row_owners: Vec<RowOwner>,
    pub(super) scratch: TaskScratch,
    pub(super) segments: Vec<Segment>,
    pub(super) last_velocity: Vec<f64>,
    pub(super) bounds: Vec<[(f64, LimitKind); 2]>,
}

/// Joint speed (rad/s or m/s) below which a step away from its target counts as stalled: several seconds
/// would bring no progress.
const STALLED_SPEED: f64 = 0.02;

impl Solver {
    /// Creates a solver for `model`, with the model's limits.
    pub fn new(model: &Model, dt_s: f64) -> Solver {
        let nv = model.nv();
        Solver {
            dt_s,
            limits: Limits::of(model),
            self_collision: None,
            position_barriers: Vec::new(),
            tolerance: Tolerance::default(),
            qp: Qp::new(nv),
            caution: 1.0,
            row_owners: Vec::new(),
            scratch: TaskScratch::new(nv),
            segments: Vec::new(),
            last_velocity: vec![0.0; nv],
            bounds: vec![[(0.0, LimitKind::Velocity); 2]; nv],
        }
    }

    /// Moves `configuration` by one step of [`Solver::dt_s`] towards `tasks`; `constraints` are tasks
    /// that hold exactly. These are Pink's iterates: a target out of reach keeps the joints moving; see
    /// [`Solver::track`].
    pub fn step(
        &mut self,
        configuration: &mut Configuration,
        tasks: &[Task],
        constraints: &[Task],
    ) -> Outcome {
        if let Err(failure) = self.displacement(configuration, tasks, constraints, None, 0.0) {
            self.rest();
            return self.infeasible(configuration.model(), constraints, failure);
        }
        configuration.advance(&self.qp.x, 1.0);
        self.remember(1.0);
        self.outcome(configuration, tasks)
    }

    /// Stores the velocity  scale dq / dt  as the last velocity.
    pub(crate) fn remember(&mut self, scale: f64) {
        for (velocity, dq) in self.last_velocity.iter_mut().zip(&self.qp.x) {
            *velocity = scale * dq / self.dt_s;
        }
    }

    /// Returns the outcome of a step that led to `configuration`.
    pub(crate) fn outcome(&self, configuration: &Configuration, tasks: &[Task]) -> Outcome {
        if self.is_reached(configuration, tasks) {
            Outcome::Reached
        } else if self.fastest() < STALLED_SPEED {
            Outcome::Stalled { saturated: saturated(configuration) }
        } else {
            Outcome::Moving
        }
    }

    /// Returns the largest joint speed of the last step, rad/s or m/s.
    pub fn fastest(&self) -> f64 {
        self.last_velocity.iter().fold(0.0, |fastest, velocity| fastest.max(velocity.abs()))
    }

    /// Returns the joint speeds of the last step, rad/s or m/s.
    pub fn velocity(&self) -> &[f64] {
        &self.last_velocity
    }

    /// Returns the joints whose last step was cut short by a limit; `configuration` must be the result
    /// of that step.
    pub fn clamped(&self, configuration: &Configuration) -> impl Iterator<Item = ClampedJoint> {
        let (joints, q) = (configuration.model().joints(), configuration.q());
        self.qp.active().filter_map(move |constraint| match constraint {
            Constraint::Lower(joint) => {
                let margin = q[joint] - joints[joint].lower;
                Some(ClampedJoint { joint, limit: self.bounds[joint][0].1, margin })
            }
            Constraint::Upper(joint) => {
                let margin = joints[joint].upper - q[joint];
                Some(ClampedJoint { joint, limit: self.bounds[joint][1].1, margin })
            }
            Constraint::Row(_) => None,
        })
    }

    /// Returns the pair of shapes nearest to touching, if there are shapes.
    pub fn closest_pair(&self, configuration: &Configuration) -> Option<ClosestPair> {
        self.self_collision.as_ref().and_then(|barrier| barrier.closest(configuration))
    }

    /// Clears the state from previous steps: the next step starts at rest and without caution.
    pub fn rest(&mut self) {
        self.last_velocity.fill(0.0);
        self.caution = 1.0;
    }

    /// Returns true if there are targets, all of them are within tolerance, and no barrier is crossed.
    pub fn is_reached(&self, configuration: &Configuration, tasks: &[Task]) -> bool {
        let mut errors = frame_errors(configuration, tasks).peekable();
        let there = errors.peek().is_some() && errors.all(|error| self.tolerance.accepts(&error));
        there && !self.crosses_barrier(configuration)
    }

    /// Returns true if shapes overlap, or a frame is on the wrong side of its plane by more than the
    /// tolerance.
    pub(crate) fn crosses_barrier(&self, configuration: &Configuration) -> bool {
        let beyond = |barrier: &PositionBarrier| barrier.height_m(configuration) < -self.tolerance.position_m;
        self.closest_pair(configuration).is_some_and(|pair| pair.distance_m < 0.0)
            || self.position_barriers.iter().any(beyond)
    }
}

/// Returns the errors of the tasks that have one, in order; see [`Task::error`].
pub fn frame_errors(configuration: &Configuration, tasks: &[Task]) -> impl Iterator<Item = FrameError> {
    tasks.iter().filter_map(|task| task.error(configuration))
}
