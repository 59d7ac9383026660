//! Sensors behind the lens of a head camera. A renderer draws the ideal image; the sensor converts it to the
//! image that a camera would deliver. The conversion is the same for all renderers. It depends only on the
//! ideal image, a seed and the camera's motion, so equal steps give equal images.
//!
//! The book's page about physics lists the modelled effects, with values and sources.

mod colour;
mod depth;
mod lens;
mod motion;
mod noise;
mod warp;

#[cfg(test)]
mod tests;

use std::thread;

use super::{Camera, CameraModel, Cameras, Frame, Intrinsics, Renderer};
use crate::Step;

use lens::LensMap;

pub use motion::CameraMotion;

/// A camera with the sensor behind its lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraView {
    pub camera: Camera,
    /// `None` for an ideal image.
    pub shot: Option<Shot>,
}

/// The conditions of one image of a D435i.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Seed of the image's noise.
    pub seed: u64,
    pub motion: CameraMotion,
}

impl From<Camera> for CameraView {
    fn from(camera: Camera) -> CameraView {
        CameraView { camera, shot: None }
    }
}

impl CameraView {
    /// Returns the intrinsics of the image, with the distortion of the camera's lens.
    pub fn intrinsics(&self) -> Intrinsics {
        let model = if self.shot.is_some() { CameraModel::D435i } else { CameraModel::Ideal };
        self.camera.intrinsics().of_model(model)
    }

    /// Renders the image after `step`.
    pub fn render(&self, renderer: &mut dyn Renderer, step: &Step) -> Frame {
        self.take(renderer.render(step, &self.camera))
    }

    /// Renders only the colours of the image after `step`, like [`CameraView::render`]. A sensor needs the
    /// depth, too: in the image of a moving camera, near surfaces move faster.
    pub fn render_colours(&self, renderer: &mut dyn Renderer, step: &Step) -> Vec<u8> {
        match self.shot {
            None => renderer.render_colours(step, &self.camera),
            Some(_) => self.render(renderer, step).rgb,
        }
    }

    /// Renders the images of several views after `step`, in their order.
    pub fn render_all(views: &[CameraView], renderer: &mut dyn Renderer, step: &Step) -> Vec<Frame> {
        let cameras: Vec<Camera> = views.iter().map(|view| view.camera).collect();
        let frames = renderer.render_all(step, &cameras);
        if views.iter().all(|view| view.shot.is_none()) {
            return frames;
        }
        thread::scope(|scope| {
            let taken: Vec<_> =
                views.iter().zip(frames).map(|(view, frame)| scope.spawn(|| view.take(frame))).collect();
            taken.into_iter().map(|taken| taken.join().expect("a sensor does not fail")).collect()
        })
    }

    /// Converts an ideal image to the sensor's image.
    fn take(&self, ideal: Frame) -> Frame {
        match &self.shot {
            None => ideal,
            Some(shot) => shot.d435i(ideal, &self.intrinsics()),
        }
    }
}

impl Cameras {
    /// Returns the view of a robot after `step`: the camera in its head, with the sensor of the model.
    pub fn eye(&self, step: &Step, robot: usize) -> CameraView {
        let (model, seed) = self.model();
        let shot = match model {
            CameraModel::Ideal => None,
            CameraModel::D435i => Some(Shot {
                seed: Shot::seed(seed, robot, step.control_step),
                motion: self.motion(step, robot),
            }),
        };
        CameraView { camera: self.egocentric(step, robot), shot }
    }

    /// Returns the motion of a robot's camera in the control step that ended with `step`.
    fn motion(&self, step: &Step, robot: usize) -> CameraMotion {
        let truth = &step.robots[robot].truth;
        let lens = self.lens(robot).camera_from_lens;
        let before = truth.world_from_camera_before.map(|before| before * lens);
        before.map_or(CameraMotion::STILL, |before| {
            CameraMotion::between(&before, &(truth.world_from_camera * lens))
        })
    }
}

impl Shot {
    /// Returns the noise seed of a robot's image after a control step.
    pub fn seed(episode: u32, robot: usize, control_step: u64) -> u64 {
        noise::mixed(u64::from(episode) << 32 | robot as u64) ^ noise::mixed(control_step + 1)
    }

    /// Converts an ideal image with these intrinsics to a D435i's image.
    fn d435i(&self, ideal: Frame, lens: &Intrinsics) -> Frame {
        let light = colour::SensorLight::of(&ideal.rgb, ideal.width, ideal.height);
        let map = LensMap::of(lens);
        Frame {
            rgb: light.taken(&light.exposure(), &ideal.depth_m, &map, self),
            depth_m: depth::taken(&ideal.depth_m, &map, self.seed),
            ids: map.nearest_of(&ideal.ids),
            ..ideal
        }
    }
}
