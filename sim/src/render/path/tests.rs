//! Path tracing: the same bits on any number of threads, the same depth and ids as the embedded renderer's,
//! light that bounces, and little noise.

use rapier3d::math::{Pose, Vector};

use super::scene::Coat;
use super::sequence::{PixelSeed, SampleCount};
use super::view::PathView;
use super::*;
use crate::render::made::{bottle, cuboid, world};
use crate::render::shading::SKY;
use crate::render::{Cameras, Light, cpu};
use crate::{Step, World};

const DEPTH_TOLERANCE_M: f32 = 1e-4;
/// Maximum share of pixels whose id may differ from the embedded renderer's.
const STRAY_IDS: f64 = 0.002;
/// Maximum relative difference of mean brightness from the embedded renderer's.
const BRIGHTNESS_SHARE: f64 = 0.1;
const MIN_PSNR_DB: f64 = 32.0;
/// Paths per pixel of the reference, and the distance between the rows of pixels that it covers.
const REFERENCE_PATHS: u32 = 512;
const REFERENCE_ROWS: usize = 27;

/// Returns every camera of the world, at a size that is quick to draw.
fn views(world: &World, step: &Step) -> Vec<Camera> {
    let cameras = Cameras::of(world);
    let views = [cameras.egocentric(step, 0), cameras.egocentric(step, 1), cameras.third_person()];
    views.map(|camera| Camera { width: 96, height: 72, ..camera }).to_vec()
}

#[test]
fn an_image_is_the_same_on_any_number_of_threads() {
    let world = world("kitchen_084", vec![bottle()]);
    let step = world.present();
    let renderer = PathRenderer::new(Prepared::new(Scenery::of(&world)));
    let scene = renderer.scene(&renderer.prepared.scenery.place(&step));
    for camera in views(&world, &step) {
        let alone = renderer.draw(&scene, &camera, 1);
        assert!([2, 5].iter().all(|threads| renderer.draw(&scene, &camera, *threads) == alone));
        let mut another = PathRenderer::new(Prepared::new(Scenery::of(&world)));
        assert!(another.render_colours(&step, &camera) == alone.rgb, "another renderer of the same scenery");
    }
}

#[test]
fn depth_and_ids_are_those_of_the_embedded_renderer() {
    let mut world = world("kitchen_084", vec![bottle()]);
    let (mut path, mut embedded) =
        (PathRenderer::new(Prepared::new(Scenery::of(&world))), cpu(Scenery::of(&world)));
    let commands = [world.rest_command(0), world.rest_command(1)];
    // The images are drawn twice, to verify that moved parts are at their new poses.
    for _ in 0..2 {
        let step =
            (0..25).map(|_| world.control_step(&commands).expect("it stays finite")).last().expect("one");
        for camera in views(&world, &step) {
            let (traced, expected) = (path.render(&step, &camera), embedded.render(&step, &camera));
            let stray = traced.ids.iter().zip(&expected.ids).filter(|(a, b)| a != b).count();
            assert!(stray as f64 <= STRAY_IDS * expected.ids.len() as f64, "{stray} other ids");
            let pairs = traced.depth_m.iter().zip(&expected.depth_m);
            let mut differences_m: Vec<f32> =
                pairs.map(|(a, b)| if a == b { 0.0 } else { (a - b).abs() }).collect();
            differences_m.sort_by(f32::total_cmp);
            let p99_m = differences_m[differences_m.len() * 99 / 100];
            assert!(p99_m <= DEPTH_TOLERANCE_M, "depths differ by {p99_m} m");
        }
    }
}

#[test]
fn images_are_as_bright_as_those_of_the_embedded_renderer() {
    for scene in ["kitchen_084", "gallery_136", "grocery_102", "home_098", "office_115", "floor"] {
        let world = world(scene, vec![bottle()]);
        let step = world.present();
        let camera = &views(&world, &step)[0];
        let traced = crate::render::path(Scenery::of(&world)).render(&step, camera);
        let expected = cpu(Scenery::of(&world)).render(&step, camera);
        let mean = |frame: &Frame| frame.rgb.iter().map(|value| f64::from(*value)).sum::<f64>();
        let ratio = mean(&traced) / mean(&expected);
        assert!((ratio - 1.0).abs() < BRIGHTNESS_SHARE, "{scene}: {ratio:.3} times as bright");
    }
}

/// Returns a grey floor and a red wall on its far side, seen from above the floor.
fn red_wall() -> (Scenery, Camera) {
    let floor = cuboid(Vector::new(3.0, 3.0, 0.05), Vector::new(0.0, 0.0, -0.05), [0.6, 0.6, 0.6]);
    let wall = cuboid(Vector::new(0.05, 3.0, 1.2), Vector::new(1.5, 0.0, 1.2), [0.9, 0.1, 0.1]);
    // The light is white, so that all colour is from the wall, and faint, so that no tone is compressed.
    let faint_rgb = Vector::splat(0.4);
    let light = Light { sun_rgb: faint_rgb, below_rgb: faint_rgb, above_rgb: faint_rgb, ..Light::default() };
    let down = Pose::from_translation(Vector::new(0.0, 0.0, 2.0));
    let camera =
        Camera { world_from_camera: down, vertical_fov_rad: 1.1, width: 48, height: 32, blur_px: 0.0 };
    (Scenery { parts: vec![floor, wall], focus_radius_m: 1.25, light, ..Scenery::default() }, camera)
}

#[test]
fn a_red_wall_colours_the_floor_beside_it() {
    let step = world("floor", Vec::new()).present();
    let (scenery, camera) = red_wall();
    // Ratio of red to blue on the floor 11 cm from the wall, and on the floor far away.
    let beside_and_away = |frame: Frame| {
        let redness = |column: usize| {
            let floor = (10..22).map(|row| &frame.rgb[(row * 48 + column) * 3..][..3]);
            let [red, blue] = [0, 2].map(|axis| floor.clone().map(|rgb| f32::from(rgb[axis])).sum::<f32>());
            red / blue
        };
        [redness(41), redness(6)]
    };
    let [beside, away] =
        beside_and_away(PathRenderer::new(Prepared::new(scenery.clone())).render(&step, &camera));
    assert!(beside > 1.05 * away, "{beside} beside the wall, {away} away from it");
    let [beside, away] = beside_and_away(cpu(scenery).render(&step, &camera));
    assert!((beside - away).abs() < 0.01, "without light that bounces: {beside} and {away}");
}

/// Renders some rows of an unfiltered image, with many paths through random points of each pixel.
fn reference(view: &PathView, camera: &Camera, exposure_factor: f32) -> Vec<u8> {
    let width = camera.width as usize;
    let mut rgb = vec![0; camera.height as usize / REFERENCE_ROWS * width * 3];
    for_each_row(&mut rgb, width * 3, 2, |number, bytes| {
        let row = number * REFERENCE_ROWS;
        for (column, bytes) in bytes.chunks_exact_mut(3).enumerate() {
            let (mut lit_rgb, mut lit) = (Vector::ZERO, 0.0);
            let within = PixelSeed::of([column as u32, row as u32]);
            for sample in 0..REFERENCE_PATHS {
                let [u, v] = within.spread(9, sample, SampleCount(REFERENCE_PATHS));
                let Some((_, spot)) = view.spot([column as f32 + u - 0.5, row as f32 + v - 0.5]) else {
                    continue;
                };
                let ray = (spot.point_m - view.eye_m()).normalize();
                let coat = Coat::of(&view.scene.gloss_and_emitted_rgb(&spot, 0.0).0);
                let seed = PixelSeed::of([column as u32 + 512 * sample, row as u32 + 64]);
                let [direct, indirect, coated] =
                    view.scene.lit_layers(&spot, coat, ray, seed, SampleCount(1));
                lit_rgb += view.scene.albedo(&spot, 0.0) * (direct + indirect) + coated;
                lit += 1.0;
            }
            let lit_share = lit / REFERENCE_PATHS as f32;
            let lit_rgb = develop::toned_rgb(lit_rgb * (exposure_factor / f32::max(lit, 1.0)));
            let mean_rgb = lit_rgb * lit_share + SKY * (1.0 - lit_share);
            SrgbTable::default().encode(&mean_rgb.to_array().map(|value| vec![value]), bytes);
        }
    });
    rgb
}

#[test]
fn few_paths_and_the_filter_come_close_to_many() {
    let world = world("kitchen_084", vec![bottle()]);
    let step = world.present();
    let renderer = PathRenderer::new(Prepared::new(Scenery::of(&world)));
    let scene = renderer.scene(&renderer.prepared.scenery.place(&step));
    let camera = Cameras::of(&world).egocentric(&step, 0);
    let view = PathView::new(&scene, &camera, SampleCount(1));
    let expected = reference(&view, &camera, renderer.negative(&scene, &camera, 2).exposure_factor);
    let drawn = renderer.draw(&scene, &camera, 2);
    let rows = drawn.rgb.chunks_exact(camera.width as usize * 3).step_by(REFERENCE_ROWS).flatten();
    let squares = rows.zip(&expected).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
    let psnr_db = 10.0 * (255.0 * 255.0 * expected.len() as f64 / squares.sum::<f64>()).log10();
    assert!(psnr_db >= MIN_PSNR_DB, "{psnr_db:.1} dB");
}
