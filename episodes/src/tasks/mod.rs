//! Tasks as data: where things stand, what varies with the seed, what is asked, and the phases that score it.
//!
//! To add a task: one file here and its line in [`ALL`].

mod big_table;
mod cart_service;
mod co_carry;
mod co_pouring;
mod frame_hang;
mod handover;
mod move_house;
mod pouring;
mod randomize;
mod table_align;
mod trash_collection;

pub use randomize::{Offset, Spread, StartPose, uniform_xy};

use std::sync::Arc;

use tandem_sim::{RobotModel, SimError, Step};

use crate::EpisodeError;
use crate::scoring::{Phase, Scores};

/// Every task, in the benchmark's order.
pub static ALL: &[Task] = &[
    handover::TASK,
    pouring::TASK,
    frame_hang::TASK,
    co_pouring::TASK,
    trash_collection::TASK,
    cart_service::TASK,
    co_carry::TASK,
    table_align::TASK,
    move_house::TASK,
    big_table::TASK,
];

/// One benchmark task.
#[derive(Debug)]
pub struct Task {
    pub id: &'static str,
    /// File name of the scene under `sim/assets/scenes`.
    pub scene: &'static str,
    pub robots: &'static [RobotSpot],
    pub objects: &'static [ObjectSpot],
    /// What the seed moves, in the order in which it is drawn.
    pub randomize: &'static [Offset],
    /// What has to be done, for a policy that directs all robots.
    pub instruction: &'static str,
    /// Control steps of an episode under the benchmark protocol.
    pub benchmark_steps: u32,
    /// p1, p2, ... in the order they have to be reached.
    pub phases: &'static [Phase],
}

/// Where a robot stands, and its part of the task.
#[derive(Debug)]
pub struct RobotSpot {
    pub name: &'static str,
    pub position_m: [f32; 2],
    /// Which way it faces; 0 is along world x.
    pub yaw_rad: f32,
    /// What has to be done, for a policy that directs this robot alone.
    pub instruction: &'static str,
}

/// Where an object rests before the seed moves it.
#[derive(Debug)]
pub struct ObjectSpot {
    pub name: &'static str,
    /// File name under `sim/assets/objects`.
    pub file: &'static str,
    pub position_m: [f32; 3],
    pub yaw_rad: f32,
}

/// An object called as its file, not turned.
pub const fn spot(name: &'static str, position_m: [f32; 3]) -> ObjectSpot {
    ObjectSpot { name, file: name, position_m, yaw_rad: 0.0 }
}

impl Task {
    /// Begins to score an episode of this task with robots of this model, with the state before the first control step.
    pub fn scores(&self, robot: &Arc<RobotModel>, start: &Step) -> Result<Scores, SimError> {
        Scores::new(self.phases, self.objects.iter().map(|spot| (spot.name, spot.file)), robot, start)
    }

    /// Names of the robots, in their order.
    pub fn robot_names(&self) -> impl Iterator<Item = &'static str> {
        self.robots.iter().map(|robot| robot.name)
    }
}

/// There is one task of each id.
impl PartialEq for Task {
    fn eq(&self, other: &Task) -> bool {
        self.id == other.id
    }
}

/// A task written as its id, for `#[serde(with)]`.
pub mod by_id {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    use super::Task;

    pub fn serialize<S: Serializer>(task: &Task, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(task.id)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static Task, D::Error> {
        super::find(&String::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

/// The task called `id`.
pub fn find(id: &str) -> Result<&'static Task, EpisodeError> {
    ALL.iter().find(|task| task.id == id).ok_or_else(|| {
        let have = ALL.iter().map(|task| task.id).collect();
        EpisodeError::UnknownTask { id: id.into(), have }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_is_complete() {
        for task in ALL {
            assert!(find(task.id).is_ok_and(|found| found.id == task.id));
            let names: Vec<&str> = task.robots.iter().map(|robot| robot.name).collect();
            assert_eq!(names, &["A", "B", "C"][..names.len()], "{}", task.id);
            assert_eq!(task.phases.len(), 3, "{}", task.id);
            for offset in task.randomize {
                let known = |name: &&str| task.objects.iter().any(|spot| spot.name == *name);
                assert!(offset.objects.iter().all(known), "{} moves {:?}", task.id, offset.objects);
            }
        }
    }

    #[test]
    fn an_unknown_task_lists_those_there_are() {
        let text = find("handove").unwrap_err().to_string();
        assert!(text.starts_with("no task \"handove\"; have: handover"), "{text}");
    }
}
