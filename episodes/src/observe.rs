//! Replies to the tools that only look: pictures, depth, proprioception.

use tandem_sim::render::{self, Camera, Cameras, Frame, Renderer, Scenery, encode_png};
use tandem_sim::{Step, Vector, World};
use tandem_tools_spec::{
    CameraCalibration, CameraImage, DepthPoint, DepthReply, JointValues, Observation, Png, RobotState,
};

use crate::EpisodeError;
use crate::convert::{opencv_axes, rounded, wire_base, wire_pose_from_sim, wire_vector};

/// Renders what the robots of a world see.
pub struct Eyes {
    renderer: Box<dyn Renderer>,
    pub cameras: Cameras,
}

impl Eyes {
    pub fn new(world: &World) -> Eyes {
        Eyes { renderer: render::cpu(Scenery::of(world)), cameras: Cameras::of(world) }
    }

    /// What any camera sees after `step`.
    pub fn render(&mut self, step: &Step, camera: &Camera) -> Frame {
        self.renderer.render(step, camera)
    }

    pub fn observe(&mut self, world: &World, robots: &[usize]) -> Result<Observation, EpisodeError> {
        let step = world.present();
        let cameras: Vec<Camera> =
            robots.iter().map(|robot| self.cameras.egocentric(&step, *robot)).collect();
        let mut images = Vec::with_capacity(robots.len());
        for (&robot, camera) in robots.iter().zip(&cameras) {
            let frame = self.render(&step, camera);
            let png = encode_png(frame.width, frame.height, &frame.rgb)?;
            images.push(CameraImage { robot: world.robots()[robot].name.clone(), png_base64: Png(png) });
        }
        Ok(Observation {
            time_s: world.time_s(),
            states: robots.iter().map(|robot| robot_state(world, *robot)).collect(),
            cameras: robots
                .iter()
                .zip(&cameras)
                .map(|(robot, camera)| calibration(world, *robot, camera))
                .collect(),
            images,
        })
    }

    pub fn depth(
        &mut self,
        world: &World,
        robot: usize,
        pixels: &[[i64; 2]],
    ) -> Result<DepthReply, EpisodeError> {
        let step = world.present();
        let camera = self.cameras.egocentric(&step, robot);
        let (width, height) = (camera.width, camera.height);
        let outside = |[u, v]: [i64; 2]| u < 0 || v < 0 || u >= width.into() || v >= height.into();
        if let Some([u, v]) = pixels.iter().copied().find(|pixel| outside(*pixel)) {
            return Err(EpisodeError::PixelOutside { u, v, width, height });
        }
        let frame = self.render(&step, &camera);
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
        Ok(DepthReply { robot: world.robots()[robot].name.clone(), points: points.collect() })
    }
}

fn calibration(world: &World, robot: usize, camera: &Camera) -> CameraCalibration {
    let [cx, cy] = camera.principal_point_px();
    let focal_px = rounded(camera.focal_px().into());
    CameraCalibration {
        robot: world.robots()[robot].name.clone(),
        width: camera.width,
        height: camera.height,
        fx: focal_px,
        fy: focal_px,
        // The wire counts from the first pixel's centre, the camera from its corner.
        cx: f64::from(cx) - 0.5,
        cy: f64::from(cy) - 0.5,
        camera_in_pelvis: wire_pose_from_sim(&opencv_axes(&world.robot_state(robot).pelvis_from_camera)),
    }
}

pub fn robot_state(world: &World, robot: usize) -> RobotState {
    let state = world.robot_state(robot);
    let joints = &world.robots()[robot].model.joints;
    let named = |values: &[f32]| {
        JointValues(
            joints.iter().zip(values).map(|(joint, value)| (joint.name.clone(), f64::from(*value))).collect(),
        )
    };
    let down = state.world_from_pelvis.rotation.inverse() * Vector::new(0.0, 0.0, -1.0);
    RobotState {
        robot: world.robots()[robot].name.clone(),
        time_s: world.time_s(),
        joint_positions_rad: named(&state.q_rad),
        joint_velocities_rad_s: named(&state.qd_rad_s),
        joint_torques_n_m: named(&state.torque_n_m),
        left_wrist: wire_pose_from_sim(&state.pelvis_from_wrist.left),
        right_wrist: wire_pose_from_sim(&state.pelvis_from_wrist.right),
        gravity_in_pelvis: wire_vector(down),
        base_command: wire_base(&world.robots()[robot].base_command()),
        fallen: state.fallen,
    }
}
