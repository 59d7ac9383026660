//! Physics of the robots and their rooms: MJCF loading, Rapier world, balance control, cameras and renderers.
//!
//! Units are SI, z is up, frames are right-handed, quaternions are written `wxyz`. One [`World`] is stepped by one
//! thread; the same binary, specification and commands give the same [`World::state_hash`], bit for bit.

pub mod assets;
pub mod dynamics;
mod error;
pub mod locomotion;
pub mod mjcf;
pub mod render;
pub mod robot;
pub mod world;

pub use error::SimError;
pub use locomotion::{BaseCommand, BaseLimits};
pub use rapier3d::math::{Pose, Rotation, Vector};
pub use robot::{RobotCommand, RobotState, Side};
pub use world::{HandContacts, ObjectPlacement, ObjectState, RobotPlacement, Snapshot, World, WorldSpec};

/// Control steps per second; every control step runs [`PHYSICS_STEPS_PER_CONTROL`] physics steps.
pub const CONTROL_HZ: f64 = 50.0;
/// Physics runs at 200 Hz.
pub const PHYSICS_STEPS_PER_CONTROL: u32 = 4;
/// Length of one physics step.
pub const PHYSICS_DT_S: f32 = 1.0 / 200.0;
