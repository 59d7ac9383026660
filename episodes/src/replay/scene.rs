//! Cameras of a recorded episode, and images of its steps. Nothing is simulated.

use std::sync::Arc;

use tandem_sim::Step;
use tandem_sim::render::{Camera, CameraView, Frame};

use crate::EpisodeError;
use crate::observation::{Observer, Picture, drawing_view, scaled_colours};
use crate::session::build_world;
use crate::spec::EpisodeSpec;
use crate::tasks::Task;

/// One of an episode's cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EpisodeCamera {
    ThirdPerson,
    /// The camera in the head of the robot with this index.
    Egocentric(usize),
}

/// Width and height of an image in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureSize {
    pub width: u32,
    pub height: u32,
}

impl EpisodeCamera {
    /// Returns every camera of the task's episodes.
    pub fn all(task: &Task) -> Vec<EpisodeCamera> {
        let heads = (0..task.robots.len()).map(EpisodeCamera::Egocentric);
        std::iter::once(EpisodeCamera::ThirdPerson).chain(heads).collect()
    }

    /// Returns the camera's name: `third_person`, or the robot's name.
    pub fn name(self, task: &Task) -> &'static str {
        match self {
            EpisodeCamera::ThirdPerson => "third_person",
            EpisodeCamera::Egocentric(robot) => task.robots[robot].name,
        }
    }

    /// Returns the camera called `name`.
    ///
    /// # Errors
    ///
    /// If there is none; the text lists the cameras.
    pub fn find(name: &str, task: &Task) -> Result<EpisodeCamera, String> {
        let all = EpisodeCamera::all(task);
        let have: Vec<&str> = all.iter().map(|view| view.name(task)).collect();
        let found = have.iter().position(|known| *known == name);
        found.map(|index| all[index]).ok_or_else(|| {
            format!("no camera {name:?} in an episode of {}; have: {}", task.id, have.join(", "))
        })
    }
}

/// Renders the start of the episode `spec`, seen by its third-person camera, as a PNG file.
///
/// # Errors
///
/// If the world cannot be built or the image cannot be encoded.
pub fn start_picture(spec: &EpisodeSpec, size: PictureSize) -> Result<Arc<[u8]>, EpisodeError> {
    let world = build_world(spec)?.world;
    let mut renderer = EpisodeRenderer { observer: Observer::new(spec, &world) };
    let picture = renderer.colours(EpisodeCamera::ThirdPerson, &world.present(), Some(size));
    Ok(picture.png()?)
}

/// Renderer of the steps of one episode.
pub struct EpisodeRenderer {
    observer: Observer,
}

impl EpisodeRenderer {
    /// Creates the renderer of the episode `spec`. The world is built for it and stays at rest.
    ///
    /// # Errors
    ///
    /// If the world cannot be built.
    pub fn of(spec: &EpisodeSpec) -> Result<EpisodeRenderer, EpisodeError> {
        Ok(EpisodeRenderer { observer: Observer::new(spec, &build_world(spec)?.world) })
    }

    /// Returns the view of a camera after `step`, with the given image size or its own. The vertical angle
    /// stays the same, and the horizontal one follows the shape.
    pub fn view(&self, of: EpisodeCamera, step: &Step, size: Option<PictureSize>) -> CameraView {
        let view = match of {
            EpisodeCamera::ThirdPerson => self.observer.cameras.third_person().into(),
            EpisodeCamera::Egocentric(robot) => self.observer.cameras.eye(step, robot),
        };
        match size {
            Some(PictureSize { width, height }) => {
                CameraView { camera: Camera { width, height, ..view.camera }, ..view }
            }
            None => view,
        }
    }

    /// Returns the image of a camera after `step`, in its own size or in another, without depth. A smaller
    /// image of the same aspect ratio is the camera's own image, scaled. A policy that requests this size
    /// gets the same image.
    pub fn colours(&mut self, of: EpisodeCamera, step: &Step, size: Option<PictureSize>) -> Picture {
        let own = self.view(of, step, None);
        let own_px = [own.camera.width, own.camera.height];
        let size_px = size.map_or(own_px, |PictureSize { width, height }| [width, height]);
        let view = drawing_view(own, size_px);
        let rgb = self.observer.colours(step, &view);
        let drawn_px = [view.camera.width, view.camera.height];
        Picture::new(size_px[0], size_px[1], scaled_colours(rgb, drawn_px, size_px))
    }

    /// Renders a view after `step`.
    pub fn draw(&mut self, step: &Step, view: &CameraView) -> Frame {
        self.observer.render(step, view)
    }
}
