//! Observations of an episode's robots. A view is rendered once for each step and robot. It is encoded
//! only when it leaves the process, in a reply or in the recording.

mod depth_image;
mod fit;
mod formats;
mod observer;
mod proprioception;
mod scaling;
mod surface;

use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use tandem_sim::render::{Frame, Intrinsics, PictureError, encode_png};
use tandem_tools_spec::{CameraCalibration, CameraImage, Formats, ImageFormat, Observation, Png, RobotState};

pub use formats::check_formats;
pub use observer::{Observer, cameras};
pub use proprioception::{Detail, Proprioception, robot_state, samples, tell_state_in};
pub use scaling::{drawing_view, scaled_colours};

/// Observations of several robots at the same moment.
#[derive(Clone, Debug)]
pub struct TeamObservation {
    pub time_s: f64,
    pub robots: Vec<RobotObservation>,
    /// True to show depth images, too.
    pub shows_depth: bool,
}

/// Observation of one robot.
#[derive(Clone, Debug)]
pub struct RobotObservation {
    pub state: RobotState,
    pub calibration: CameraCalibration,
    pub view: Arc<RobotView>,
}

/// View of a robot's head camera. It does not reveal the camera's pose in the world.
#[derive(Debug)]
pub struct RobotView {
    pub intrinsics: Intrinsics,
    /// Shared, because the recording may need it after the rest of the view is dropped.
    pub picture: Arc<Picture>,
    /// Depth as in [`Frame::depth_m`]. Some protocols withhold whole depth images from policies, which then
    /// receive depth through calls only. Empty in a view for the recording alone.
    pub(crate) depth_m: Vec<f32>,
    /// Ids of visible things as in [`Frame::ids`], for [`surface`] alone. Empty whenever the depth is.
    ids: Vec<u32>,
}

/// Colours of a frame, and its PNG file once it has been requested.
#[derive(Debug)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    rgb: LazyLock<Vec<u8>, Draw>,
    png: Mutex<Option<Arc<[u8]>>>,
}

/// Function that renders an image at the first use of its colours.
type Draw = Box<dyn FnOnce() -> Vec<u8> + Send>;

impl Picture {
    pub fn new(width: u32, height: u32, rgb: Vec<u8>) -> Picture {
        Picture::drawn_later([width, height], || rgb)
    }

    /// Returns an image that is rendered at the first use of its colours, on the calling thread.
    fn drawn_later([width, height]: [u32; 2], draw: impl FnOnce() -> Vec<u8> + Send + 'static) -> Picture {
        Picture { width, height, rgb: LazyLock::new(Box::new(draw)), png: Mutex::default() }
    }

    /// Returns the colours, three bytes a pixel, sRGB.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// Returns the image as a PNG file, encoded at the first call; concurrent calls wait for it.
    pub fn png(&self) -> Result<Arc<[u8]>, PictureError> {
        let mut png = self.png.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(png) = &*png {
            return Ok(png.clone());
        }
        let encoded = encode_png(self.width, self.height, &self.rgb)?.into();
        Ok(png.insert(encoded).clone())
    }
}

impl RobotView {
    pub fn new(intrinsics: Intrinsics, frame: Frame) -> RobotView {
        let Frame { width, height, rgb, depth_m, ids } = frame;
        RobotView { intrinsics, picture: Picture::new(width, height, rgb).into(), depth_m, ids }
    }
}

impl RobotView {
    /// Returns depth as in [`Frame::depth_m`], for callers in this process. The episode has checked their
    /// request, since some protocols do not allow it.
    pub fn depth_m(&self) -> &[f32] {
        &self.depth_m
    }
}

impl TeamObservation {
    /// Returns the reply to `observe`, with images in the requested formats.
    pub fn reply(&self, formats: &Formats) -> Result<Observation, PictureError> {
        let mut images = Vec::new();
        let mut arrays = Vec::new();
        let mut depth_images = Vec::new();
        for RobotObservation { state, view, .. } in &self.robots {
            if formats.images != Some(ImageFormat::Rgb) {
                let png_base64 = Png(view.picture.png()?.to_vec());
                images.push(CameraImage { robot: state.robot.clone(), png_base64 });
            }
            arrays.extend(formats::arrays(&state.robot, view, formats)?);
            if self.shows_depth {
                depth_images.push(depth_image::depth_image(&state.robot, view)?);
            }
        }
        Ok(Observation {
            time_s: self.time_s,
            states: self.robots.iter().map(|robot| robot.state.clone()).collect(),
            cameras: self.robots.iter().map(|robot| robot.calibration.clone()).collect(),
            images,
            links: Vec::new(),
            depth_images,
            arrays,
        })
    }
}
