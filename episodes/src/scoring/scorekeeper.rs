//! Watches an episode step by step, and says what scoring and experts may know of it.

use serde::{Deserialize, Serialize};
use tandem_sim::Step;

use super::facts::{Facts, ObjectFacts, RobotFacts};
use super::grasps::ObjectGrasps;

/// What has to be remembered between control steps: grasps, and where objects began.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Scorekeeper {
    objects: Vec<Watched>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Watched {
    name: String,
    rest_height_m: f32,
    grasps: ObjectGrasps,
}

impl Scorekeeper {
    /// Begins to watch the objects called `names`, with the state before the first control step.
    pub fn new<'a>(names: impl Iterator<Item = &'a str>, start: &Step) -> Scorekeeper {
        let objects = names.map(|name| Watched {
            name: name.into(),
            rest_height_m: start.object(name).map_or(0.0, |state| state.world_from_object.translation.z),
            grasps: ObjectGrasps::new(name, start.robots.len()),
        });
        Scorekeeper { objects: objects.collect() }
    }

    /// Looks at the control step that follows the last one.
    pub fn update(&mut self, step: &Step) {
        for object in &mut self.objects {
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
        let objects = self.objects.iter().filter_map(|watched| {
            let state = step.object(&watched.name)?;
            Some(ObjectFacts {
                name: watched.name.clone(),
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
}
