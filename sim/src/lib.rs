//! Physics of the robots and their rooms: MJCF loading, dynamics, balance control, cameras and renderers.
//!
//! Rooms, each knowing only those before it: [`dynamics`], [`mjcf`], [`body`], [`locomotion`], [`robot`], [`world`], then
//! [`render`] and [`mod@bench`].
//!
//! Units are SI, z is up, frames are right-handed, quaternions are written `wxyz`. One [`World`] is stepped by one
//! thread; the same binary, specification and commands give the same [`World::state_hash`], bit for bit.

pub mod assets;
pub mod bench;
pub mod body;
pub mod dynamics;
mod error;
pub mod locomotion;
mod mechanism;
pub mod mjcf;
mod owner;
mod plane;
pub mod render;
pub mod robot;
mod sides;
mod units;
pub mod world;

pub use body::{
    ARM_COLUMNS, ARM_JOINTS, HAND_COLUMNS, HAND_JOINTS, JOINTS, RobotModel, UPPER, UPPER_JOINTS,
    WAIST_COLUMN, WholeBody, joint_names,
};
pub use error::SimError;
pub use locomotion::{BaseCommand, BaseLimits, LocomotionChoice};
pub use plane::{heading_rad, wrapped_rad};
pub use rapier3d::math::{Pose, Rotation, Vector};
pub use robot::{Robot, RobotCommand, RobotPlacement, RobotState};
pub use sides::{Side, Sides};
pub use units::{CONTROL_DT_S, CONTROL_HZ, GRAVITY_M_S2, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL};
pub use world::{
    HandContacts, ObjectModel, ObjectPart, ObjectPlacement, ObjectState, ObjectStep, RobotStep, SceneSource,
    Snapshot, Step, Touch, World, WorldSpec,
};
