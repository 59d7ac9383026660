//! One differential step, and whole solutions built from steps.

use crate::barrier::{PositionBarrier, SelfCollision};
use crate::limits::{LimitKind, Limits};
use crate::qp::{Constraint, Qp, QpFailure};
use crate::task::{Sink, StepContext, Task, TaskScratch};
use crate::{Configuration, FrameError, Model};

/// How a step or a solution ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// Every frame task is within [`Tolerance`].
    Reached,
    /// On the way.
    Moving,
    /// No further progress.
    Stalled {
        /// Joints at a limit of their range: what would have to give way.
        saturated: Vec<usize>,
    },
    /// The constraints contradict each other.
    Infeasible {
        /// The joint or barrier that cannot be kept.
        constraint: String,
    },
}

/// When a frame task counts as reached.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// m.
    pub position_m: f64,
    /// rad.
    pub orientation_rad: f64,
}

impl Default for Tolerance {
    /// 1 mm and half a degree.
    fn default() -> Self {
        Tolerance { position_m: 1e-3, orientation_rad: 0.5_f64.to_radians() }
    }
}

/// A joint whose step was cut short.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClampedJoint {
    /// Index in the model.
    pub joint: usize,
    /// The limit that did it.
    pub limit: LimitKind,
}

/// Solves for joint displacements of one model; keeps its work space, so that steps do not allocate.
pub struct Solver {
    /// Length of a step, s.
    pub dt_s: f64,
    /// Joint limits.
    pub limits: Limits,
    /// Pairs of shapes to keep apart.
    pub self_collision: Option<SelfCollision>,
    /// Planes to stay beyond.
    pub position_barriers: Vec<PositionBarrier>,
    /// When a frame counts as reached.
    pub tolerance: Tolerance,
    qp: Qp,
    scratch: TaskScratch,
    last_velocity: Vec<f64>,
    bounds: Vec<[(f64, LimitKind); 2]>,
}

/// Added to the Hessian's diagonal: joints that no task moves stay where they are.
const REGULARIZATION: f64 = 1e-12;
/// Joints within this of a limit count as saturated, rad or m.
const SATURATED: f64 = 1e-3;
/// A step slower than this, in rad/s or m/s, away from its goal has stalled.
const STALLED_SPEED: f64 = 1e-3;

impl Solver {
    /// Work space for `model`, with its own limits.
    pub fn new(model: &Model, dt_s: f64) -> Solver {
        let nv = model.nv();
        Solver {
            dt_s,
            limits: Limits::of(model),
            self_collision: None,
            position_barriers: Vec::new(),
            tolerance: Tolerance::default(),
            qp: Qp::new(nv),
            scratch: TaskScratch::new(nv),
            last_velocity: vec![0.0; nv],
            bounds: vec![[(0.0, LimitKind::Velocity); 2]; nv],
        }
    }

    /// Moves `configuration` by one step of [`Solver::dt_s`] towards `tasks`; `constraints` are tasks that hold exactly.
    pub fn step(&mut self, configuration: &mut Configuration, tasks: &[Task], constraints: &[Task]) -> Outcome {
        if let Err(failure) = self.displacement(configuration, tasks, constraints) {
            self.last_velocity.fill(0.0);
            return self.infeasible(configuration.model(), failure);
        }
        configuration.advance(&self.qp.x, 1.0);
        for (velocity, dq) in self.last_velocity.iter_mut().zip(&self.qp.x) {
            *velocity = dq / self.dt_s;
        }
        if self.is_reached(configuration, tasks) {
            Outcome::Reached
        } else if self.last_velocity.iter().all(|velocity| velocity.abs() < STALLED_SPEED) {
            Outcome::Stalled { saturated: saturated(configuration) }
        } else {
            Outcome::Moving
        }
    }

    /// Joint speeds of the last step, rad/s or m/s.
    pub fn velocity(&self) -> &[f64] {
        &self.last_velocity
    }

    /// Joints whose last step a limit cut short.
    pub fn clamped(&self) -> impl Iterator<Item = ClampedJoint> + '_ {
        self.qp.active().filter_map(|constraint| match constraint {
            Constraint::Lower(joint) => Some(ClampedJoint { joint, limit: self.bounds[joint][0].1 }),
            Constraint::Upper(joint) => Some(ClampedJoint { joint, limit: self.bounds[joint][1].1 }),
            Constraint::Row(_) => None,
        })
    }

    /// Forgets the last velocity: the next step starts at rest.
    pub fn rest(&mut self) {
        self.last_velocity.fill(0.0);
    }

    /// Whether every frame task is within tolerance.
    pub fn is_reached(&self, configuration: &Configuration, tasks: &[Task]) -> bool {
        frame_errors(configuration, tasks).all(|error| {
            error.position_m <= self.tolerance.position_m && error.orientation_rad <= self.tolerance.orientation_rad
        })
    }

    /// Sets up and solves the quadratic program; the displacement is in `self.qp.x`.
    pub(crate) fn displacement(
        &mut self,
        configuration: &Configuration,
        tasks: &[Task],
        constraints: &[Task],
    ) -> Result<(), QpFailure> {
        let nv = configuration.model().nv();
        self.qp.hessian.fill(0.0);
        self.qp.linear.fill(0.0);
        self.qp.clear_rows();
        let context = StepContext { dt_s: self.dt_s, last_velocity: &self.last_velocity };
        let mut cost = Cost { qp: &mut self.qp };
        cost.damp(REGULARIZATION);
        for task in tasks {
            task.write(configuration, &context, &mut self.scratch, &mut cost);
        }
        let mut equalities = Equalities { qp: &mut self.qp };
        for task in constraints {
            task.write(configuration, &context, &mut self.scratch, &mut equalities);
        }
        if let Some(self_collision) = &self.self_collision {
            self_collision.write(configuration, &mut self.qp);
        }
        for barrier in &self.position_barriers {
            barrier.write(configuration, &mut self.qp);
        }
        for joint in 0..nv {
            let interval = self.limits.interval(configuration, joint, self.dt_s, self.last_velocity[joint]);
            self.bounds[joint] = interval;
            (self.qp.lower[joint], self.qp.upper[joint]) = (interval[0].0, interval[1].0);
        }
        self.qp.solve()
    }

    pub(crate) fn last_displacement(&self) -> &[f64] {
        &self.qp.x
    }

    pub(crate) fn infeasible(&self, model: &Model, failure: QpFailure) -> Outcome {
        let constraint = match failure {
            QpFailure::Infeasible(Constraint::Lower(joint)) => format!("lower limit of {}", model.joints()[joint].name),
            QpFailure::Infeasible(Constraint::Upper(joint)) => format!("upper limit of {}", model.joints()[joint].name),
            QpFailure::Infeasible(Constraint::Row(row)) => format!("row {row} of the equality tasks and barriers"),
            QpFailure::NotConvex => "the cost: a task holds numbers that are not finite".into(),
            QpFailure::Unsettled => "the active set: constraints are nearly dependent".into(),
        };
        Outcome::Infeasible { constraint }
    }
}

/// Errors of the frame tasks among `tasks`, in order.
pub fn frame_errors<'a>(
    configuration: &'a Configuration,
    tasks: &'a [Task],
) -> impl Iterator<Item = FrameError> + 'a {
    tasks.iter().filter_map(|task| match task {
        Task::Frame(task) => Some(task.error(configuration)),
        _ => None,
    })
}

/// Joints at a limit of their range.
pub fn saturated(configuration: &Configuration) -> Vec<usize> {
    let at_limit = |(joint, q): (&crate::Joint, &f64)| *q < joint.lower + SATURATED || *q > joint.upper - SATURATED;
    let joints = configuration.model().joints().iter().zip(configuration.q());
    joints.enumerate().filter(|(_, joint)| at_limit(*joint)).map(|(index, _)| index).collect()
}

/// Adds tasks to the cost.
struct Cost<'a> {
    qp: &'a mut Qp,
}

impl Sink for Cost<'_> {
    fn row(&mut self, entries: &[(usize, f64)], error: f64) {
        for &(i, a) in entries {
            self.qp.linear[i] -= a * error;
            for &(j, b) in entries {
                self.qp.hessian[(i, j)] += a * b;
            }
        }
    }

    fn diagonal(&mut self, weight: f64, error: &dyn Fn(usize) -> f64) {
        let square = weight * weight;
        for joint in 0..self.qp.linear.len() {
            self.qp.hessian[(joint, joint)] += square;
            self.qp.linear[joint] -= square * error(joint);
        }
    }

    fn damp(&mut self, mu: f64) {
        for joint in 0..self.qp.linear.len() {
            self.qp.hessian[(joint, joint)] += mu;
        }
    }
}

/// Adds tasks as equations.
struct Equalities<'a> {
    qp: &'a mut Qp,
}

impl Sink for Equalities<'_> {
    fn row(&mut self, entries: &[(usize, f64)], error: f64) {
        let row = self.qp.push_row();
        for (joint, value) in entries {
            row.coefficients[*joint] = *value;
        }
        row.bound = error;
        row.equality = true;
    }

    fn diagonal(&mut self, weight: f64, error: &dyn Fn(usize) -> f64) {
        for joint in 0..self.qp.linear.len() {
            self.row(&[(joint, weight)], weight * error(joint));
        }
    }

    fn damp(&mut self, _: f64) {}
}
