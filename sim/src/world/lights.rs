//! Lights of the scene's file in a world.

use rapier3d::math::Pose;

use crate::SimError;
use crate::dynamics::rounded;
use crate::mjcf::{Document, FileLight, Headlight};

/// The lights of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneLights {
    pub headlight: Headlight,
    pub lights: Vec<CarriedLight>,
}

/// A light with its carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarriedLight {
    /// Index of the object that carries it; `None` for a light fixed in the room.
    pub object: Option<usize>,
    /// The light in the frame of the object, or of the world.
    pub light: FileLight,
}

/// Returns the lights of a scene with its origin at `world_from_scene`; `None` if its file states none.
pub(super) fn scene_lights(
    scene: &Document,
    world_from_scene: &Pose,
) -> Result<Option<SceneLights>, SimError> {
    let Some(file) = scene.lights() else { return Ok(None) };
    let mut lights = Vec::new();
    // Links of trees that move are the objects, in the same order.
    let mut objects = 0;
    for tree in scene.trees()? {
        for link in &tree.links {
            let object = (!tree.is_fixed()).then_some(objects);
            objects += usize::from(object.is_some());
            let world_from_link = *world_from_scene * rounded(&link.parent_from_link);
            for body in &link.bodies {
                let of_body = file.lights.iter().filter(|light| light.body == body.index);
                lights.extend(of_body.map(|light| {
                    let in_link = light.moved(&rounded(&body.link_from_body));
                    let light = if object.is_some() { in_link } else { in_link.moved(&world_from_link) };
                    CarriedLight { object, light }
                }));
            }
        }
    }
    Ok(Some(SceneLights { headlight: file.headlight, lights }))
}
