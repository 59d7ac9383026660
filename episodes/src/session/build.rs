//! From what an episode is to its world at rest, and to what moves its robots.

use std::sync::Arc;

use tandem_sim::{ObjectPlacement, Pose, Robot, RobotModel, RobotPlacement, Rotation, World, WorldSpec};
use xxhash_rust::xxh3::xxh3_64;

use crate::EpisodeError;
use crate::commands::{Motion, RobotSheet, UpperBody};
use crate::convert::isometry_from_sim;
use crate::spec::{EpisodeSpec, RobotFile};
use crate::tasks::Task;

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
    let mut world = World::with_robot(&world_spec(spec.task, spec.seed), model)?;
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

fn world_spec(task: &Task, seed: u32) -> WorldSpec {
    let robots = task.robots.iter().map(|robot| RobotPlacement {
        name: robot.name.into(),
        position_m: robot.position_m,
        yaw_rad: robot.yaw_rad,
    });
    let objects = task.objects.iter().zip(task.starts(seed)).map(|(spot, start)| ObjectPlacement {
        name: spot.name.into(),
        file: spot.file.into(),
        world_from_object: Pose::from_parts(
            start.position_m.into(),
            Rotation::from_rotation_z(start.yaw_rad),
        ),
    });
    WorldSpec { scene: task.scene.into(), robots: robots.collect(), objects: objects.collect() }
}
