//! Differential inverse kinematics: joint displacements that bring frames to targets within limits.
//!
//! A step solves one quadratic program in the joint displacement dq,
//!
//! ```text
//!   minimise    sum over tasks  1/2 |W (J dq - alpha e)|^2 + 1/2 mu |dq|^2
//!   subject to  lower <= dq <= upper,  barrier rows,  equality tasks
//! ```
//!
//! Everything is f64 and SI: metres, radians, seconds. Poses are `nalgebra::Isometry3<f64>` in the frame
//! of the model's root, which is fixed. Twists are ordered [linear; angular].
//!
//! [`Solver::step`] takes one such step and yields Pink's iterates. [`Solver::track`] takes one that does not
//! increase the objective unless limits or barriers demand it, for streamed targets that may be out of reach.
//! [`Solver::solve`] iterates to a solution, with restarts for planning. All three report an [`Outcome`].
//!
//! ```
//! use tandem_ik::{Configuration, FrameTask, Model, PostureTask, Solver, Task};
//!
//! # fn main() -> Result<(), tandem_ik::IkError> {
//! let xml = r#"<mujoco><compiler angle="radian"/><worldbody><body name="base"><body name="upper" pos="0 0 1">
//!     <joint name="shoulder" axis="0 1 0" range="-2 2"/><body name="lower" pos="0.3 0 0">
//!     <joint name="elbow" axis="0 1 0" range="-2 2"/><site name="hand" pos="0.3 0 0"/>
//!     </body></body></body></worldbody></mujoco>"#;
//! let model = Model::from_mjcf(xml)?;
//! let mut configuration = Configuration::new(&model, &[0.3, 0.3])?;
//! let hand = model.frame("hand")?;
//! let mut target = configuration.root_from_frame(hand);
//! target.translation.x -= 0.05;
//! let tasks = [
//!     Task::Frame(FrameTask { orientation_cost: 0.0, ..FrameTask::new(hand, target) }),
//!     Task::Posture(PostureTask { target: vec![0.3, 0.3], cost: 1e-3, gain: 1.0 }),
//! ];
//! let mut solver = Solver::new(&model, 0.02);
//! for _ in 0..20 {
//!     solver.step(&mut configuration, &tasks, &[]);
//! }
//! let missing = configuration.root_from_frame(hand).translation.vector - target.translation.vector;
//! assert!(missing.norm() < 1e-4);
//! # Ok(())
//! # }
//! ```
//!
//! This example uses a robot's file: only its right arm may move, and a wrist goes to a target.
//!
//! ```
//! use tandem_ik::{Configuration, FrameTask, Model, Outcome, SolveOptions, Solver, Task};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../sim/assets/robots/g1_dex3/robot.xml");
//! let robot = Model::from_mjcf(&std::fs::read_to_string(file)?)?;
//! let parts = ["right_shoulder", "right_elbow", "right_wrist"];
//! let moves = |name: &&str| parts.iter().any(|part| name.contains(part));
//! let free: Vec<&str> = robot.joints().iter().map(|joint| joint.name.as_str()).filter(moves).collect();
//! let arm = robot.reduced(&free, &vec![0.0; robot.nv()])?;
//! let mut configuration = Configuration::new(&arm, &[0.0, -0.2, 0.0, 0.9, 0.0, 0.0, 0.0])?;
//! let wrist = arm.frame("right_wrist")?;
//! let mut target = configuration.root_from_frame(wrist);
//! target.translation.x += 0.05;
//! target.translation.z += 0.10;
//! let tasks = [Task::Frame(FrameTask::new(wrist, target))];
//! let report = Solver::new(&arm, 0.02).solve(&mut configuration, &tasks, &SolveOptions::default());
//! assert_eq!(report.outcome, Outcome::Reached);
//! # Ok(())
//! # }
//! ```

#![warn(missing_docs)]

mod barriers;
pub mod bench;
#[cfg(test)]
mod derivatives;
mod error;
mod model;
pub mod qp;
mod solver;
pub mod spatial;
mod tasks;

pub use barriers::{Capsule, ClosestPair, PositionBarrier, SelfCollision};
pub use error::IkError;
pub use model::{Configuration, Frame, FrameId, Joint, JointKind, Model};
pub use solver::{
    ClampedJoint, LimitKind, Limits, Outcome, SolveOptions, SolveReport, Solver, Tolerance, frame_errors,
    saturated,
};
pub use tasks::{
    CenterOfMassTask, DampingTask, FrameError, FrameTask, JointCouplingTask, JointVelocityTask,
    LowAccelerationTask, PostureTask, RelativeFrameTask, Task,
};
