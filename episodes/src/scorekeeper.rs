//! Watches a world step by step, and says what scoring and experts may know of it.

use tandem_sim::World;

use crate::facts::{Facts, ObjectFacts, RobotFacts};
use crate::grasp::ObjectGrasps;
use crate::tasks::Task;

/// What has to be remembered between control steps: grasps, and where objects began.
#[derive(Clone)]
pub struct Scorekeeper {
    objects: Vec<Watched>,
}

#[derive(Clone)]
struct Watched {
    name: &'static str,
    rest_height_m: f32,
    grasps: ObjectGrasps,
}

impl Scorekeeper {
    /// Begins with a world that has not been stepped.
    pub fn new(task: &Task, world: &World) -> Scorekeeper {
        let objects = task.objects.iter().map(|spot| Watched {
            name: spot.name,
            rest_height_m: world
                .object(spot.name)
                .map_or(0.0, |object| object.world_from_object.translation.z),
            grasps: ObjectGrasps::new(spot.name, world.robots().len()),
        });
        Scorekeeper { objects: objects.collect() }
    }

    /// Looks at the control step that `world` has just made.
    pub fn update(&mut self, world: &World) {
        for object in &mut self.objects {
            object.grasps.update(world);
        }
    }

    /// The facts after the last step.
    pub fn facts(&self, world: &World) -> Facts {
        let robots = (0..world.robots().len()).map(|robot| {
            let state = world.robot_state(robot);
            RobotFacts {
                pelvis_in_world: state.world_from_pelvis,
                wrist_in_pelvis: state.pelvis_from_wrist,
                hand_force_n: state.hand_force_n,
                fallen: state.fallen,
            }
        });
        let objects = self.objects.iter().filter_map(|watched| {
            let state = world.object(watched.name)?;
            Some(ObjectFacts {
                name: watched.name.into(),
                pose_in_world: state.world_from_object,
                velocity_m_s: state.velocity_m_s,
                angular_velocity_rad_s: state.angular_velocity_rad_s,
                rest_height_m: watched.rest_height_m,
                hands: watched.grasps.grips(),
                untouched_s: watched.grasps.untouched_s(),
            })
        });
        Facts { time_s: world.time_s(), robots: robots.collect(), objects: objects.collect() }
    }
}
