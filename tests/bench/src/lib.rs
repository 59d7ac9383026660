//! Benches: measurements of base controllers, falls, physics, images, environments and inverse kinematics,
//! with the robots that episodes use. Only the command line imports this crate.

mod controllers;
mod env;
mod error;
mod falls;
mod ik;
mod physics;
mod pictures;
mod report;
mod seeds;
pub mod single;
mod spread;
mod teams;

pub use controllers::{locomotion, motors};
pub use env::{EnvCase, EnvReport, env};
pub use error::BenchError;
pub use falls::{FallTrial, FallsCase, FallsReport, FloorEpisode, falls};
pub use ik::ik;
pub use physics::{PhysicsCase, PhysicsReport, physics};
pub use pictures::{PicturesCase, PicturesReport, pictures};
pub use report::{CaseFigures, CaseReport, LocomotionReport};
pub use tandem_ik::bench::Report as IkReport;
