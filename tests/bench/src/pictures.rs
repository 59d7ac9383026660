//! Rendering time in Handover's kitchen, for both head cameras in two image sizes, and for the camera in the
//! room.

use std::f32::consts::PI;
use std::time::{Duration, Instant};

use serde::Serialize;
use tandem_sim::render::{Camera, CameraModel, CameraView, Cameras, Renderer, RendererKind, Scenery};
use tandem_sim::{ObjectPlacement, Pose, RobotPlacement, SimError, Step, Vector, World, WorldSpec};

use crate::error::BenchError;
use crate::spread::{Spread, busy_since};

/// Times of all sets of images.
#[derive(Clone, Debug, Serialize)]
pub struct PicturesReport {
    /// Name of the renderer and its device.
    pub renderer: String,
    /// Model of the cameras in the heads.
    pub camera: CameraModel,
    pub cases: Vec<PicturesCase>,
}

/// Times for a set of images of one state, with colour, depth and ids, or colour alone.
#[derive(Clone, Debug, Serialize)]
pub struct PicturesCase {
    pub name: &'static str,
    pub pictures: usize,
    pub width: u32,
    pub height: u32,
    /// CPU time of the thread that requests the images; equal to `wall_ms` if the system does not report it.
    /// The path tracer also uses other threads, unless only colours are requested.
    pub busy_ms: Spread,
    pub wall_ms: Spread,
}

/// Common image size of learned policies.
const SMALL_PX: [u32; 2] = [128, 128];
/// Number of measured batches. CPU time is counted in ticks of some milliseconds, so a batch needs many
/// states, unless a single state takes long.
const BATCHES: usize = 9;

/// Returns the number of states in a batch.
fn states(kind: RendererKind) -> usize {
    match kind {
        RendererKind::Auto | RendererKind::Cpu | RendererKind::Gpu => 10,
        RendererKind::Path => 1,
    }
}

/// Times all sets of images. Calls `done` after each.
///
/// # Errors
///
/// Returns an error if a world cannot be built or physics diverges.
pub fn pictures(
    kind: RendererKind,
    camera: CameraModel,
    mut done: impl FnMut(&PicturesCase),
) -> Result<PicturesReport, BenchError> {
    let world = World::new(&kitchen())?;
    let mut cameras = Cameras::of(&world);
    cameras.set_model(camera, 0);
    let renderer = kind.renderer(Scenery::of(&world)).name().to_owned();
    let eyes = |step: &Step| (0..2).map(|robot| cameras.eye(step, robot)).collect();
    let small = |step: &Step| {
        let [width, height] = SMALL_PX;
        let eyes = (0..2).map(|robot| cameras.eye(step, robot));
        eyes.map(|eye| CameraView { camera: Camera { width, height, ..eye.camera }, ..eye }).collect()
    };
    let room = |_: &Step| vec![cameras.third_person().into()];
    let mut cases = Vec::new();
    let sets: [(_, &Views, Draw); 4] = [
        ("eyes of both", &eyes, whole),
        ("their colours", &eyes, colours),
        ("small colours", &small, colours),
        ("third person", &room, whole),
    ];
    for (name, views, draw) in sets {
        let case = measure(kind, name, views, draw)?;
        done(&case);
        cases.push(case);
    }
    Ok(PicturesReport { renderer, camera, cases })
}

/// Function that returns the camera views of a set of images.
type Views<'a> = dyn Fn(&Step) -> Vec<CameraView> + 'a;

/// Function that renders an image with all channels, or with colour alone, as learned policies use it.
type Draw = fn(&mut dyn Renderer, &Step, &CameraView);

fn whole(renderer: &mut dyn Renderer, step: &Step, view: &CameraView) {
    view.render(renderer, step);
}

fn colours(renderer: &mut dyn Renderer, step: &Step, view: &CameraView) {
    view.render_colours(renderer, step);
}

fn measure(
    kind: RendererKind,
    name: &'static str,
    views: &Views,
    draw: Draw,
) -> Result<PicturesCase, SimError> {
    let mut world = World::new(&kitchen())?;
    let commands = [world.rest_command(0), world.rest_command(1)];
    let mut renderer = kind.renderer(Scenery::of(&world));
    let (mut busy_ms, mut wall_ms) = (Vec::new(), Vec::new());
    // The first batch warms up.
    for _ in 0..=BATCHES {
        let (mut busy, mut wall) = (Duration::ZERO, Duration::ZERO);
        for _ in 0..states(kind) {
            let step = world.control_step(&commands)?;
            let (views, started) = (views(&step), Instant::now());
            let before = busy_since(started);
            views.iter().for_each(|view| draw(&mut *renderer, &step, view));
            busy += busy_since(started) - before;
            wall += started.elapsed();
        }
        let each_ms = |whole: Duration| whole.as_secs_f64() * 1e3 / states(kind) as f64;
        busy_ms.push(each_ms(busy));
        wall_ms.push(each_ms(wall));
    }
    let views = views(&world.present());
    let Camera { width, height, .. } = views[0].camera;
    let [busy_ms, wall_ms] = [busy_ms, wall_ms].map(|mut all| Spread::of(&mut all[1..]));
    Ok(PicturesCase { name, pictures: views.len(), width, height, busy_ms, wall_ms })
}

fn kitchen() -> WorldSpec {
    let robot = |name: &str, position_m: [f32; 2], yaw_rad: f32| RobotPlacement {
        name: name.into(),
        position_m,
        yaw_rad,
    };
    WorldSpec {
        scene: "kitchen_084".into(),
        robots: vec![robot("A", [0.0, 0.0], 0.0), robot("B", [0.74, -0.12], PI)],
        objects: vec![ObjectPlacement {
            name: "bottle".into(),
            file: "bottle".into(),
            world_from_object: Pose::from_translation(Vector::new(0.30, -0.07, 0.80)),
        }],
    }
}
