//! Tasks on the joints, as weighted least squares in the joint displacement dq.
//!
//! Each task demands  J dq = alpha e  at a cost, and adds to the quadratic program
//!   1/2 |W (J dq - alpha e)|^2 + 1/2 mu |dq|^2,   mu = lambda |alpha W e|^2,
//! so that  H += (WJ)'(WJ) + mu I,  c -= alpha (WJ)'(We). J: k x nv; e: k; W: diagonal. lambda is
//! Levenberg-Marquardt damping, which fades as the error does. Source: Sugihara, Solvability-unconcerned
//! inverse kinematics by the Levenberg-Marquardt method, 2011.

mod center_of_mass;
mod frame;
mod goal;
mod joint_position;
mod joint_velocity;
mod pose;
mod relative_frame;

pub use center_of_mass::CenterOfMassTask;
pub use frame::FrameTask;
pub use goal::FrameError;
pub(crate) use goal::{ERROR_CLAMP, Goal, Sink, StepContext, TaskScratch};
pub use joint_position::{JointCouplingTask, PostureTask};
pub use joint_velocity::{DampingTask, JointVelocityTask, LowAccelerationTask};
pub use relative_frame::RelativeFrameTask;

use crate::model::Configuration;

/// One objective; see the variants.
#[derive(Clone, Debug)]
pub enum Task {
    /// A frame at a pose in the root's frame.
    Frame(FrameTask),
    /// A frame at a pose in another frame.
    RelativeFrame(RelativeFrameTask),
    /// The centre of mass at a point in the root's frame.
    CenterOfMass(CenterOfMassTask),
    /// All joints near given coordinates.
    Posture(PostureTask),
    /// Slow joints.
    Damping(DampingTask),
    /// Joints that move at given speeds.
    JointVelocity(JointVelocityTask),
    /// Joints that keep their speed.
    LowAcceleration(LowAccelerationTask),
    /// Joints whose coordinates keep a linear relation.
    JointCoupling(JointCouplingTask),
}

impl Task {
    /// Returns the error of a frame's pose or of the centre of mass. Returns `None` for tasks without such a
    /// target.
    pub fn error(&self, configuration: &Configuration) -> Option<FrameError> {
        self.goal().frame_error(configuration)
    }

    /// Returns the task of its kind.
    pub(crate) fn goal(&self) -> &dyn Goal {
        match self {
            Task::Frame(task) => task,
            Task::RelativeFrame(task) => task,
            Task::CenterOfMass(task) => task,
            Task::Posture(task) => task,
            Task::Damping(task) => task,
            Task::JointVelocity(task) => task,
            Task::LowAcceleration(task) => task,
            Task::JointCoupling(task) => task,
        }
    }
}
