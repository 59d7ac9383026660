//! The observer of an episode's world: renders its cameras, and measures depth at pixels.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Isometry3, Point3};
use tandem_sim::render::{Camera, CameraView, Cameras, Frame, RenderRequest, Renderer, object_id};
use tandem_sim::{Step, World};
use tandem_tools_spec::{
    Color, DepthReply, DepthRow, PixelRegion, PoseFrame, QueryDepth, SpecError, Surface, SurfaceQuery,
    Tool as _,
};

use super::fit;
use super::proprioception::{Detail, Proprioception, calibration, robot_state};
use super::scaling::{drawing_view, scaled_colours};
use super::surface::{self, CameraPoses};
use super::{Picture, RobotObservation, RobotView, TeamObservation};
use crate::EpisodeError;
use crate::commands::RobotSheet;
use crate::convert::{coarse, isometry_from_sim};
use crate::spec::EpisodeSpec;
use crate::stress;
use crate::tasks::told_name;

/// Renderer of one world's cameras.
pub struct Observer {
    renderer: Box<dyn Renderer>,
    pub cameras: Cameras,
    /// The task's objects and the parts that move on them.
    objects: Vec<NamedObject>,
    drawn: Option<DrawnStep>,
    /// Renderer of views for the recording alone; `None` while callers need the views.
    for_recording: Option<Arc<Mutex<Box<dyn Renderer>>>>,
}

/// An object of the task, or a part that moves on one.
struct NamedObject {
    /// Name in the description of the room. A part's name begins with the object's name.
    name: String,
    /// Name of the task's object: the object itself, or the one that the part belongs to.
    owner: String,
    /// Id in [`Frame::ids`].
    id: u32,
}

/// Rendered views of the latest observed step.
struct DrawnStep {
    /// Held so that its address stays unique.
    step: Arc<Step>,
    /// View of each robot's camera, once it is rendered.
    views: Vec<Option<Arc<RobotView>>>,
}

/// Returns the task's objects and the parts that move on them. A scene may contain other objects.
fn named_objects(spec: &EpisodeSpec, world: &World) -> Vec<NamedObject> {
    let is_part_of = |own: &str, object: &str| {
        own.strip_prefix(object).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
    };
    let owner_of = |own: &str| {
        let owners = spec.task.objects.iter().filter(|spot| is_part_of(own, &spot.name));
        owners.map(|spot| &spot.name).max_by_key(|name| name.len())
    };
    let models = world.object_models().enumerate();
    let named = models.filter_map(|(object, (own, _))| {
        let owner = told_name(owner_of(own)?);
        Some(NamedObject { name: told_name(own), owner, id: object_id(world, object) })
    });
    named.collect()
}

/// Returns a reply to `query_depth` without any measurement.
fn no_depth(robot: &str, frame: PoseFrame) -> DepthReply {
    DepthReply {
        robot: robot.into(),
        frame: Some(frame).filter(|frame| *frame != PoseFrame::Pelvis),
        surfaces: Vec::new(),
        fit: None,
        columns: DepthReply::COLUMNS.map(String::from).to_vec(),
        points: Vec::new(),
    }
}

/// Returns the renderer of the episode `spec`.
fn renderer(spec: &EpisodeSpec, world: &World) -> Box<dyn Renderer> {
    spec.renderer.renderer(stress::scenery(spec.stress, spec.world_seed(), world))
}

/// Returns the cameras of the episode `spec`.
pub fn cameras(spec: &EpisodeSpec, world: &World) -> Cameras {
    let mut cameras = stress::cameras(spec.stress, spec.world_seed(), world);
    cameras.set_model(spec.camera, spec.world_seed());
    cameras
}

impl Observer {
    /// Returns an observer of the world of the episode `spec`.
    pub fn new(spec: &EpisodeSpec, world: &World) -> Observer {
        let renderer = renderer(spec, world);
        let cameras = cameras(spec, world);
        let objects = named_objects(spec, world);
        Observer { renderer, cameras, objects, drawn: None, for_recording: None }
    }

    /// Switches to observations for the recording alone: its thread renders the images, without depth.
    pub fn draw_for_recording(&mut self, spec: &EpisodeSpec, world: &World) {
        self.for_recording = Some(Arc::new(Mutex::new(renderer(spec, world))));
    }

    /// Switches back to immediate rendering.
    pub fn draw_at_once(&mut self) {
        self.for_recording = None;
    }

    /// Returns the name of the renderer and of its device.
    pub fn renderer(&self) -> &str {
        self.renderer.name()
    }

    /// Renders views after `step`, in order.
    pub fn render_all(&mut self, step: &Step, views: &[CameraView]) -> Vec<Frame> {
        CameraView::render_all(views, &mut *self.renderer, step)
    }

    /// Renders a view after `step`.
    pub fn render(&mut self, step: &Step, view: &CameraView) -> Frame {
        view.render(&mut *self.renderer, step)
    }

    /// Renders the colours of the view of robot number `robot` after `step`, in this size.
    pub fn eye(&mut self, step: &Step, robot: usize, size_px: [u32; 2]) -> Vec<u8> {
        let view = drawing_view(self.cameras.eye(step, robot), size_px);
        let Camera { width, height, .. } = view.camera;
        scaled_colours(self.colours(step, &view), [width, height], size_px)
    }

    /// Returns true if [`Observer::eyes`] can render several worlds and is faster. Only ideal images are
    /// rendered together.
    pub fn draws_together(&self) -> bool {
        self.cameras.are_ideal() && self.renderer.draws_together()
    }

    /// Returns a request for the views of all robots after `step`, to be rendered together with other
    /// requests, and to be scaled to this size.
    pub fn eyes<'a>(&'a mut self, step: &'a Step, size_px: [u32; 2]) -> RenderRequest<'a> {
        let robots = 0..step.robots.len();
        let views = robots.map(|robot| drawing_view(self.cameras.eye(step, robot), size_px));
        let cameras = views.map(|view| view.camera).collect();
        RenderRequest { renderer: &mut *self.renderer, step, cameras }
    }

    /// Renders the colours of a view after `step`.
    pub fn colours(&mut self, step: &Step, view: &CameraView) -> Vec<u8> {
        view.render_colours(&mut *self.renderer, step)
    }

    /// Returns the views of these robots after `step`. Each view is rendered once; missing ones are
    /// rendered in parallel.
    pub fn views(&mut self, step: &Arc<Step>, robots: &[usize]) -> Vec<Arc<RobotView>> {
        let DrawnStep { views, .. } = match &mut self.drawn {
            Some(drawn) if Arc::ptr_eq(&drawn.step, step) => drawn,
            drawn => drawn.insert(DrawnStep { step: step.clone(), views: vec![None; step.robots.len()] }),
        };
        let missing: BTreeSet<usize> =
            robots.iter().copied().filter(|robot| views[*robot].is_none()).collect();
        let eyes: Vec<CameraView> = missing.iter().map(|robot| self.cameras.eye(step, *robot)).collect();
        // If all views have been rendered, the renderer need not even place the scenery.
        let frames = match eyes.is_empty() {
            true => Vec::new(),
            false => CameraView::render_all(&eyes, &mut *self.renderer, step),
        };
        for ((robot, eye), frame) in missing.into_iter().zip(&eyes).zip(frames) {
            views[robot] = Some(Arc::new(RobotView::new(eye.intrinsics(), frame)));
        }
        robots.iter().filter_map(|robot| views[*robot].clone()).collect()
    }

    /// Returns a view whose image is rendered by the recorder.
    fn view_for_recording(
        &self,
        renderer: &Arc<Mutex<Box<dyn Renderer>>>,
        step: &Arc<Step>,
        robot: usize,
    ) -> Arc<RobotView> {
        let eye = self.cameras.eye(step, robot);
        let (intrinsics, size_px) = (eye.intrinsics(), [eye.camera.width, eye.camera.height]);
        let (renderer, step) = (renderer.clone(), step.clone());
        let picture = Picture::drawn_later(size_px, move || {
            let mut renderer = renderer.lock().unwrap_or_else(PoisonError::into_inner);
            eye.render_colours(&mut **renderer, &step)
        });
        Arc::new(RobotView { intrinsics, picture: picture.into(), depth_m: Vec::new(), ids: Vec::new() })
    }

    /// Observes these robots after `step`; `sheets` describe all robots.
    pub fn observe(
        &mut self,
        step: &Arc<Step>,
        robots: &[usize],
        sheets: &[&RobotSheet],
        detail: Detail,
    ) -> TeamObservation {
        let views = match &self.for_recording {
            Some(renderer) => {
                robots.iter().map(|robot| self.view_for_recording(renderer, step, *robot)).collect()
            }
            None => self.views(step, robots),
        };
        let observe = |(&robot, view): (&usize, Arc<RobotView>)| {
            let own = Proprioception::of(step, robot);
            RobotObservation {
                state: robot_state(&own, sheets[robot], detail),
                calibration: calibration(own.sensed, &sheets[robot].name, &view.intrinsics),
                view,
            }
        };
        let robots = robots.iter().zip(views).map(observe).collect();
        TeamObservation { time_s: step.time_s, robots, shows_depth: false }
    }

    /// Returns the reply to `query_depth` for robot number `robot`, called `name`. The points are in
    /// `frame`, whose pose in the pelvis frame is `pelvis_from_frame`.
    pub fn depth(
        &mut self,
        step: &Arc<Step>,
        robot: usize,
        name: &str,
        pixels: &[[i64; 2]],
        (frame, pelvis_from_frame): (PoseFrame, Isometry3<f64>),
    ) -> Result<DepthReply, EpisodeError> {
        self.check_pixels(step, robot, pixels)?;
        let width = self.cameras.egocentric(step, robot).width;
        let view = self.views(step, &[robot]).swap_remove(0);
        let pelvis_from_camera = step.robots[robot].sensed.pelvis_from_camera;
        let points = pixels.iter().map(|&pixel| {
            let [u, v] = pixel;
            let depth_m = view.depth_m[v as usize * width as usize + u as usize];
            let point_m = pelvis_from_camera * view.intrinsics.unproject([u as f32, v as f32], depth_m);
            let point_m = pelvis_from_frame.inverse() * Point3::from(point_m.to_array().map(f64::from));
            DepthRow::new(pixel, depth_m.is_finite().then_some([point_m.x, point_m.y, point_m.z].map(coarse)))
        });
        Ok(DepthReply { points: points.collect(), ..no_depth(name, frame) })
    }

    /// Returns the reply to `query_depth` with the plane in a region of the view of robot number `robot`.
    ///
    /// # Errors
    ///
    /// [`SpecError::Invalid`] if no plane fills enough of the region, or if the region extends beyond the
    /// image.
    pub fn fit(
        &mut self,
        step: &Arc<Step>,
        robot: usize,
        name: &str,
        region: &PixelRegion,
        (frame, pelvis_from_frame): (PoseFrame, Isometry3<f64>),
    ) -> Result<DepthReply, EpisodeError> {
        self.check_pixels(step, robot, &[region.from, region.to])?;
        let view = self.views(step, &[robot]).swap_remove(0);
        let pelvis_from_camera = isometry_from_sim(&step.robots[robot].sensed.pelvis_from_camera);
        let frame_from_camera = pelvis_from_frame.inverse() * pelvis_from_camera;
        let fit = fit::fit(&view, [region.from, region.to], &frame_from_camera).ok_or_else(|| {
            let reason = "no plane fills a fifth of the region; name a smaller one on a flat surface".into();
            SpecError::Invalid { tool: QueryDepth::NAME, reason }
        })?;
        Ok(DepthReply { fit: Some(fit), ..no_depth(name, frame) })
    }

    /// Returns the reply to `query_depth` with a surface.
    pub fn surface(
        &mut self,
        step: &Arc<Step>,
        robot: usize,
        name: &str,
        query: &SurfaceQuery,
        (frame, pelvis_from_frame): (PoseFrame, Isometry3<f64>),
        pelvis_from_level: &Isometry3<f64>,
    ) -> Result<DepthReply, EpisodeError> {
        self.check_pixels(step, robot, query.pixel.as_slice())?;
        let view = self.views(step, &[robot]).swap_remove(0);
        if let Some([u, v]) = query.pixel.filter(|pixel| self.is_hole(&view, *pixel)) {
            return Err(EpisodeError::NoDepth { u, v });
        }
        let pelvis_from_camera = isometry_from_sim(&step.robots[robot].sensed.pelvis_from_camera);
        let poses = CameraPoses {
            frame_from_camera: pelvis_from_frame.inverse() * pelvis_from_camera,
            level_from_camera: pelvis_from_level.inverse() * pelvis_from_camera,
        };
        let surfaces = match query.object.as_deref() {
            Some(SurfaceQuery::ALL) => self.each_object(&view, &poses),
            Some(object) => {
                let found = surface::of_things(&view, &[self.object_ids(object)?], &poses);
                found.into_iter().map(|(_, surface)| surface).collect()
            }
            None => surface::find(&view, query, &poses),
        };
        if surfaces.is_empty() {
            let of = |color: &Color| SurfaceQuery { pixel: None, color: Some(*color), object: None };
            let seen = Color::ALL.into_iter().filter(|color| {
                query.color.is_some() && !surface::find(&view, &of(color), &poses).is_empty()
            });
            return Err(EpisodeError::NoSurface { query: query.clone(), seen: seen.collect() });
        }
        Ok(DepthReply { surfaces, ..no_depth(name, frame) })
    }

    /// Returns true if a pixel may show something although it has no depth.
    fn is_hole(&self, view: &RobotView, [u, v]: [i64; 2]) -> bool {
        let pixel = v as usize * view.picture.width as usize + u as usize;
        !self.cameras.are_ideal() && !view.depth_m[pixel].is_finite()
    }

    /// Returns the surface of each visible object of the task, including its parts.
    fn each_object(&self, view: &RobotView, poses: &CameraPoses) -> Vec<Surface> {
        let mut ids: BTreeMap<&str, BTreeSet<u32>> = BTreeMap::new();
        for object in &self.objects {
            ids.entry(&object.owner).or_default().insert(object.id);
        }
        let (names, ids): (Vec<&str>, Vec<BTreeSet<u32>>) = ids.into_iter().unzip();
        let found = surface::of_things(view, &ids, poses).into_iter();
        found.map(|(index, surface)| Surface { object: Some(names[index].into()), ..surface }).collect()
    }

    /// Returns the ids of an object and its parts, or of a part, by its name.
    fn object_ids(&self, name: &str) -> Result<BTreeSet<u32>, EpisodeError> {
        let asked = told_name(name);
        let part = format!("{asked} ");
        // A separate object may have a longer name: a basket and a basket patch.
        let is_it = |object: &&NamedObject| {
            object.name == asked || object.name.starts_with(&part) && !object.owner.starts_with(&part)
        };
        let ids: BTreeSet<u32> = self.objects.iter().filter(is_it).map(|object| object.id).collect();
        match ids.is_empty() {
            false => Ok(ids),
            true => {
                let have: Vec<&str> = self.objects.iter().map(|object| object.name.as_str()).collect();
                let reason = format!("surface.object: there is no {name:?}; have: {}", have.join(", "));
                Err(SpecError::Invalid { tool: QueryDepth::NAME, reason }.into())
            }
        }
    }

    fn check_pixels(&self, step: &Step, robot: usize, pixels: &[[i64; 2]]) -> Result<(), EpisodeError> {
        let Camera { width, height, .. } = self.cameras.egocentric(step, robot);
        let outside = |[u, v]: [i64; 2]| u < 0 || v < 0 || u >= width.into() || v >= height.into();
        match pixels.iter().copied().find(|pixel| outside(*pixel)) {
            Some([u, v]) => Err(EpisodeError::PixelOutside { u, v, width, height }),
            None => Ok(()),
        }
    }

    /// Renders the scene's camera that sees all robots.
    pub fn third_person(&mut self, step: &Step) -> Picture {
        let room = self.cameras.third_person().into();
        let Frame { width, height, rgb, .. } = self.render(step, &room);
        Picture::new(width, height, rgb)
    }
}
