//! What the robots of a world see: pictures, and depth at pixels.

use tandem_sim::render::{Camera, Cameras, Frame, Renderer, RendererKind, Scenery, encode_png};
use tandem_sim::{Step, World};
use tandem_tools_spec::{CameraImage, DepthPoint, DepthReply, Formats, Observation, Png};

use super::arrays::arrays;
use super::replies::{Detail, calibration, robot_state};
use crate::EpisodeError;
use crate::commands::Motion;
use crate::convert::{rounded, wire_vector};

/// Renders what the robots of a world see.
pub struct Eyes {
    renderer: Box<dyn Renderer>,
    pub cameras: Cameras,
}

impl Eyes {
    pub fn new(kind: RendererKind, world: &World) -> Eyes {
        Eyes { renderer: kind.renderer(Scenery::of(world)), cameras: Cameras::of(world) }
    }

    /// Who draws.
    pub fn renderer(&self) -> &str {
        self.renderer.name()
    }

    /// What any camera sees after `step`.
    pub fn render(&mut self, step: &Step, camera: &Camera) -> Frame {
        self.renderer.render(step, camera)
    }

    /// The reply to `observe` for the robots numbered `robots`, all of which `motions` move; with PNGs in any case, for the recording.
    pub fn observe(
        &mut self,
        step: &Step,
        robots: &[usize],
        motions: &[Motion],
        detail: Detail,
        formats: &Formats,
    ) -> Result<Observation, EpisodeError> {
        let mut images = Vec::with_capacity(robots.len());
        let mut cameras = Vec::with_capacity(robots.len());
        let mut raw = Vec::new();
        for &robot in robots {
            let name = &motions[robot].robot.name;
            let camera = self.cameras.egocentric(step, robot);
            let frame = self.render(step, &camera);
            let png = encode_png(frame.width, frame.height, &frame.rgb)?;
            images.push(CameraImage { robot: name.clone(), png_base64: Png(png) });
            raw.extend(arrays(name, &frame, formats)?);
            cameras.push(calibration(step, robot, name, &camera));
        }
        let states = robots.iter().map(|robot| robot_state(step, *robot, &motions[*robot].robot, detail));
        Ok(Observation { time_s: step.time_s, states: states.collect(), cameras, images, arrays: raw })
    }

    /// The reply to `query_depth` for robot number `robot`, called `name`.
    pub fn depth(
        &mut self,
        step: &Step,
        robot: usize,
        name: &str,
        pixels: &[[i64; 2]],
    ) -> Result<DepthReply, EpisodeError> {
        let camera = self.cameras.egocentric(step, robot);
        let (width, height) = (camera.width, camera.height);
        let outside = |[u, v]: [i64; 2]| u < 0 || v < 0 || u >= width.into() || v >= height.into();
        if let Some([u, v]) = pixels.iter().copied().find(|pixel| outside(*pixel)) {
            return Err(EpisodeError::PixelOutside { u, v, width, height });
        }
        let frame = self.render(step, &camera);
        let pelvis_from_camera = step.robots[robot].state.pelvis_from_camera;
        let points = pixels.iter().map(|&pixel| {
            let [u, v] = pixel;
            let depth_m = frame.depth_m[v as usize * width as usize + u as usize];
            let seen = depth_m.is_finite();
            let point_m = pelvis_from_camera * camera.unproject([u as f32 + 0.5, v as f32 + 0.5], depth_m);
            DepthPoint {
                pixel,
                depth_m: seen.then_some(rounded(depth_m.into())),
                point_in_pelvis_m: seen.then_some(wire_vector(point_m)),
            }
        });
        Ok(DepthReply { robot: name.into(), points: points.collect() })
    }
}
