//! Picture of a scene from four sides.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::Path;

use image::RgbImage;
use image::imageops;
use tandem_sim::mjcf::Document;
use tandem_sim::render::{Camera, RendererKind, Scenery, encode_png};
use tandem_sim::{Pose, Vector, World};

use super::{CELL_HEIGHT, CELL_WIDTH};
use crate::describe::{corners_m, extent_m};
use crate::error::EpisodeError;

/// Name of the picture beside an imported scene.
pub const SIDES_FILE: &str = "sides.png";

const VERTICAL_FOV_RAD: f32 = 0.8;
/// Cameras look down, so that walls do not hide the room behind them.
const DOWN_RAD: f32 = 0.65;
/// Distance of the camera at which a sphere around the scene just fits, as a multiple of its radius.
const DISTANCE_PER_RADIUS: f32 = 2.4;
const MIN_RADIUS_M: f32 = 0.05;

/// Draws a scene, as its file has it, from four sides into one PNG file.
///
/// # Errors
///
/// If the scene cannot be read or drawn. The error lists all refused parts of the file.
pub fn draw_sides(scene: &Path) -> Result<Vec<u8>, EpisodeError> {
    let world = World::of_scene(Document::read(scene)?)?;
    let (step, mut renderer) = (world.present(), RendererKind::Cpu.renderer(Scenery::of(&world)));
    let (middle_m, radius_m) = sphere(&world);
    let [width, height] = [CELL_WIDTH as u32, CELL_HEIGHT as u32];
    let mut all = RgbImage::new(2 * width, 2 * height);
    for side in 0..4_u32 {
        let yaw_rad = FRAC_PI_4 + FRAC_PI_2 * side as f32;
        let (sin, cos) = yaw_rad.sin_cos();
        let away = Vector::new(cos * DOWN_RAD.cos(), sin * DOWN_RAD.cos(), DOWN_RAD.sin());
        let eye_m = middle_m + away * (radius_m * DISTANCE_PER_RADIUS);
        let camera = Camera {
            world_from_camera: Pose::look_at_rh(eye_m, middle_m, Vector::Z).inverse(),
            vertical_fov_rad: VERTICAL_FOV_RAD,
            width,
            height,
            blur_px: 0.0,
        };
        let frame = renderer.render(&step, &camera);
        let image = RgbImage::from_raw(width, height, frame.rgb).expect("an image of this size");
        imageops::replace(&mut all, &image, (side % 2 * width).into(), (side / 2 * height).into());
    }
    Ok(encode_png(2 * width, 2 * height, all.as_raw())?)
}

/// Returns centre and radius of a sphere around all geoms except planes.
fn sphere(world: &World) -> (Vector, f32) {
    let of_room = world.room().iter().flat_map(|geom| corners_m(geom, &Pose::IDENTITY));
    let step = world.present();
    let of_objects = world.object_models().zip(&step.objects).flat_map(|((_, model), object)| {
        let geoms = model.geoms.iter();
        geoms.flat_map(|geom| corners_m(geom, &object.state.world_from_object)).collect::<Vec<_>>()
    });
    let [low_m, high_m] = extent_m(of_room.chain(of_objects), 0.0);
    match low_m.is_finite() {
        true => ((low_m + high_m) / 2.0, ((high_m - low_m).length() / 2.0).max(MIN_RADIUS_M)),
        false => (Vector::ZERO, 1.0),
    }
}
