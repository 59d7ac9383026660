//! Physics of the robots and their rooms: MJCF loading, dynamics, balance control, cameras and renderers.
//!
//! The modules, each of which uses only those before it: [`dynamics`], [`mjcf`], [`body`], [`estimate`]
//! and [`locomotion`], [`robot`], [`world`] and [`render`].
//!
//! Units are SI, z is up, frames are right-handed, quaternions are written `wxyz`. One [`World`] is
//! stepped by one thread. The same binary, specification and commands give the same
//! [`World::state_hash`], bit for bit.
//!
//! A world is made from a specification, stepped with one command per robot, and read as a [`Step`]:
//!
//! ```
//! use tandem_sim::{RobotPlacement, World, WorldSpec};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = |name: &str, x_m: f32| {
//!     RobotPlacement { name: name.into(), position_m: [x_m, 0.0], yaw_rad: 0.0 }
//! };
//! let robots = vec![robot("A", 0.0), robot("B", 1.5)];
//! let mut world = World::new(&WorldSpec { scene: "floor".into(), robots, objects: vec![] })?;
//! let commands = [world.rest_command(0), world.rest_command(1)];
//! let mut step = world.present();
//! for _ in 0..25 {
//!     step = world.control_step(&commands)?;
//! }
//! assert_eq!(step.time_s, 0.5);
//! for (robot, x_m) in step.robots.iter().zip([0.0, 1.5]) {
//!     let pelvis_m = robot.truth.world_from_pelvis().translation;
//!     assert!((pelvis_m.x - x_m).abs() < 0.05 && pelvis_m.z > 0.7, "it stands where it was put");
//! }
//! # Ok(())
//! # }
//! ```
//!
//! A renderer draws the image of a camera after a step:
//!
//! ```
//! use tandem_sim::render::{Cameras, RendererKind, Scenery, encode_png};
//! use tandem_sim::{RobotPlacement, World, WorldSpec};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = RobotPlacement { name: "A".into(), position_m: [0.0, 0.0], yaw_rad: 0.0 };
//! let world = World::new(&WorldSpec { scene: "kitchen_084".into(), robots: vec![robot], objects: vec![] })?;
//! let mut renderer = RendererKind::Cpu.renderer(Scenery::of(&world));
//! let step = world.present();
//! let frame = renderer.render(&step, &Cameras::of(&world).egocentric(&step, 0));
//! let png = encode_png(frame.width, frame.height, &frame.rgb)?;
//! assert_eq!(&png[1..4], b"PNG");
//! assert!(frame.depth_m.iter().any(|depth_m| *depth_m < 1.0), "it sees its own hands or the counter");
//! # Ok(())
//! # }
//! ```

pub mod assets;
pub mod body;
pub mod dynamics;
mod error;
pub mod estimate;
pub mod locomotion;
mod mass;
mod mechanism;
pub mod mjcf;
mod owner;
mod plane;
mod random;
pub mod render;
pub mod robot;
mod sides;
mod srgb;
mod units;
mod user_file;
pub mod world;

pub use body::{
    ARM_COLUMNS, ARM_JOINTS, BodyEstimate, HAND_COLUMNS, HAND_JOINTS, JOINTS, MotorSetpoints, RobotDraft,
    RobotModel, RobotSource, UPPER, UPPER_JOINTS, WAIST_COLUMN, joint_names,
};
pub use error::SimError;
pub use estimate::{JointReadings, SensorReadings};
pub use locomotion::{BaseCommand, BaseLimits, BaseVelocity, LocomotionChoice};
pub use plane::{flat, heading_rad, wrapped_rad};
pub use random::SplitMix64;
pub use rapier3d::math::{Pose, Rotation, Vector};
pub use robot::{
    Robot, RobotCommand, RobotEstimate, RobotPlacement, RobotSensed, RobotTruth, Sensing, SensorModel,
    StateSource,
};
pub use sides::{Side, Sides};
pub use srgb::linear_light;
pub use units::{CONTROL_DT_S, CONTROL_HZ, GRAVITY_M_S2, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL};
pub use user_file::{MAX_TEXT_BYTES, read_bytes, read_text, with_own_separators};
pub use world::{
    BodyTouch, HandContacts, ObjectFile, ObjectModel, ObjectPart, ObjectPlacement, ObjectState, ObjectStep,
    Opening, OpeningKind, PlannedPush, RobotPress, RobotStep, SceneSource, Snapshot, Step, Touch, World,
    WorldSpec,
};
