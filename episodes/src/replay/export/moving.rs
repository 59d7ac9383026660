//! The content of a recording as tracks of rigid frames, with the shapes and cameras that they carry.

use std::collections::HashMap;
use std::sync::Arc;

use tandem_sim::render::{Cameras, Carrier, Lamp, Scenery, TriangleMesh};
use tandem_sim::{Pose, Step, Vector, World};

use super::surfaces::{Surface, mapped};
use crate::live::{LiveTexture, SceneTextures};
use crate::observation::cameras;
use crate::recording::Recording;
use crate::replay::video::step_of_picture;
use crate::replay::{EpisodeCamera, ReplayError};
use crate::session::build_world;
use crate::stress;

/// Deviation of a pose, in metres and in the quaternion, up to which a frame counts as still.
const STILL: f32 = 1e-6;

/// A recording without its dynamics: shapes on rigid frames.
pub struct MovingScene {
    pub rate_hz: u32,
    /// Number of moments in each track that moves.
    pub moments: usize,
    /// The first is the room, which is still.
    pub frames: Vec<Track>,
    pub shapes: Vec<Shape>,
    /// Distinct meshes, with texture coordinates where their surfaces have images.
    pub meshes: Vec<TriangleMesh>,
    pub surfaces: Vec<Surface>,
    pub images: Vec<Arc<LiveTexture>>,
    pub cameras: Vec<MovingCamera>,
    pub lights: Vec<SceneLight>,
}

/// Motion of a rigid frame.
pub struct Track {
    /// Name, for example `A/left_elbow_link` or `bottle`.
    pub name: String,
    /// Pose at each moment; a single one if the frame does not move.
    pub world_from_frame: Vec<Pose>,
}

/// A mesh on a frame.
pub struct Shape {
    pub frame: usize,
    pub frame_from_mesh: Pose,
    pub mesh: usize,
    pub surface: usize,
}

/// A pinhole camera that looks along its -z axis, with +y up.
pub struct MovingCamera {
    pub track: Track,
    pub vertical_fov_rad: f32,
    pub aspect_ratio: f32,
}

/// A distant light.
pub struct SceneLight {
    /// Linear colour of the light on a white surface that faces it.
    pub rgb: Vector,
    /// Unit vector along which it shines.
    pub direction: Vector,
}

impl Track {
    fn new(name: String) -> Track {
        Track { name, world_from_frame: Vec::new() }
    }

    /// Adds the next pose, with the sign of the quaternion that is nearer to the pose before.
    fn push(&mut self, mut pose: Pose) {
        if self.world_from_frame.last().is_some_and(|last| last.rotation.dot(pose.rotation) < 0.0) {
            pose.rotation = -pose.rotation;
        }
        self.world_from_frame.push(pose);
    }

    /// Keeps only the first pose if all are equal.
    fn simplify(&mut self) {
        let Some(first) = self.world_from_frame.first().copied() else { return };
        let is_near = |pose: &Pose| {
            pose.translation.abs_diff_eq(first.translation, STILL)
                && pose.rotation.abs_diff_eq(first.rotation, STILL)
        };
        if self.world_from_frame.iter().all(is_near) {
            self.world_from_frame.truncate(1);
        }
    }
}

/// Frames and cameras of a world, in the order of a scene's.
struct Tracks<'a> {
    carriers: Vec<Carrier>,
    frames: Vec<Track>,
    cameras: &'a Cameras,
    views: Vec<MovingCamera>,
}

impl<'a> Tracks<'a> {
    fn of(recording: &Recording, world: &World, cameras: &'a Cameras) -> Tracks<'a> {
        let links = world.robots().iter().enumerate().flat_map(|(robot, body)| {
            let names = body.model.links.iter().map(|link| format!("{}/{}", body.name, link.name));
            names.enumerate().map(move |(link, name)| (Carrier::Link { robot, link }, name))
        });
        let objects = world.object_models().enumerate();
        let objects = objects.map(|(object, (name, _))| (Carrier::Object(object), name.to_string()));
        let room = (Carrier::Room, "room".to_string());
        let (carriers, names): (Vec<Carrier>, Vec<String>) =
            std::iter::once(room).chain(links).chain(objects).unzip();
        let views = EpisodeCamera::all(&recording.spec.task).into_iter().map(|of| {
            let camera = match of {
                EpisodeCamera::ThirdPerson => cameras.third_person(),
                EpisodeCamera::Egocentric(robot) => cameras.egocentric(&world.present(), robot),
            };
            MovingCamera {
                track: Track::new(of.name(&recording.spec.task).into()),
                vertical_fov_rad: camera.vertical_fov_rad,
                aspect_ratio: camera.width as f32 / camera.height as f32,
            }
        });
        let views = views.collect();
        Tracks { carriers, frames: names.into_iter().map(Track::new).collect(), cameras, views }
    }

    fn push(&mut self, step: &Step) {
        for (carrier, frame) in self.carriers.iter().zip(&mut self.frames) {
            frame.push(carrier.world_from_carrier(step));
        }
        // The third-person camera comes first, then one per robot.
        for (number, view) in self.views.iter_mut().enumerate() {
            let camera = match number.checked_sub(1) {
                None => self.cameras.third_person(),
                Some(robot) => self.cameras.egocentric(step, robot),
            };
            view.track.push(camera.world_from_camera);
        }
    }
}

impl MovingScene {
    /// Reads the motion of a recording, `rate_hz` times per second of simulated time.
    pub fn of(recording: &Recording, rate_hz: u32) -> Result<MovingScene, ReplayError> {
        let spec = &recording.spec;
        let world = build_world(spec)?.world;
        let scenery = stress::scenery(spec.stress, spec.world_seed(), &world);
        let cameras = cameras(spec, &world);
        let mut tracks = Tracks::of(recording, &world, &cameras);
        let mut moments = 0;
        for (index, step) in recording.steps().enumerate() {
            let step = step?;
            if index >= step_of_picture(moments, rate_hz) {
                tracks.push(&step);
                moments += 1;
            }
        }
        let Tracks { carriers, mut frames, views: mut cameras, .. } = tracks;
        let all = frames.iter_mut().chain(cameras.iter_mut().map(|camera| &mut camera.track));
        all.for_each(Track::simplify);
        let Shapes { shapes, meshes, surfaces, textures, .. } = Shapes::of(&scenery, &carriers);
        let lights = lights(&scenery);
        let images = textures.found;
        Ok(MovingScene { rate_hz, moments, frames, shapes, meshes, surfaces, images, cameras, lights })
    }
}

/// Shapes of a scenery; equal meshes and surfaces are stored once.
#[derive(Default)]
struct Shapes {
    shapes: Vec<Shape>,
    meshes: Vec<TriangleMesh>,
    surfaces: Vec<Surface>,
    textures: SceneTextures,
    /// Numbers of the meshes without texture coordinates of their own, by their address.
    known: HashMap<*const TriangleMesh, usize>,
}

impl Shapes {
    fn of(scenery: &Scenery, carriers: &[Carrier]) -> Shapes {
        let mut found = Shapes::default();
        let frame_of = |carrier| carriers.iter().position(|known| *known == carrier);
        for part in &scenery.parts {
            let Some(frame) = frame_of(part.carrier) else { continue };
            let mesh = match &part.image {
                Some(image) => found.add_mesh(mapped(&part.mesh, image)),
                None => found.plain_mesh(&part.mesh),
            };
            let surface = Surface::of(part, &mut found.textures);
            let known = found.surfaces.iter().position(|known| *known == surface);
            let surface = known.unwrap_or_else(|| {
                found.surfaces.push(surface);
                found.surfaces.len() - 1
            });
            found.shapes.push(Shape { frame, frame_from_mesh: part.carrier_from_mesh, mesh, surface });
        }
        found
    }

    fn plain_mesh(&mut self, mesh: &TriangleMesh) -> usize {
        if let Some(number) = self.known.get(&std::ptr::from_ref(mesh)) {
            return *number;
        }
        let number = self.add_mesh(mesh.clone().without_uvs());
        self.known.insert(mesh, number);
        number
    }

    fn add_mesh(&mut self, mesh: TriangleMesh) -> usize {
        if let Some(known) = self.meshes.iter().position(|known| *known == mesh) {
            return known;
        }
        self.meshes.push(mesh);
        self.meshes.len() - 1
    }
}

/// Returns the lights of a scenery: the sun, or the lamps of the scene's file. Each lamp becomes a distant
/// light along its direction, because MuJoCo's lamps do not fade with distance unless their file says so.
fn lights(scenery: &Scenery) -> Vec<SceneLight> {
    let sun = SceneLight { rgb: scenery.light.sun_rgb, direction: -scenery.light.sun_direction };
    let Some(lamps) = &scenery.lamps else { return vec![sun] };
    let lamp = |Lamp { light, .. }: &Lamp| SceneLight { rgb: light.diffuse_rgb, direction: light.direction };
    lamps.lamps.iter().map(lamp).collect()
}
