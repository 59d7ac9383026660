//! The cameras of a world: one in each robot's head, one that sees all robots.

use rapier3d::math::{Pose, Vector};

use crate::mjcf::MjcfCamera;
use crate::render::Camera;
use crate::{Step, World};

/// Third-person view where a scene's file gives none: from the side, a little above.
const FALLBACK_EYE_M: Vector = Vector::new(0.4, -2.4, 1.6);
const FALLBACK_TARGET_M: Vector = Vector::new(0.4, 0.0, 0.8);
const THIRD_PERSON: &str = "third_person";

/// Cameras of one world, as its files describe them.
#[derive(Clone, Debug)]
pub struct Cameras {
    /// By robot.
    heads: Vec<MjcfCamera>,
    third_person: Camera,
}

impl Cameras {
    pub fn of(world: &World) -> Cameras {
        let third_person = match world.cameras().iter().find(|camera| camera.name == THIRD_PERSON) {
            Some(found) => camera(found, found.body_from_camera),
            None => Camera {
                world_from_camera: look_at(FALLBACK_EYE_M, FALLBACK_TARGET_M),
                vertical_fov_rad: 50f32.to_radians(),
                width: 640,
                height: 480,
            },
        };
        let heads = world.robots().iter().map(|robot| robot.model.egocentric.clone()).collect();
        Cameras { heads, third_person }
    }

    /// The camera in a robot's head, as `step` left it.
    pub fn egocentric(&self, step: &Step, robot: usize) -> Camera {
        let state = &step.robots[robot].state;
        camera(&self.heads[robot], state.world_from_pelvis * state.pelvis_from_camera)
    }

    /// The scene's camera that sees all robots.
    pub fn third_person(&self) -> Camera {
        self.third_person
    }
}

fn camera(source: &MjcfCamera, world_from_camera: Pose) -> Camera {
    let (width, height) = source.resolution_px;
    Camera { world_from_camera, vertical_fov_rad: source.vertical_fov_rad, width, height }
}

fn look_at(eye_m: Vector, target_m: Vector) -> Pose {
    Pose::look_at_rh(eye_m, target_m, Vector::Z).inverse()
}
