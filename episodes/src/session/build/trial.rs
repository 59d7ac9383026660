//! The trial of a user's scene before an episode: a second with idle robots, in which robots and objects of
//! the task have to stay in place. A process tries equal starts once.

use std::sync::{Arc, Mutex, PoisonError};

use tandem_sim::{CONTROL_HZ, RobotModel, Step, Vector, World, WorldSpec};

use super::robot_site;
use crate::EpisodeError;
use crate::error::SceneError;
use crate::spec::{EpisodeSpec, RobotFile};
use crate::tasks::{SceneFile, Spread, Task};

/// Duration of a trial.
const TRIAL_STEPS: u32 = 50;
/// Maximum displacement of robots and objects at the end of a trial, and the displacement that ends a trial
/// at once.
const STAYS_M: f32 = 0.03;
const GONE_M: f32 = 0.1;
/// Maximum number of passed trials that a process remembers; the latest are kept.
const MAX_PASSED: usize = 64;

/// Everything on which the outcome of a trial depends.
#[derive(Clone, PartialEq)]
struct Tried {
    scene: SceneFile,
    robot: RobotFile,
    task: Task,
    world_seed: u32,
    spread: Spread,
    distractors: usize,
}

static PASSED: Mutex<Vec<Tried>> = Mutex::new(Vec::new());

/// Checks that a scene from a file has what the task needs, by a short trial with idle robots. A trial that
/// has passed is not repeated.
pub(super) fn try_scene(
    spec: &EpisodeSpec,
    world_spec: &WorldSpec,
    model: &Arc<RobotModel>,
) -> Result<(), EpisodeError> {
    let Some(scene) = &spec.scene else { return Ok(()) };
    let tried = Tried {
        scene: scene.clone(),
        robot: spec.robot.clone(),
        task: spec.task.clone(),
        world_seed: spec.world_seed(),
        spread: spec.spread(),
        distractors: spec.stress.map_or(0, |stress| stress.distractors()),
    };
    // Every call leaves the list consistent, so a poisoned lock is safe to use.
    let passed = || PASSED.lock().unwrap_or_else(PoisonError::into_inner);
    if passed().contains(&tried) {
        return Ok(());
    }
    run(scene, &spec.task, World::with_robot(world_spec, model.clone())?)?;
    let mut passed = passed();
    passed.insert(0, tried);
    passed.truncate(MAX_PASSED);
    Ok(())
}

fn run(file: &SceneFile, task: &Task, mut world: World) -> Result<(), SceneError> {
    let (path, task_id) = (file.path.clone(), task.id.clone());
    for spot in &task.objects {
        if world.object_models().filter(|(name, _)| *name == spot.name).count() > 1 {
            return Err(SceneError::SameName { path, task: task_id, name: spot.name.clone() });
        }
    }
    let commands: Vec<_> = (0..world.robots().len()).map(|robot| world.rest_command(robot)).collect();
    let start = places_m(&world.present(), task);
    for step in 1..=TRIAL_STEPS {
        let present = world.control_step(&commands).map_err(|source| SceneError::Diverged {
            path: path.clone(),
            trial_s: f64::from(TRIAL_STEPS) / CONTROL_HZ,
            source,
        })?;
        let most_m = if step == TRIAL_STEPS { STAYS_M } else { GONE_M };
        let end = places_m(&present, task);
        let moved = start.iter().zip(&end).map(|(start, end)| (start, (end.at_m - start.at_m).length()));
        if let Some((Place { name, site, at_m }, moved_m)) =
            moved.into_iter().find(|(_, moved_m)| *moved_m > most_m)
        {
            return Err(SceneError::Unsteady {
                path,
                task: task_id,
                name: name.clone(),
                site: site.clone(),
                at_m: at_m.to_array(),
                moved_m,
                trial_s: f64::from(step) / CONTROL_HZ,
            });
        }
    }
    Ok(())
}

/// Place of a robot or an object of the task.
#[derive(Clone)]
struct Place {
    /// Name in messages.
    name: String,
    /// Site of a scene that sets the place.
    site: String,
    at_m: Vector,
}

fn places_m(step: &Step, task: &Task) -> Vec<Place> {
    let robots = step.robots.iter().zip(task.robot_names()).map(|(robot, name)| Place {
        name: format!("robot {name}"),
        site: robot_site(name),
        at_m: robot.truth.world_from_pelvis().translation,
    });
    let objects = task.objects.iter().filter_map(|spot| {
        let at_m = step.object(&spot.name)?.world_from_object.translation;
        Some(Place { name: spot.name.clone(), site: spot.name.clone(), at_m })
    });
    robots.chain(objects).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tandem_tools_spec::Protocol;

    use super::*;
    use crate::session::build_world;
    use crate::tasks;

    /// Returns how often a start with this seed has passed its trial.
    fn passes(scene: &SceneFile, seed: u32) -> usize {
        let passed = PASSED.lock().unwrap_or_else(PoisonError::into_inner);
        passed.iter().filter(|tried| tried.scene == *scene && tried.world_seed == seed).count()
    }

    #[test]
    fn equal_starts_are_tried_once() {
        let kitchen = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes/kitchen/handover.xml");
        let scene = SceneFile::of(&kitchen).unwrap();
        let handover = tasks::find("handover").unwrap();
        let start = |seed: u32, protocol: Protocol| {
            let spec =
                EpisodeSpec { scene: Some(scene.clone()), ..EpisodeSpec::new(&handover, seed, protocol) };
            build_world(&spec).unwrap().world.state_hash()
        };
        let first = start(2000, Protocol::Benchmark);
        assert_eq!(passes(&scene, 2000), 1);
        assert_eq!(start(2000, Protocol::Benchmark), first, "the world does not depend on the trial");
        start(2000, Protocol::Agentic);
        assert_eq!(passes(&scene, 2000), 1, "the trial is not repeated");
        start(2001, Protocol::Benchmark);
        assert_eq!([2000, 2001].map(|seed| passes(&scene, seed)), [1, 1], "other places are tried");
    }
}
