//! The visible content of a world: meshes and colours, their poses after a step, and the cameras.

pub mod bend;
pub mod camera;
pub mod faces;
mod hidden;
pub mod lens;
pub mod mesh;
pub mod patches;
pub mod prepared;
pub mod shared;
mod smooth;
mod visible;

use std::sync::Arc;

use rapier3d::math::{Pose, Vector};

use crate::mjcf::{FileLight, Geom, Gloss, Headlight, Primitive, SurfaceImage, Texture};
use crate::render::shading::{MAX_CLEAR_ALPHA, SOLID_ALPHA};
use crate::render::{Light, Pattern, SharedMesh};
use crate::world::{CarriedLight, SceneLights};
use crate::{Step, World};

/// Shapes and colours of a world, built once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scenery {
    pub parts: Vec<Part>,
    /// Radius around [`PlacedScenery::focus_m`] within which shadows are drawn: the smaller, the sharper.
    pub focus_radius_m: f32,
    pub light: Light,
    /// Lights of the scene's file, in place of sun and sky.
    pub lamps: Option<Lamps>,
    /// The empty room, from which its baked light is computed; `None` with `lamps`.
    pub room: Option<Arc<Scenery>>,
    /// Background image around the camera: a single image, or the six of a cube.
    pub sky: Option<Arc<Texture>>,
}

/// One mesh that moves with its carrier.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    pub mesh: SharedMesh,
    pub carrier: Carrier,
    pub carrier_from_mesh: Pose,
    /// Colour in sRGB, 0 to 1. With an image it is the image's mean colour.
    pub rgb: [f32; 3],
    /// Share of light from behind that the surface blocks; below `SOLID_ALPHA` the part is blended.
    pub alpha: f32,
    pub gloss: Gloss,
    /// Image on the surface, in place of a pattern.
    pub image: Option<SurfaceImage>,
    pub pattern: Pattern,
    /// Id in [`crate::render::Frame::ids`], shared by all parts of a body. 0 is the background.
    pub id: u32,
    pub casts_shadow: bool,
}

/// The lights of a scenery in place of its sun and sky.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamps {
    pub headlight: Headlight,
    pub lamps: Vec<Lamp>,
}

/// A light with its carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    pub carrier: Carrier,
    /// The light in the frame of its carrier.
    pub light: FileLight,
}

/// Carrier of a part, by its index in a [`Step`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// The fixed room; its frame is the world's.
    Room,
    Link {
        robot: usize,
        link: usize,
    },
    Object(usize),
}

impl Carrier {
    /// Returns the pose of the carrier after `step`, which must be a step of its world.
    pub fn world_from_carrier(self, step: &Step) -> Pose {
        match self {
            Carrier::Room => Pose::IDENTITY,
            Carrier::Link { robot, link } => step.robots[robot].truth.world_from_link[link],
            Carrier::Object(object) => step.objects[object].state.world_from_object,
        }
    }
}

/// Poses of all parts of a scenery after a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlacedScenery {
    /// Pose of each part.
    pub world_from_mesh: Vec<Pose>,
    /// The point between the robots, around which shadows have to be sharp. It moves in steps, so that
    /// the room's shadows are seldom redrawn.
    pub focus_m: Vector,
    /// Lights of the scene's file, in the world.
    pub lights: Vec<FileLight>,
}

/// Ids: 0 the background, 1 the room, then robots, then objects.
const ROOM_ID: u32 = 1;
/// Focus of the shadows around the middle between the robots: it covers counter, objects and all hands.
const FOCUS_HEIGHT_M: f32 = 0.8;
const FOCUS_STEP_M: f32 = 0.1;
const FOCUS_RADIUS_M: f32 = 1.25;
/// Focus radius for the lights of a file, whose scenes are seen as a whole.
const LAMPS_FOCUS_RADIUS_M: f32 = 2.5;
/// Height of the lamps that the light represents. Walls and other parts of the room that reach higher cast no
/// shadow into the room.
const LAMPS_M: f32 = 2.2;
/// The accent of each robot, in place of the material `accent` of the robot's file.
const ACCENTS: [[f32; 4]; 3] = [[0.12, 0.35, 0.85, 1.0], [0.95, 0.48, 0.08, 1.0], [0.15, 0.62, 0.28, 1.0]];
const ACCENT_MATERIAL: &str = "accent";

impl Lamps {
    /// Multiplies the colours of all lights.
    pub fn tint(&mut self, tint_rgb: Vector) {
        let Headlight { ambient_rgb, diffuse_rgb, specular_rgb } = &mut self.headlight;
        for rgb in [ambient_rgb, diffuse_rgb, specular_rgb] {
            *rgb *= tint_rgb;
        }
        for Lamp { light, .. } in &mut self.lamps {
            let FileLight { ambient_rgb, diffuse_rgb, specular_rgb, .. } = light;
            for rgb in [ambient_rgb, diffuse_rgb, specular_rgb] {
                *rgb *= tint_rgb;
            }
        }
    }
}

impl Part {
    /// Returns true if surfaces behind the part show through.
    pub fn is_veil(&self) -> bool {
        self.alpha < SOLID_ALPHA || self.is_cut_out()
    }

    /// Returns true if the alpha of the part's image cuts holes into it.
    pub fn is_cut_out(&self) -> bool {
        self.alpha >= SOLID_ALPHA && self.image.as_ref().is_some_and(|image| image.texture.has_alpha)
    }
}

impl Scenery {
    /// Collects all visible parts of `world`.
    pub fn of(world: &World) -> Scenery {
        let mut parts = Vec::new();
        add_parts(&mut parts, world.room(), Carrier::Room, ROOM_ID, |geom| geom.rgba);
        let room = || Arc::new(Scenery { parts: parts.clone(), ..Scenery::default() });
        let room = world.lights().is_none().then(room);
        if world.lights().is_none() {
            for part in &mut parts {
                part.casts_shadow &= top_m(part) < LAMPS_M;
            }
        }
        let first_robot = ROOM_ID + 1;
        for (robot, id) in (0..world.robots().len()).zip(first_robot..) {
            for (link, model) in world.robots()[robot].model.links.iter().enumerate() {
                let carrier = Carrier::Link { robot, link };
                add_parts(&mut parts, &model.geoms, carrier, id, |geom| robot_rgba(geom, robot));
            }
        }
        for (object, (_, model)) in world.object_models().enumerate() {
            let id = object_id(world, object);
            add_parts(&mut parts, &model.geoms, Carrier::Object(object), id, |geom| geom.rgba);
        }
        let lamps = world.lights().map(lamps);
        let focus_radius_m = if lamps.is_some() { LAMPS_FOCUS_RADIUS_M } else { FOCUS_RADIUS_M };
        // As in MuJoCo, a scene with lights and without a sky has no background.
        let dark = || lamps.is_some().then(|| Arc::new(Texture::plain([0; 3])));
        let sky = world.sky().cloned().or_else(dark);
        Scenery { parts, focus_radius_m, light: Light::default(), lamps, room, sky }
    }

    /// Returns the poses of all parts after `step`, which must be a step of this scenery's world.
    pub fn place(&self, step: &Step) -> PlacedScenery {
        let mut middle_m = Vector::ZERO;
        for robot in &step.robots {
            middle_m += robot.truth.world_from_pelvis().translation / step.robots.len() as f32;
        }
        let world_from_mesh =
            self.parts.iter().map(|part| part.carrier.world_from_carrier(step) * part.carrier_from_mesh);
        let lamps = self.lamps.iter().flat_map(|lamps| &lamps.lamps);
        PlacedScenery {
            lights: lamps.map(|lamp| lamp.light.moved(&lamp.carrier.world_from_carrier(step))).collect(),
            world_from_mesh: world_from_mesh.collect(),
            focus_m: (Vector::new(middle_m.x, middle_m.y, FOCUS_HEIGHT_M) / FOCUS_STEP_M).round()
                * FOCUS_STEP_M,
        }
    }
}

/// Returns the id of object number `object` of a world in [`crate::render::Frame::ids`].
pub fn object_id(world: &World, object: usize) -> u32 {
    ROOM_ID + 1 + (world.robots().len() + object) as u32
}

/// Returns the colour of a geom of robot number `robot`. Robots differ only in their accents, which
/// distinguish partners.
pub fn robot_rgba(geom: &Geom, robot: usize) -> [f32; 4] {
    match geom.material.as_deref() {
        Some(ACCENT_MATERIAL) => ACCENTS[robot % ACCENTS.len()],
        _ => geom.rgba,
    }
}

/// Adds the visible geoms of a carrier.
fn add_parts(
    parts: &mut Vec<Part>,
    geoms: &[Geom],
    carrier: Carrier,
    id: u32,
    rgba: impl Fn(&Geom) -> [f32; 4],
) {
    let drawn: Vec<&Geom> = geoms.iter().filter(|geom| geom.drawn).collect();
    let meshes = visible::meshes(&drawn).into_iter().zip(drawn);
    parts.extend(meshes.filter_map(|(mesh, geom)| Some(part(geom, mesh?, carrier, rgba(geom), id))));
}

fn part(geom: &Geom, mesh: SharedMesh, carrier: Carrier, [r, g, b, alpha]: [f32; 4], id: u32) -> Part {
    Part {
        mesh,
        carrier,
        carrier_from_mesh: geom.body_from_geom,
        alpha,
        gloss: Gloss { reflectance_factor: reflectance_factor(geom, alpha), ..geom.gloss },
        image: geom.image.clone(),
        rgb: geom.checker_rgb.map_or([r, g, b], |[first, _]| first),
        pattern: match geom.checker_rgb {
            Some([_, second]) => Pattern::Checker(second),
            None => Pattern::of(geom.pattern),
        },
        id,
        // Nothing is below a floor.
        casts_shadow: !matches!(geom.primitive, Primitive::Plane { .. }) && alpha > MAX_CLEAR_ALPHA,
    }
}

/// Returns the reflectance of a geom. As in MuJoCo, only solid planes and boxes mirror.
fn reflectance_factor(geom: &Geom, alpha: f32) -> f32 {
    let is_flat = matches!(geom.primitive, Primitive::Plane { .. } | Primitive::Box { .. });
    if is_flat && alpha >= SOLID_ALPHA { geom.gloss.reflectance_factor } else { 0.0 }
}

/// Returns the lights of a scene with their carriers.
fn lamps(SceneLights { headlight, lights }: &SceneLights) -> Lamps {
    let lamp = |CarriedLight { object, light }: &CarriedLight| Lamp {
        carrier: object.map_or(Carrier::Room, Carrier::Object),
        light: *light,
    };
    Lamps { headlight: *headlight, lamps: lights.iter().map(lamp).collect() }
}

/// Returns the height of the highest point of a part of the room.
fn top_m(part: &Part) -> f32 {
    let heights_m = part.mesh.vertices.iter().map(|vertex| (part.carrier_from_mesh * vertex.position_m).z);
    heights_m.fold(0.0, f32::max)
}
