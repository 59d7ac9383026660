//! Commands in joint space: targets for the robot's controller, and setpoints of its motors.

mod executed;
mod send_joint_chunk;
mod send_joint_drives;

pub use executed::Executed;
pub use send_joint_chunk::JointTrajectory;
pub use send_joint_drives::{DriveTrajectory, drive_row};
