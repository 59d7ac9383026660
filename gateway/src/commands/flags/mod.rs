//! Flags that several subcommands share.

mod agent;
mod episode;
mod given;
mod policy;
mod robot_models;
mod run;
mod seed_key;
mod stress;
mod world;

pub use agent::AgentFlags;
pub use episode::{EpisodeFlags, Seeds};
pub use given::GivenFlags;
pub use policy::{PartnerFlags, PolicyFlags};
pub use robot_models::{PolicyPrices, RobotModels};
pub use run::RunFlags;
pub use seed_key::read_seed_key;
pub use stress::{StressFlags, StressPlanFlags};
pub use world::{LocomotionFlag, SensingFlags, WorldFlags};
