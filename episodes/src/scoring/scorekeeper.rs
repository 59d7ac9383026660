//! Watches an episode step by step, and says what scoring and experts may know of it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tandem_sim::{ObjectModel, SimError, Step};

use super::facts::{Facts, ObjectFacts, RobotFacts};
use super::grasps::ObjectGrasps;

/// The objects that are watched.
#[derive(Clone, Debug)]
pub struct Scorekeeper {
    /// Of each object, as its file has it.
    models: Vec<Arc<ObjectModel>>,
    watched: Vec<Watched>,
}

/// What has to be remembered of one object between control steps: grasps, and where it began.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Watched {
    name: String,
    rest_height_m: f32,
    grasps: ObjectGrasps,
}

impl Scorekeeper {
    /// Begins to watch `objects`, given by name and file, and what moves on them, with the state before the first control step.
    pub fn new<'a>(
        objects: impl Iterator<Item = (&'a str, &'a str)>,
        start: &Step,
    ) -> Result<Scorekeeper, SimError> {
        let mut keeper = Scorekeeper { models: Vec::new(), watched: Vec::new() };
        for (name, file) in objects {
            for part in ObjectModel::parts(file, name)? {
                let at_start = start.object(&part.name);
                keeper.watched.push(Watched {
                    rest_height_m: at_start.map_or(0.0, |state| state.world_from_object.translation.z),
                    grasps: ObjectGrasps::new(&part.name, start.robots.len()),
                    name: part.name,
                });
                keeper.models.push(part.model.into());
            }
        }
        Ok(keeper)
    }

    /// Looks at the control step that follows the last one.
    pub fn update(&mut self, step: &Step) {
        for object in &mut self.watched {
            object.grasps.update(step);
        }
    }

    /// The facts after `step`, the last one that was looked at.
    pub fn facts(&self, step: &Step) -> Facts {
        let robots = step.robots.iter().map(|robot| RobotFacts {
            pelvis_in_world: robot.state.world_from_pelvis,
            wrist_in_pelvis: robot.state.pelvis_from_wrist,
            hand_force_n: robot.state.hand_force_n,
            fallen: robot.state.fallen,
        });
        let objects = self.watched.iter().zip(&self.models).filter_map(|(watched, model)| {
            let state = step.object(&watched.name)?;
            Some(ObjectFacts {
                name: watched.name.clone(),
                model: model.clone(),
                pose_in_world: state.world_from_object,
                velocity_m_s: state.velocity_m_s,
                angular_velocity_rad_s: state.angular_velocity_rad_s,
                rest_height_m: watched.rest_height_m,
                hands: watched.grasps.grips(),
                untouched_s: watched.grasps.untouched_s(),
            })
        });
        Facts { time_s: step.time_s, robots: robots.collect(), objects: objects.collect() }
    }

    pub fn watched(&self) -> &[Watched] {
        &self.watched
    }

    /// Goes back to an earlier [`Scorekeeper::watched`] of the same objects.
    pub fn set_watched(&mut self, watched: Vec<Watched>) {
        self.watched = watched;
    }
}
