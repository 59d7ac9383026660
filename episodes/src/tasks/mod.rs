//! Tasks as data: where things stand, what varies with the seed, what is asked, and the phases that score it.
//!
//! To add a task: one file here and its line in [`ALL`].

mod handover;
pub mod placement;
mod randomize;

pub use randomize::{Offset, uniform_xy};

use crate::{EpisodeError, facts::Facts};

/// Every task, in the benchmark's order.
pub static ALL: &[Task] = &[handover::TASK];

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
    /// For a policy that directs this robot alone.
    pub instruction: &'static str,
}

/// Where an object rests before the seed moves it.
#[derive(Debug)]
pub struct ObjectSpot {
    /// File name of the object under `sim/assets/objects`.
    pub name: &'static str,
    pub position_m: [f32; 3],
    pub yaw_rad: f32,
}

/// One scored phase.
#[derive(Debug)]
pub struct Phase {
    pub id: &'static str,
    /// When the phase counts as reached, for people and policies.
    pub description: &'static str,
    /// Whether more than one robot has to work on it.
    pub collaborative: bool,
    pub done: Done,
}

/// When a phase is reached. Conditions see one control step at a time; what has to happen in sequence says so here.
#[derive(Debug)]
pub enum Done {
    /// As soon as the condition holds.
    When(fn(&Facts) -> bool),
    /// When `then` holds after `first` held; a step at which `broken` holds in between asks for `first` again.
    Sequence { first: fn(&Facts) -> bool, then: fn(&Facts) -> bool, broken: fn(&Facts) -> bool },
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
                let known = task.objects.iter().any(|spot| spot.name == offset.object);
                assert!(known, "{} moves {:?}", task.id, offset.object);
            }
        }
    }

    #[test]
    fn an_unknown_task_lists_those_there_are() {
        let text = find("handove").unwrap_err().to_string();
        assert!(text.starts_with("no task \"handove\"; have: handover"), "{text}");
    }
}
