//! What the robots of an episode see and sense at one moment. A view is drawn once for a step and a robot, and encoded only where it
//! leaves the process: in a reply or in the recording.

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
pub use observer::Observer;
pub use proprioception::{Detail, Proprioception, robot_state};

/// What several robots see and sense at the same moment.
#[derive(Clone, Debug)]
pub struct TeamObservation {
    pub time_s: f64,
    pub robots: Vec<RobotObservation>,
}

/// What one robot sees and senses.
#[derive(Clone, Debug)]
pub struct RobotObservation {
    pub state: RobotState,
    pub calibration: CameraCalibration,
    pub view: Arc<RobotView>,
}

/// What the camera in a robot's head sees. It says neither where the camera is in the world nor which objects are seen.
#[derive(Debug)]
pub struct RobotView {
    pub intrinsics: Intrinsics,
    /// The recording may still need it when the rest of the view is gone.
    pub picture: Arc<Picture>,
    /// [`Frame::depth_m`]. Not every protocol gives it to policies at every pixel, so they get it by calls
    /// alone. Empty in a view that only the recording needs.
    pub(crate) depth_m: Vec<f32>,
}

/// The colours of a frame, and its PNG file once somebody has asked for that.
#[derive(Debug)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    rgb: LazyLock<Vec<u8>, Draw>,
    png: Mutex<Option<Arc<[u8]>>>,
}

/// Function that draws a picture at the first use of its colours.
type Draw = Box<dyn FnOnce() -> Vec<u8> + Send>;

impl Picture {
    pub fn new(width: u32, height: u32, rgb: Vec<u8>) -> Picture {
        Picture::drawn_later([width, height], || rgb)
    }

    /// Returns a picture that is drawn at the first use of its colours, on the thread that uses them.
    fn drawn_later([width, height]: [u32; 2], draw: impl FnOnce() -> Vec<u8> + Send + 'static) -> Picture {
        Picture { width, height, rgb: LazyLock::new(Box::new(draw)), png: Mutex::default() }
    }

    /// Returns the colours, three bytes a pixel, sRGB.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// The picture as a PNG file, encoded the first time only: whoever asks meanwhile waits for it.
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
        let Frame { width, height, rgb, depth_m, .. } = frame;
        RobotView { intrinsics, picture: Picture::new(width, height, rgb).into(), depth_m }
    }
}

impl RobotView {
    /// As [`Frame::depth_m`], for callers in this process whose look the episode has checked: not every protocol allows it.
    pub fn depth_m(&self) -> &[f32] {
        &self.depth_m
    }
}

impl TeamObservation {
    /// The reply to `observe`, with pictures in the formats that were asked for.
    pub fn reply(&self, formats: &Formats) -> Result<Observation, PictureError> {
        let mut images = Vec::new();
        let mut arrays = Vec::new();
        for RobotObservation { state, view, .. } in &self.robots {
            if formats.images != Some(ImageFormat::Rgb) {
                let png_base64 = Png(view.picture.png()?.to_vec());
                images.push(CameraImage { robot: state.robot.clone(), png_base64 });
            }
            arrays.extend(formats::arrays(&state.robot, view, formats)?);
        }
        Ok(Observation {
            time_s: self.time_s,
            states: self.robots.iter().map(|robot| robot.state.clone()).collect(),
            cameras: self.robots.iter().map(|robot| robot.calibration.clone()).collect(),
            images,
            arrays,
        })
    }
}
