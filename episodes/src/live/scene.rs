//! Constants of an episode for viewers: shapes, names and limits, and the renderer for the robots' images.

use std::sync::{Arc, Mutex, PoisonError};

use serde_json::{Value, json};
use tandem_sim::render::{
    CameraView, Cameras, Intrinsics, PictureError, Renderer, RendererKind, Scenery, encode_png,
};
use tandem_sim::{CONTROL_HZ, RobotModel, Side, Step, World};

use super::LiveStep;
use super::frame::{self, RobotFrame};
use super::geometry::{Geometry, pose_row};
use super::light::lights;
use super::textures::{LiveTexture, SceneTextures};
use crate::commands::Motion;
use crate::observation::cameras;
use crate::scoring::Phase;
use crate::spec::EpisodeSpec;
use crate::stress;

/// The scene of an episode.
pub struct LiveScene {
    head: Value,
    numbers: Vec<u8>,
    textures: Vec<Arc<LiveTexture>>,
    robots: Vec<RobotFrame>,
    cameras: Cameras,
    /// Separate motions for viewers, set to the states of the episode's motions.
    motions: Mutex<Vec<Motion>>,
    drawing: Mutex<Drawing>,
}

/// Renderer of images, created at the first request.
struct Drawing {
    kind: RendererKind,
    scenery: Option<Scenery>,
    renderer: Option<Box<dyn Renderer>>,
}

impl LiveScene {
    /// Name of the camera that sees the room.
    pub const THIRD_PERSON: &str = "third_person";

    /// Returns the scene of the episode `spec`, which runs in `world` with the robots of `motions`.
    pub(crate) fn of(spec: &EpisodeSpec, world: &World, motions: &[Motion]) -> LiveScene {
        let scenery = stress::scenery(spec.stress, spec.world_seed(), world);
        let mut textures = SceneTextures::default();
        let Geometry { meshes, parts, numbers } = Geometry::of(&scenery, &mut textures);
        let sky = scenery.sky.as_ref().map(|sky| textures.number(sky));
        let cameras = cameras(spec, world);
        let third_person = cameras.third_person();
        let robots = motions.iter().map(robot_head).collect::<Vec<_>>();
        let objects: Vec<&str> = world.object_models().map(|(name, _)| name).collect();
        let phases = spec.task.phases.iter().enumerate();
        let phases = phases.map(|(index, phase)| {
            json!({ "number": Phase::number(index), "id": phase.id, "collaborative": phase.collaborative })
        });
        let rules = spec.rules();
        let head = json!({
            "task": spec.task.id, "seed": spec.seed, "protocol": spec.protocol, "instruction": spec.task_words().joint,
            "assistance": spec.assistance, "control_hz": CONTROL_HZ,
            "episode_steps": rules.episode_steps, "thinking_s": rules.thinking.map(|time| time.as_secs_f64()),
            "phases": phases.collect::<Vec<_>>(), "robots": robots, "objects": objects,
            "third_person": { "pose": pose_row(&third_person.world_from_camera), "vertical_fov_rad": third_person.vertical_fov_rad },
            "meshes": meshes, "parts": parts, "textures": textures.told(), "sky": sky,
            "lights": scenery.lamps.as_ref().map(lights),
        });
        let frames = motions.iter().map(|motion| RobotFrame {
            name: motion.robot.name.clone(),
            effort_limits_n_m: motion.robot.model.joints.iter().map(|joint| joint.effort_n_m).collect(),
        });
        LiveScene {
            head,
            numbers,
            textures: textures.found,
            robots: frames.collect(),
            cameras,
            motions: Mutex::new(motions.iter().map(Motion::another).collect()),
            drawing: Mutex::new(Drawing { kind: spec.renderer, scenery: Some(scenery), renderer: None }),
        }
    }

    /// Returns the message from which a page draws the scene. All of it is little-endian: the length of
    /// the header in bytes (u32), then the header, which is JSON including `more`, padded with blanks to
    /// a multiple of four. The numbers of the meshes and `rest` follow.
    pub fn message(&self, more: Value, rest: &[u8]) -> Vec<u8> {
        let mut head = self.head.clone();
        if let (Value::Object(head), Value::Object(more)) = (&mut head, more) {
            head.extend(more);
        }
        let mut text = head.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut message = Vec::with_capacity(4 + text.len() + self.numbers.len() + rest.len());
        message.extend((text.len() as u32).to_le_bytes());
        message.extend(text);
        message.extend(&self.numbers);
        message.extend(rest);
        message
    }

    /// Returns the message of a step; `frame.rs` describes its format.
    pub fn frame(&self, live: &LiveStep) -> Vec<u8> {
        // Every frame begins with the states of the present step, so a panic leaves no stale state behind.
        let mut motions = self.motions.lock().unwrap_or_else(PoisonError::into_inner);
        frame::row(live, &mut motions, &self.robots)
    }

    /// Renders the view of robot `name` after `step` as a PNG file; `None` if there is no such robot.
    /// [`LiveScene::THIRD_PERSON`] is the name of the room's camera. The episode does not wait for the
    /// rendering.
    pub fn picture(&self, step: &Step, name: &str) -> Option<Result<Vec<u8>, PictureError>> {
        let view: CameraView = match self.robots.iter().position(|robot| robot.name == name) {
            Some(robot) => self.cameras.eye(step, robot),
            None if name == LiveScene::THIRD_PERSON => self.cameras.third_person().into(),
            None => return None,
        };
        let mut drawing = self.drawing.lock().unwrap_or_else(PoisonError::into_inner);
        let Drawing { kind, scenery, renderer } = &mut *drawing;
        let renderer = match renderer {
            Some(renderer) => renderer,
            none => none.insert(kind.renderer(scenery.take().unwrap_or_default())),
        };
        let drawn = view.render(&mut **renderer, step);
        Some(encode_png(drawn.width, drawn.height, &drawn.rgb))
    }

    /// Returns the images on surfaces, for which pages ask by their hashes.
    pub fn textures(&self) -> &[Arc<LiveTexture>] {
        &self.textures
    }

    /// Yields the names of the robots.
    pub fn robots(&self) -> impl Iterator<Item = &str> {
        self.robots.iter().map(|robot| robot.name.as_str())
    }
}

fn robot_head(motion: &Motion) -> Value {
    let model = &motion.robot.model;
    let Intrinsics { width, height, .. } = Intrinsics::from(&model.egocentric);
    let joints: Vec<&str> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
    json!({
        "name": motion.robot.name, "links": model.links.len(), "joints": joints,
        "fingers": [fingers(model, Side::Left), fingers(model, Side::Right)],
        "camera": { "vertical_fov_rad": model.egocentric.vertical_fov_rad, "width": width, "height": height },
    })
}

/// Returns the finger joints of a hand in command order. The pose of each is relative to the previous
/// link of its finger, or to the wrist.
fn fingers(model: &RobotModel, side: Side) -> Value {
    let hand = &model.hands[side];
    let is_finger = |link: &usize| hand.thumb.contains(link) || hand.fingers.contains(link);
    let joints = model.joints.iter().filter(|joint| is_finger(&joint.link));
    let told = joints.map(|joint| {
        json!({
            "pose": pose_row(&model.links[joint.link].parent_from_link), "axis": joint.axis.to_array(),
            "range_rad": [joint.lower_rad, joint.upper_rad],
        })
    });
    told.collect()
}
