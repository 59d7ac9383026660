//! Construction of an episode's world at rest, and of its robots' motions. The scene is the task's own,
//! or another one in which sites give the places of the task's robots and objects.

mod trial;

use std::path::Path;
use std::sync::Arc;

use nalgebra::Isometry3;
use tandem_sim::mjcf::{Document, Site};
use tandem_sim::{
    ObjectPlacement, Pose, Robot, RobotModel, RobotPlacement, Rotation, SceneSource, SimError, Vector, World,
    WorldSpec, assets, heading_rad,
};

use crate::EpisodeError;
use crate::commands::{Motion, RobotSheet, UpperBody};
use crate::convert::isometry_from_sim;
use crate::error::{RobotError, SceneError};
use crate::spec::EpisodeSpec;
use crate::stress;
use crate::tasks::{Spread, Task};

/// Site of a scene at the origin of a task.
const TASK_SITE: &str = "task";
const THIRD_PERSON: &str = "third_person";
/// Maximum tilt of a site.
const LEVEL_RAD: f32 = 0.01;

/// A newly built episode.
pub struct Built {
    /// World before its first control step.
    pub world: World,
    /// Motion of each robot.
    pub motions: Vec<Motion>,
    /// Names of robot and controller, which distinguish files of different content.
    pub robot: String,
    pub locomotion: String,
}

/// Reads all files and builds the world.
///
/// # Errors
///
/// If a file cannot be read, or robot, controller, task and scene do not fit together.
pub fn build_world(spec: &EpisodeSpec) -> Result<Built, EpisodeError> {
    let locomotion = spec.locomotion.load()?;
    let source = spec.robot.load()?;
    let model = Arc::new(source.model.clone());
    spec.robot.check_task(&model, &spec.task)?;
    let fits = locomotion.check_robot(&model);
    fits.map_err(|what| RobotError::Controller { robot: spec.robot.kind(), what })?;
    if !stress::is_possible(spec.stress, &spec.task) {
        return Err(EpisodeError::NoOtherWords {
            task: spec.task.id.clone(),
            have: stress::reworded_tasks().collect(),
        });
    }
    let mut world_spec = world_spec(spec)?;
    add_distractors(spec, &mut world_spec, &model)?;
    trial::try_scene(spec, &world_spec, &model)?;
    let mut world = World::with_robot(&world_spec, model)?;
    if let Some(stress) = spec.stress {
        stress.alter(&mut world, &spec.task, spec.world_seed(), spec.rules().initial_hold_steps);
    }
    for robot in 0..world.robots().len() {
        world.set_locomotion(robot, locomotion.controller());
    }
    world.set_sensing(spec.stressed_sensing(), spec.world_seed());
    let body = Arc::new(UpperBody::new(&source, &world.rest_command(0))?);
    let present = world.present();
    let motion = |(index, robot): (usize, &Robot)| {
        let sheet = RobotSheet {
            name: robot.name.clone(),
            model: robot.model.clone(),
            base_limits: robot.base_limits(),
            start_from_room: start_from_room(&world_spec.robots, index),
        };
        let world_from_pelvis = isometry_from_sim(&present.robots[index].estimate.world_from_pelvis);
        Motion::new(sheet, &body, &world.rest_command(index), world_from_pelvis)
    };
    let motions = world.robots().iter().enumerate().map(motion).collect();
    Ok(Built { world, motions, robot: spec.robot.identity(), locomotion: locomotion.name() })
}

/// Returns the pose of the first robot's start frame in the start frame of robot number `index`.
fn start_from_room(robots: &[RobotPlacement], index: usize) -> Isometry3<f64> {
    let start = |robot: &RobotPlacement| {
        let [x_m, y_m] = robot.position_m;
        isometry_from_sim(&Pose::from_parts(
            Vector::new(x_m, y_m, 0.0),
            Rotation::from_rotation_z(robot.yaw_rad),
        ))
    };
    start(&robots[index]).inv_mul(&start(&robots[0]))
}

/// Returns the spec of the episode's world.
fn world_spec(spec: &EpisodeSpec) -> Result<WorldSpec, EpisodeError> {
    let own = own_spec(&spec.task, spec.world_seed(), spec.spread());
    match &spec.scene {
        None => Ok(own),
        Some(file) => Ok(elsewhere(own, &spec.task, &file.path, file.load()?)?),
    }
}

/// Adds the distractors of the stress. Their places depend on the places of all other objects.
fn add_distractors(
    spec: &EpisodeSpec,
    world_spec: &mut WorldSpec,
    model: &Arc<RobotModel>,
) -> Result<(), SimError> {
    let most = spec.stress.map_or(0, |stress| stress.distractors());
    if most > 0 {
        let world = World::with_robot(world_spec, model.clone())?;
        world_spec.objects.extend(stress::distractors(most, spec.world_seed(), &spec.task, &world)?);
    }
    Ok(())
}

fn own_spec(task: &Task, seed: u32, spread: Spread) -> WorldSpec {
    let robots = task.robots.iter().map(|robot| RobotPlacement {
        name: robot.name.into(),
        position_m: robot.position_m,
        yaw_rad: robot.yaw_rad,
    });
    let objects = task.objects.iter().zip(task.start_poses(seed, spread)).filter(|(spot, _)| {
        // Bodies of the scene are there already, and some are moved.
        !spot.is_of_scene() || task.randomize.iter().any(|offset| offset.objects.contains(&spot.name))
    });
    let objects = objects.map(|(spot, start)| {
        let yaw = Rotation::from_rotation_z(start.yaw_rad);
        let rotation = if spot.is_of_scene() { yaw * spot.turn } else { yaw };
        ObjectPlacement {
            name: spot.name.clone(),
            file: spot.source.clone(),
            world_from_object: Pose::from_parts(start.position_m.into(), rotation),
        }
    });
    let scene = match &task.scene_document {
        None => task.scene.as_str().into(),
        Some(document) => SceneSource::Read { document: document.clone(), world_from_scene: Pose::IDENTITY },
    };
    WorldSpec { scene, robots: robots.collect(), objects: objects.collect() }
}

/// Places a task in another scene. The scene is moved so that its site `task` is at the origin; tasks and
/// experts keep their coordinates.
fn elsewhere(
    mut spec: WorldSpec,
    task: &Task,
    path: &Path,
    mut document: Document,
) -> Result<WorldSpec, SceneError> {
    if let Some(spot) = task.objects.iter().find(|spot| spot.is_of_scene()) {
        let (path, task, name) = (path.into(), task.id.clone(), spot.name.clone());
        return Err(SceneError::OwnScene { path, task, name });
    }
    let sites = document.room_sites()?;
    let find = |name: &str| sites.iter().find(|site| site.name == name);
    let Some(origin) = find(TASK_SITE) else {
        let robots = task.robot_names().map(robot_site);
        let may = robots.chain(task.objects.iter().map(|spot| spot.name.clone())).collect();
        let have: Vec<&str> = sites.iter().map(|site| site.name.as_str()).collect();
        return Err(SceneError::NoPlace {
            path: path.into(),
            task: task.id.clone(),
            may,
            have: have.join(", "),
        });
    };
    let world_from_scene = upright(path, origin)?.inverse();
    for robot in &mut spec.robots {
        if let Some(site) = find(&robot_site(&robot.name)) {
            let at = world_from_scene * upright(path, site)?;
            robot.position_m = [at.translation.x, at.translation.y];
            robot.yaw_rad = heading_rad(&at);
        }
    }
    for (object, spot) in spec.objects.iter_mut().zip(&task.objects) {
        if let Some(site) = find(&spot.name) {
            // The seed's offset is kept.
            let spot_m = Vector::from(spot.position_m);
            let by_m = object.world_from_object.translation - spot_m;
            let turned = Rotation::from_rotation_z(heading_rad(&object.world_from_object) - spot.yaw_rad);
            let at = world_from_scene * upright(path, site)?;
            object.world_from_object = Pose::from_parts(at.translation + by_m, at.rotation * turned);
        }
    }
    if document.cameras.iter().all(|camera| camera.name != THIRD_PERSON) {
        let own = match &task.scene_document {
            None => Document::parse(&task.scene, assets::scene(&task.scene)?)?.into(),
            Some(document) => document.clone(),
        };
        let seen = own.cameras.iter().filter(|camera| camera.name == THIRD_PERSON);
        document.cameras.extend(seen.map(|camera| camera.moved(&world_from_scene.inverse())));
    }
    spec.scene = SceneSource::Read { document: Arc::new(document), world_from_scene };
    Ok(spec)
}

fn robot_site(name: &str) -> String {
    format!("robot_{name}")
}

fn upright(path: &Path, site: &Site) -> Result<Pose, SceneError> {
    let pose = site.body_from_site;
    let tilt_rad = (pose.rotation * Vector::Z).angle_between(Vector::Z);
    if tilt_rad > LEVEL_RAD {
        let (path, site) = (path.into(), site.name.clone());
        return Err(SceneError::Tilted { path, site, tilt_deg: tilt_rad.to_degrees() });
    }
    Ok(Pose::from_parts(pose.translation, Rotation::from_rotation_z(heading_rad(&pose))))
}
