//! From what an episode is to its world at rest, and to what moves its robots.

use std::sync::Arc;

use tandem_sim::{Robot, RobotModel, World};
use xxhash_rust::xxh3::xxh3_64;

use super::venue;
use crate::EpisodeError;
use crate::commands::{Motion, RobotSheet, UpperBody};
use crate::convert::isometry_from_sim;
use crate::spec::{EpisodeSpec, RobotFile};

/// What an episode is made of.
pub struct Built {
    /// Before its first control step.
    pub world: World,
    /// What moves each robot.
    pub motions: Vec<Motion>,
    /// Names of robot and controller that tell files of different content apart.
    pub robot: String,
    pub locomotion: String,
}

/// Reads all files and puts the world together.
pub fn build(spec: &EpisodeSpec) -> Result<Built, EpisodeError> {
    let locomotion = spec.locomotion.load()?;
    let mjcf = spec.robot.read()?;
    let model = Arc::new(RobotModel::parse(&spec.robot.name(), &mjcf)?);
    let world_spec = venue::world_spec(spec)?;
    venue::check(spec, &world_spec, &model)?;
    let mut world = World::with_robot(&world_spec, model)?;
    for robot in 0..world.robots().len() {
        world.set_locomotion(robot, locomotion.controller());
    }
    let body = Arc::new(UpperBody::new(&mjcf, &world.rest_command(0))?);
    let present = world.present();
    let motion = |(index, robot): (usize, &Robot)| {
        let sheet = RobotSheet {
            name: robot.name.clone(),
            model: robot.model.clone(),
            base_limits: robot.base_limits(),
        };
        let world_from_pelvis = isometry_from_sim(&present.robots[index].state.world_from_pelvis);
        Motion::new(sheet, &body, &world.rest_command(index), world_from_pelvis)
    };
    let motions = world.robots().iter().enumerate().map(motion).collect();
    let robot = match &spec.robot {
        RobotFile::Embedded(name) => name.clone(),
        RobotFile::File(_) => format!("{}-{:016x}", spec.robot.name(), xxh3_64(mjcf.as_bytes())),
    };
    Ok(Built { world, motions, robot, locomotion: locomotion.name().into() })
}
