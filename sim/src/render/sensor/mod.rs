//! Sensors behind the lens of a head camera. A renderer draws the ideal image; the sensor turns it into the
//! one that a camera would deliver. This is the same for all renderers, and a function of the ideal image,
//! a seed and the camera's motion, so that the same step always has the same image.
//!
//! The book's page about physics lists what is modelled, with values and sources.

mod colour;
mod depth;
mod distortion;
mod lens;
mod motion;
mod noise;
mod warp;

#[cfg(test)]
mod tests;

use std::thread;

use serde::{Deserialize, Serialize};

use super::{Camera, Frame, Intrinsics, Renderer};
use crate::Step;

use lens::LensMap;

pub use distortion::Distortion;
pub use motion::CameraMotion;

/// Model of the cameras in the robots' heads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraModel {
    /// A pinhole with a perfect sensor.
    #[default]
    Ideal,
    /// The colour sensor and the stereo depth of an Intel RealSense D435i, the head camera of the G1.
    D435i,
}

impl CameraModel {
    pub const ALL: [CameraModel; 2] = [CameraModel::Ideal, CameraModel::D435i];

    pub fn name(self) -> &'static str {
        match self {
            CameraModel::Ideal => "ideal",
            CameraModel::D435i => "d435i",
        }
    }

    /// Returns true for the default, which specs leave out.
    pub fn is_ideal(&self) -> bool {
        *self == CameraModel::Ideal
    }

    /// Returns the intrinsics of a camera of this model, whose lens is a pinhole but for the distortion.
    pub fn lens(self, pinhole: Intrinsics) -> Intrinsics {
        match self {
            CameraModel::Ideal => pinhole,
            CameraModel::D435i => Intrinsics { distortion: Distortion::d435i(&pinhole), ..pinhole },
        }
    }
}

/// A camera with the sensor behind its lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
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

impl From<Camera> for View {
    fn from(camera: Camera) -> View {
        View { camera, shot: None }
    }
}

impl View {
    /// Returns the intrinsics of the image, with the distortion of the camera's lens.
    pub fn intrinsics(&self) -> Intrinsics {
        let model = if self.shot.is_some() { CameraModel::D435i } else { CameraModel::Ideal };
        model.lens(self.camera.intrinsics())
    }

    /// Renders the image after `step`.
    pub fn render(&self, renderer: &mut dyn Renderer, step: &Step) -> Frame {
        self.take(renderer.render(step, &self.camera))
    }

    /// Renders only the colours of the image after `step`, the same as [`View::render`] does. A sensor needs
    /// the depth, too: what is near moves more in a moving camera's image.
    pub fn render_colours(&self, renderer: &mut dyn Renderer, step: &Step) -> Vec<u8> {
        match self.shot {
            None => renderer.render_colours(step, &self.camera),
            Some(_) => self.render(renderer, step).rgb,
        }
    }

    /// Renders the images of several views after `step`, in their order.
    pub fn render_all(views: &[View], renderer: &mut dyn Renderer, step: &Step) -> Vec<Frame> {
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

    /// Returns the sensor's image of an ideal one.
    fn take(&self, ideal: Frame) -> Frame {
        match &self.shot {
            None => ideal,
            Some(shot) => shot.d435i(ideal, &self.intrinsics()),
        }
    }
}

impl Shot {
    /// Returns the seed of the image of a robot after a control step.
    pub fn seed(episode: u32, robot: usize, control_step: u64) -> u64 {
        noise::mixed(u64::from(episode) << 32 | robot as u64) ^ noise::mixed(control_step + 1)
    }

    /// Returns the image that a D435i takes of what an ideal camera of these intrinsics sees.
    fn d435i(&self, ideal: Frame, lens: &Intrinsics) -> Frame {
        let light = colour::Light::of(&ideal.rgb, ideal.width, ideal.height);
        let map = LensMap::of(lens);
        Frame {
            rgb: light.taken(&light.exposure(), &ideal.depth_m, &map, self),
            depth_m: depth::taken(&ideal.depth_m, &map, self.seed),
            ids: map.nearest_of(&ideal.ids),
            ..ideal
        }
    }
}
