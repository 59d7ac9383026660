//! Physics of the robots and their rooms: MJCF loading, Rapier world, balance control, cameras and renderers.
//!
//! Units are SI, z is up, frames are right-handed, quaternions are written `wxyz`. One [`World`] is stepped by one
//! thread; the same binary, specification and commands give the same [`World::state_hash`], bit for bit.

pub mod assets;
mod error;
pub mod locomotion;
pub mod mjcf;
pub mod render;
pub mod robot;
mod sides;
mod units;
pub mod world;

pub use error::SimError;
pub use locomotion::{BaseCommand, BaseLimits, LocomotionChoice, bench};
pub use rapier3d::math::{Pose, Rotation, Vector};
pub use robot::{
    ARM_COLUMNS, ARM_JOINTS, HAND_COLUMNS, HAND_JOINTS, JOINTS, Robot, RobotCommand, RobotModel, RobotState,
    UPPER, UPPER_JOINTS, WAIST_COLUMN, WholeBody, joint_names,
};
pub use sides::{Side, Sides};
pub use units::{CONTROL_DT_S, CONTROL_HZ, GRAVITY_M_S2, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL};
pub use world::{
    HandContacts, ObjectModel, ObjectPlacement, ObjectState, ObjectStep, RobotPlacement, RobotStep, Snapshot,
    Step, Touch, World, WorldSpec,
};
