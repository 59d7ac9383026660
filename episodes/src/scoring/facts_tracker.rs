//! Tracker of an episode's facts, step by step, for scoring and experts.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tandem_sim::{ObjectFile, ObjectModel, Pose, RobotModel, SimError, Step};

use super::facts::{Facts, ObjectFacts, RobotFacts};
use super::grasps::ObjectGrasps;

/// Tracked state of every object, from the steps so far.
#[derive(Clone, Debug)]
pub struct FactsTracker {
    /// The model of each object from its file.
    models: Vec<Arc<ObjectModel>>,
    /// For each object, the name of the object that carries it; `None` if the world carries it.
    carriers: Vec<Option<String>>,
    robot: Arc<RobotModel>,
    memory: Vec<ObjectMemory>,
}

/// Memory of one object between control steps: its grasps, and its height at the start.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ObjectMemory {
    name: String,
    rest_height_m: f32,
    grasps: ObjectGrasps,
}

impl ObjectMemory {
    /// Returns the object's name.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl FactsTracker {
    /// Begins to track `objects`, given by name and file, their moving parts, and robots of a model.
    /// `start` is the state before the first control step.
    pub fn new<'a>(
        objects: impl Iterator<Item = (&'a str, ObjectFile)>,
        robot: &Arc<RobotModel>,
        start: &Step,
    ) -> Result<FactsTracker, SimError> {
        let mut tracker = FactsTracker {
            models: Vec::new(),
            carriers: Vec::new(),
            robot: robot.clone(),
            memory: Vec::new(),
        };
        for (name, file) in objects {
            for part in ObjectModel::parts(&file, name)? {
                let at_start = start.object(&part.name);
                tracker.memory.push(ObjectMemory {
                    rest_height_m: at_start.map_or(0.0, |state| state.world_from_object.translation.z),
                    grasps: ObjectGrasps::new(&part.name, start.robots.len()),
                    name: part.name,
                });
                tracker.models.push(part.model.into());
                tracker.carriers.push(part.carrier);
            }
        }
        Ok(tracker)
    }

    /// Updates the tracker with the control step that follows the last one.
    pub fn update(&mut self, step: &Step) {
        for object in &mut self.memory {
            object.grasps.update(step);
        }
    }

    /// Returns the facts after `step`, which must be the last one of an update.
    pub fn facts(&self, step: &Step) -> Facts {
        let robots = step.robots.iter().map(|robot| RobotFacts {
            model: self.robot.clone(),
            world_from_link: robot.truth.world_from_link.clone(),
            pelvis_in_world: robot.truth.world_from_pelvis(),
            wrist_in_pelvis: robot
                .truth
                .world_from_wrist
                .map(|wrist| robot.truth.world_from_pelvis().inverse() * wrist),
            hand_force_n: robot.hand_force_in_world_n(),
            fallen: robot.truth.fallen,
        });
        let objects = self.memory.iter().zip(&self.models).zip(&self.carriers);
        let objects = objects.filter_map(|((memory, model), carrier)| {
            let state = step.object(&memory.name)?;
            let carrier = match carrier {
                Some(carrier) => step.object(carrier).map(|carrier| carrier.world_from_object),
                None => Some(Pose::IDENTITY),
            };
            let opening = model.opening.as_ref().zip(carrier);
            Some(ObjectFacts {
                name: memory.name.clone(),
                model: model.clone(),
                pose_in_world: state.world_from_object,
                velocity_m_s: state.velocity_m_s,
                angular_velocity_rad_s: state.angular_velocity_rad_s,
                rest_height_m: memory.rest_height_m,
                hands: memory.grasps.grips(),
                untouched_s: memory.grasps.untouched_s(),
                opened_value: opening
                    .map(|(opening, carrier)| opening.opened(&carrier, &state.world_from_object)),
            })
        });
        Facts { time_s: step.time_s, robots: robots.collect(), objects: objects.collect() }
    }

    pub fn memory(&self) -> &[ObjectMemory] {
        &self.memory
    }

    /// Returns `true` if a memory belongs to the same objects and the same number of robots.
    pub fn fits(&self, memory: &[ObjectMemory]) -> bool {
        let is_same = |(own, other): (&ObjectMemory, &ObjectMemory)| {
            own.name == other.name && own.grasps.is_alike(&other.grasps)
        };
        self.memory.len() == memory.len() && self.memory.iter().zip(memory).all(is_same)
    }

    /// Restores an earlier [`FactsTracker::memory`] of the same objects.
    pub fn set_memory(&mut self, memory: Vec<ObjectMemory>) {
        self.memory = memory;
    }
}
