//! The GPU renderer draws the same images as the embedded one. A software driver such as Mesa's is
//! sufficient; without any driver, these tests report that and pass.

use super::together::counts;
use crate::mjcf::Document;
use crate::render::made::{bottle, world};
use crate::render::{
    Camera, Cameras, Frame, RenderRequest, Renderer, RendererKind, Scenery, cpu, render_colours_together,
};
use crate::{Pose, Step, Vector, World};

#[path = "../../../../tests/src/skipped.rs"]
mod skipped;

use skipped::skipped;

const MIN_PSNR_DB: f64 = 40.0;
const DEPTH_TOLERANCE_M: f32 = 1e-4;
/// Maximum share of pixels that may have another id.
const STRAY_IDS: f64 = 0.002;

/// Returns a GPU renderer. Prints a message and returns `None` if the embedded renderer would draw instead.
fn gpu(scenery: Scenery) -> Option<Box<dyn Renderer>> {
    let renderer = RendererKind::Gpu.renderer(scenery);
    let found = renderer.name() != RendererKind::Cpu.name();
    if !found {
        skipped(&RendererKind::Gpu.describe().expect("this build has it"));
    }
    found.then_some(renderer)
}

fn kitchen() -> World {
    world("kitchen_084", vec![bottle()])
}

/// Returns every camera of the world, and one with an odd image size.
fn views(world: &World, step: &Step) -> Vec<Camera> {
    let cameras = Cameras::of(world);
    let heads = (0..world.robots().len()).map(|robot| cameras.egocentric(step, robot));
    let odd = Camera { width: 97, height: 61, ..cameras.third_person() };
    heads.chain([cameras.third_person(), odd]).collect()
}

/// Returns the peak signal-to-noise ratio.
fn psnr_db(a: &Frame, b: &Frame) -> f64 {
    let squares = a.rgb.iter().zip(&b.rgb).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
    10.0 * (255.0 * 255.0 * a.rgb.len() as f64 / squares.sum::<f64>()).log10()
}

/// Returns the depth difference that 99 of 100 pixels do not exceed.
fn depth_p99_m(a: &Frame, b: &Frame) -> f32 {
    let pairs = a.depth_m.iter().zip(&b.depth_m);
    let mut differences_m: Vec<f32> = pairs.map(|(a, b)| if a == b { 0.0 } else { (a - b).abs() }).collect();
    differences_m.sort_by(f32::total_cmp);
    differences_m[differences_m.len() * 99 / 100]
}

#[test]
fn both_renderers_draw_the_same() {
    let mut world = kitchen();
    let Some(mut gpu) = gpu(Scenery::of(&world)) else { return };
    let mut embedded = cpu(Scenery::of(&world));
    let commands: Vec<_> = (0..world.robots().len()).map(|robot| world.rest_command(robot)).collect();
    // The images are drawn twice, to verify that moved parts are at their new poses.
    for _ in 0..2 {
        let step =
            (0..25).map(|_| world.control_step(&commands).expect("it stays finite")).last().expect("one");
        for camera in views(&world, &step) {
            let (drawn, expected) = (gpu.render(&step, &camera), embedded.render(&step, &camera));
            let size = format!("{} x {}", camera.width, camera.height);
            let (psnr_db, depth_m) = (psnr_db(&drawn, &expected), depth_p99_m(&drawn, &expected));
            assert!(psnr_db >= MIN_PSNR_DB, "{size}: {psnr_db:.1} dB");
            assert!(depth_m <= DEPTH_TOLERANCE_M, "{size}: depths differ by {depth_m} m");
            let stray = drawn.ids.iter().zip(&expected.ids).filter(|(a, b)| a != b).count();
            assert!(stray as f64 <= STRAY_IDS * expected.ids.len() as f64, "{size}: {stray} other ids");
            assert!(drawn.rgb.iter().any(|value| *value > 128), "{size}: it is dark");
        }
    }
    assert_ne!(gpu.name(), embedded.name(), "the device did not fail");
}

/// A kitchen with images on meshes.
const KITCHEN: &str = concat!(env!("TANDEM_SIM_ASSETS"), "/../../episodes/tests/scenes/kitchen");
/// Shapes with the image of the kitchen's floor, mapped along z and on cubes.
const SHAPES: &str = r#"<asset>
        <texture name="flat" type="2d" file="kitchen_floor_floor_texture.png"/>
        <texture name="cube" type="cube" file="kitchen_floor_floor_texture.png"/>
        <material name="flat" texture="flat" texrepeat="3 5" rgba="0.5 1 1 1"/>
        <material name="cube" texture="cube" texuniform="true"/>
        <texture name="faces" type="cube" builtin="gradient" mark="edge" rgb1="1 0.5 0" width="64" height="64"/>
        <material name="faces" texture="faces"/>
    </asset>
    <worldbody>
        <geom type="plane" size="3 3 1" material="flat"/>
        <geom type="box" size="0.3 0.2 0.4" pos="2.2 1.4 0.4" euler="0 0 40" material="cube"/>
        <geom type="ellipsoid" size="0.3 0.4 0.5" pos="1.4 1.6 0.5" material="cube"/>
        <geom type="sphere" size="0.25" pos="2.3 2.1 1" material="faces"/>
    </worldbody>"#;

#[test]
fn images_on_surfaces_are_the_same() {
    let shapes = format!(r#"<mujoco><compiler texturedir="{KITCHEN}/meshes"/>{SHAPES}</mujoco>"#);
    let documents = [
        Document::read(format!("{KITCHEN}/scene.xml").as_ref()).expect("a scene"),
        Document::parse("shapes.xml", &shapes).expect("a scene"),
    ];
    let eye_m = Vector::new(0.6, 0.2, 1.5);
    let camera = Camera {
        world_from_camera: Pose::look_at_rh(eye_m, Vector::new(2.2, 1.7, 0.7), Vector::Z).inverse(),
        vertical_fov_rad: 0.9,
        width: 320,
        height: 240,
        blur_px: 0.0,
    };
    for document in documents {
        let world = World::of_scene(document).expect("a world");
        let scenery = Scenery::of(&world);
        assert!(scenery.parts.iter().any(|part| part.image.is_some()));
        let Some(mut gpu) = gpu(scenery) else { return };
        let expected = cpu(Scenery::of(&world)).render(&world.present(), &camera);
        let psnr_db = psnr_db(&gpu.render(&world.present(), &camera), &expected);
        assert!(psnr_db >= MIN_PSNR_DB, "{psnr_db:.1} dB");
        assert_ne!(gpu.name(), RendererKind::Cpu.name(), "the device did not fail");
    }
}

/// Lights of each kind with their shadows, blended surfaces in front of one another, and a sky.
const LIT: &str = r#"<asset>
        <texture type="skybox" builtin="gradient" rgb1="0.3 0.5 0.7" rgb2="0.9 0.8 0.6" width="64" height="384"/>
        <texture name="hole" type="2d" file="hole.png" nchannel="4"/>
        <material name="hole" texture="hole"/>
        <texture name="bumps" type="2d" file="bumps.png"/>
        <texture name="squares" type="2d" builtin="checker" rgb1="0.9 0.6 0.3" rgb2="0.3 0.3 0.9" width="8" height="8"/>
        <material name="worn" rgba="1 0.9 0.8 1" roughness="0.6" metallic="0.7">
            <layer role="rgb" texture="squares"/>
            <layer role="orm" texture="bumps"/>
            <layer role="normal" texture="bumps"/>
        </material>
        <material name="screen" rgba="0.4 0.3 0.3 1" emission="0.7">
            <layer role="emissive" texture="squares"/>
            <layer role="occlusion" texture="bumps"/>
        </material>
        <material name="shiny" rgba="0.7 0.2 0.2 1" specular="1" shininess="0.2" emission="0.1"/>
    </asset>
    <worldbody>
        <light directional="true" dir="0.3 0.2 -1" diffuse="0.4 0.4 0.3"/>
        <light pos="1.5 1.2 2.6" dir="0.2 0.2 -1" diffuse="0.6 0.5 0.5" cutoff="50" exponent="3"/>
        <light type="point" pos="3 0.5 1" diffuse="0.1 0.1 0.3" castshadow="false"/>
        <geom type="plane" size="4 4 1" rgba="0.8 0.8 0.7 1"/>
        <geom type="box" size="0.3 0.2 0.4" pos="2.4 1.9 0.4" euler="0 0 40" material="shiny"/>
        <geom type="sphere" size="0.25" pos="1.5 1.9 0.6" material="shiny"/>
        <geom type="box" size="0.5 0.02 0.5" pos="1.8 1.2 0.8" euler="0 0 20" rgba="0.2 0.4 0.9 0.3"/>
        <geom type="ellipsoid" size="0.2 0.3 0.4" pos="1.6 1.4 0.8" rgba="0.9 0.9 0.2 0.6"/>
        <geom type="plane" size="0.4 0.4 1" pos="2.3 1 0.7" euler="60 0 0" material="hole"/>
        <geom type="box" size="0.2 0.2 0.2" pos="2.9 1.3 0.2" euler="0 0 20" material="worn"/>
        <geom type="cylinder" size="0.2 0.3" pos="1.1 1.4 0.3" material="worn"/>
        <geom type="box" size="0.3 0.02 0.2" pos="2.6 2.2 1" euler="70 0 0" material="screen"/>
    </worldbody>"#;

#[test]
fn lights_of_files_blended_surfaces_and_skies_are_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    let hole = image::RgbaImage::from_fn(32, 32, |x, y| {
        image::Rgba([200, 120, 30, if x.abs_diff(16) + y.abs_diff(16) < 9 { 0 } else { 255 }])
    });
    hole.save(folder.path().join("hole.png")).expect("an image");
    let bumps = image::RgbImage::from_fn(32, 32, |x, y| {
        image::Rgb([100 + (x * 7 % 60) as u8, 100 + (y * 5 % 60) as u8, 225])
    });
    bumps.save(folder.path().join("bumps.png")).expect("an image");
    let unlit: String = LIT.lines().filter(|line| !line.contains("<light")).collect();
    let walls = r#"<geom type="box" size="0.1 4 1.2" pos="-2 0 1.2"/><geom type="box" size="0.1 4 1.2" pos="5 0 1.2"/></worldbody>"#;
    let indoors = unlit.replace("</worldbody>", walls);
    for (what, inside, lamps) in [("lights", LIT, 3), ("the sun", &unlit, 0), ("baked light", &indoors, 0)] {
        let file = folder.path().join("scene.xml");
        std::fs::write(&file, format!("<mujoco>{inside}</mujoco>")).expect("a scene");
        let world = World::of_scene(Document::read(&file).expect("a scene")).expect("a world");
        let scenery = Scenery::of(&world);
        let found = scenery.lamps.as_ref().map_or(0, |lamps| lamps.lamps.len());
        assert!(found == lamps && scenery.sky.is_some(), "{what}");
        draws_the_same(&world, scenery, what);
    }
}

/// Compares images of both renderers, if there is a GPU.
fn draws_the_same(world: &World, scenery: Scenery, what: &str) {
    let step = world.present();
    let Some(mut gpu) = gpu(scenery.clone()) else { return };
    let mut embedded = cpu(scenery);
    for eye_m in [Vector::new(0.3, -0.4, 1.3), Vector::new(3.6, 0.4, 1.6)] {
        let camera = Camera {
            world_from_camera: Pose::look_at_rh(eye_m, Vector::new(2.0, 1.6, 0.7), Vector::Z).inverse(),
            vertical_fov_rad: 0.9,
            width: 320,
            height: 240,
            blur_px: 0.0,
        };
        let (drawn, expected) = (gpu.render(&step, &camera), embedded.render(&step, &camera));
        let psnr_db = psnr_db(&drawn, &expected);
        assert!(psnr_db >= MIN_PSNR_DB, "{what}: {psnr_db:.1} dB");
        assert!(depth_p99_m(&drawn, &expected) <= DEPTH_TOLERANCE_M);
        let stray = drawn.ids.iter().zip(&expected.ids).filter(|(a, b)| a != b).count();
        assert!(stray as f64 <= STRAY_IDS * expected.ids.len() as f64, "{stray} other ids");
        assert_eq!(gpu.render_colours(&step, &camera), drawn.rgb);
    }
    assert_ne!(gpu.name(), embedded.name(), "the device did not fail");
}

#[test]
fn a_picture_too_large_for_the_device_is_drawn_by_the_embedded_renderer() {
    let world = kitchen();
    let Some(mut gpu) = gpu(Scenery::of(&world)) else { return };
    let wide = Camera { width: 70_000, height: 2, ..Cameras::of(&world).third_person() };
    let frame = gpu.render(&world.present(), &wide);
    assert_eq!(frame, cpu(Scenery::of(&world)).render(&world.present(), &wide));
    assert_eq!(gpu.name(), RendererKind::Cpu.name(), "it says who draws now");
}

#[test]
fn an_empty_scenery_is_sky() {
    let world = kitchen();
    let Some(mut gpu) = gpu(Scenery::default()) else { return };
    let camera = Camera { width: 16, height: 8, ..Cameras::of(&world).third_person() };
    let expected = cpu(Scenery::default()).render(&world.present(), &camera);
    assert_eq!(gpu.render(&world.present(), &camera), expected);
}

/// Counts the submissions and readbacks of this thread during `draw`.
fn counted<T>(draw: impl FnOnce() -> T) -> (T, [u32; 2]) {
    let now = || [counts::SUBMISSIONS.get(), counts::READ_BACKS.get()];
    let [submissions, read_backs] = now();
    let drawn = draw();
    (drawn, [now()[0] - submissions, now()[1] - read_backs])
}

#[test]
fn pictures_of_many_worlds_are_one_submission_and_one_read_back() {
    const WORLDS: usize = 3;
    let mut worlds: Vec<World> = (0..WORLDS).map(|_| kitchen()).collect();
    let Some(mut renderers) = worlds.iter().map(|world| gpu(Scenery::of(world))).collect::<Option<Vec<_>>>()
    else {
        return;
    };
    // Each world is in another state. Its images are drawn twice, to verify that moved parts are at their new
    // poses.
    for _ in 0..2 {
        let advance = |(number, world): (usize, &mut World)| {
            let commands = [world.rest_command(0), world.rest_command(1)];
            let steps = (0..=5 * number).map(|_| world.control_step(&commands).expect("it stays finite"));
            steps.last().expect("one")
        };
        let steps: Vec<Step> = worlds.iter_mut().enumerate().map(advance).collect();
        let cameras: Vec<Vec<Camera>> =
            worlds.iter().zip(&steps).map(|(world, step)| views(world, step)).collect();
        let requests = renderers.iter_mut().zip(&steps).zip(&cameras).map(|((renderer, step), cameras)| {
            RenderRequest { renderer: &mut **renderer, step, cameras: cameras.clone() }
        });
        let requests = requests.collect();
        let (together, counts) = counted(|| render_colours_together(requests));
        assert_eq!(counts, [1, 1]);
        for (((world, step), cameras), together) in worlds.iter().zip(&steps).zip(&cameras).zip(together) {
            let mut alone = gpu(Scenery::of(world)).expect("there is one");
            let (frames, counts) = counted(|| alone.render_all(step, cameras));
            assert_eq!(counts, [1, 1]);
            assert!(together.iter().eq(frames.iter().map(|frame| &frame.rgb)), "pictures differ");
            let colours: Vec<_> = cameras.iter().map(|camera| alone.render_colours(step, camera)).collect();
            assert_eq!(together, colours);
        }
        assert!(renderers.iter().all(|renderer| renderer.draws_together()), "the device did not fail");
    }
}
