//! Colour and depth images of every camera from a recording: the second stage of a pipeline that records
//! states first.
//!
//! Files: `CAMERA/rgb/STEP.png`, 8 bits per channel; `CAMERA/depth/STEP.png`, 16 bits, millimetres along
//! the optical axis, 0 for no surface or more than 65.535 m. `pictures.json` has the episode's spec and the
//! intrinsics; `poses.json` has the pose of each camera at each image. Every file is whole or absent, so a
//! run that was stopped can continue.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use tandem_sim::render::{
    Camera, CameraModel, DEPTH_UNIT_M, Frame, Intrinsics, PictureError, RendererKind, encode_depth_png,
};
use tandem_sim::{Pose, Step};
use tandem_tools_spec::LensDistortion;

use super::video::step_of_picture;
use super::{EpisodeCamera, EpisodeRenderer, PictureSize, ReplayError};
use crate::convert::{opencv_axes, wire_distortion};
use crate::observation::Picture;
use crate::output::{OutputError, create_private_folder, write_whole};
use crate::recording::Recording;
use crate::spec::EpisodeSpec;
use crate::tasks::Task;

/// Plan of the images to render.
#[derive(Clone, Debug)]
pub struct PicturesPlan {
    /// Images per second of each camera.
    pub rate_hz: u32,
    /// Size of every camera's images; `None` for the camera's own.
    pub size: Option<PictureSize>,
    /// Number of rendering threads.
    pub jobs: usize,
    /// Names of the cameras; empty for all of the task's.
    pub cameras: Vec<String>,
    /// True if depth is rendered, too.
    pub depth: bool,
    /// The renderer; `None` for the recorded episode's renderer.
    pub renderer: Option<RendererKind>,
    /// The model of the head cameras; `None` for the recorded episode's model.
    pub camera: Option<CameraModel>,
}

impl Default for PicturesPlan {
    fn default() -> PicturesPlan {
        PicturesPlan {
            rate_hz: 25,
            size: None,
            jobs: 1,
            cameras: Vec::new(),
            depth: true,
            renderer: None,
            camera: None,
        }
    }
}

impl PicturesPlan {
    /// Returns the task's cameras that are rendered.
    fn views(&self, task: &Task) -> Result<Vec<EpisodeCamera>, PicturesError> {
        match &self.cameras[..] {
            [] => Ok(EpisodeCamera::all(task)),
            names => {
                let found = names.iter().map(|name| EpisodeCamera::find(name, task));
                found.collect::<Result<_, _>>().map_err(PicturesError::NoCamera)
            }
        }
    }

    /// Returns the spec of the recording with the plan's renderer and model of cameras.
    fn spec(&self, recording: &Recording) -> EpisodeSpec {
        let spec = recording.spec.clone();
        EpisodeSpec {
            renderer: self.renderer.unwrap_or(spec.renderer),
            camera: self.camera.unwrap_or(spec.camera),
            ..spec
        }
    }
}

/// Counts of rendered images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawnPictures {
    /// Moments at which every camera has an image.
    pub moments: usize,
    /// Number of moments that an earlier run had rendered.
    pub already_drawn: usize,
    pub cameras: usize,
}

/// Reason why images are missing. Rendered images are kept, and the next run continues from there.
#[derive(Debug, thiserror::Error)]
pub enum PicturesError {
    #[error("{} holds pictures of another recording, rate or size; give another folder", .0.display())]
    OtherPictures(PathBuf),
    #[error("{0}")]
    NoCamera(String),
    #[error("a picture cannot be encoded: {0}")]
    Picture(#[from] PictureError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Replay(Box<ReplayError>),
}

impl From<ReplayError> for PicturesError {
    fn from(error: ReplayError) -> PicturesError {
        PicturesError::Replay(error.into())
    }
}

/// The content of `pictures.json`.
#[derive(PartialEq, Serialize, Deserialize)]
struct Manifest {
    spec: EpisodeSpec,
    /// Hash of the state in which the episode ended, or of its last recorded state.
    state_hash: String,
    rate_hz: u32,
    /// Depth unit; `None` without depth images.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    depth_unit_m: Option<f64>,
    cameras: Vec<CameraEntry>,
}

/// A camera and its [`Intrinsics`].
#[derive(PartialEq, Serialize, Deserialize)]
struct CameraEntry {
    name: String,
    width: u32,
    height: u32,
    focal_px: f32,
    cx: f32,
    cy: f32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    distortion: Option<LensDistortion>,
}

/// Pose of a camera, an entry of `poses.json`: x right, y down, z along the optical axis, as in OpenCV.
#[derive(Serialize)]
struct CameraPose {
    control_step: u64,
    time_s: f64,
    camera: &'static str,
    position_m: [f32; 3],
    quaternion_wxyz: [f32; 4],
}

const MANIFEST: &str = "pictures.json";
const POSES: &str = "poses.json";

/// Renders the images that `folder` does not hold yet, on several threads.
///
/// # Errors
///
/// If the folder holds other images, a camera is unknown, or an image cannot be rendered or written.
pub fn draw_all(
    recording: &Recording,
    plan: &PicturesPlan,
    folder: &Path,
    progress: &(dyn Fn() + Sync),
) -> Result<DrawnPictures, PicturesError> {
    let steps = moments(recording, plan.rate_hz)?;
    let task = &recording.spec.task;
    let views = plan.views(task)?;
    let spec = plan.spec(recording);
    let scene = EpisodeRenderer::of(&spec).map_err(ReplayError::from)?;
    prepare(recording, plan, folder, &scene, &steps)?;
    let poses: Vec<CameraPose> = steps
        .iter()
        .flat_map(|step| views.iter().map(move |view| (step, *view)))
        .map(|(step, view)| camera_pose(step, view.name(task), &scene.view(view, step, plan.size).camera))
        .collect();
    write_whole(&folder.join(POSES), &serde_json::to_vec(&poses).map_err(OutputError::from)?)?;
    let already_drawn = AtomicUsize::new(0);
    let next = AtomicUsize::new(0);
    let failure: Mutex<Option<PicturesError>> = Mutex::new(None);
    let work = || -> Result<(), PicturesError> {
        let mut scene = EpisodeRenderer::of(&spec).map_err(ReplayError::from)?;
        while let Some(step) = steps.get(next.fetch_add(1, Ordering::Relaxed)) {
            let before = views.iter().all(|view| PictureFiles::of(folder, view.name(task), step).exist(plan));
            already_drawn.fetch_add(usize::from(before), Ordering::Relaxed);
            if !before {
                views.iter().try_for_each(|view| draw(&mut scene, *view, step, plan, folder, task))?;
            }
            progress();
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        for _ in 0..plan.jobs.max(1) {
            scope.spawn(|| {
                if let Err(error) = work() {
                    // No other thread begins another moment.
                    next.store(steps.len(), Ordering::Relaxed);
                    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                }
            });
        }
    });
    match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(error) => Err(error),
        None => Ok(DrawnPictures {
            moments: steps.len(),
            already_drawn: already_drawn.into_inner(),
            cameras: views.len(),
        }),
    }
}

/// Returns the steps that are rendered.
fn moments(recording: &Recording, rate_hz: u32) -> Result<Vec<Step>, ReplayError> {
    let mut moments = Vec::new();
    for (index, step) in recording.steps().enumerate() {
        let step = step?;
        if index >= step_of_picture(moments.len(), rate_hz) {
            moments.push(step);
        }
    }
    Ok(moments)
}

/// Creates the folders, and checks that the images already there are of the same kind.
fn prepare(
    recording: &Recording,
    plan: &PicturesPlan,
    folder: &Path,
    scene: &EpisodeRenderer,
    steps: &[Step],
) -> Result<(), PicturesError> {
    let task = &recording.spec.task;
    let entry = |view: EpisodeCamera, step: &Step| {
        let Intrinsics { width, height, focal_px, cx, cy, distortion } =
            scene.view(view, step, plan.size).intrinsics();
        let distortion = wire_distortion(&distortion);
        CameraEntry { name: view.name(task).into(), width, height, focal_px, cx, cy, distortion }
    };
    let views = plan.views(task)?.into_iter();
    let state_hash = recording.state_hashes().last();
    let (_, state_hash) = state_hash.transpose().map_err(ReplayError::from)?.unwrap_or_default();
    let manifest = Manifest {
        spec: plan.spec(recording),
        state_hash,
        rate_hz: plan.rate_hz,
        depth_unit_m: plan.depth.then_some(DEPTH_UNIT_M),
        cameras: views.filter_map(|view| Some(entry(view, steps.first()?))).collect(),
    };
    let path = folder.join(MANIFEST);
    if let Ok(bytes) = std::fs::read(&path) {
        let there: Option<Manifest> = serde_json::from_slice(&bytes).ok();
        return match there == Some(manifest) {
            true => Ok(()),
            false => Err(PicturesError::OtherPictures(folder.into())),
        };
    }
    for camera in &manifest.cameras {
        for kind in ["rgb", "depth"].into_iter().take(1 + usize::from(plan.depth)) {
            let path = folder.join(&camera.name).join(kind);
            create_private_folder(&path).map_err(|source| OutputError::Io { path, source })?;
        }
    }
    let text = serde_json::to_vec_pretty(&manifest).map_err(OutputError::from)?;
    Ok(write_whole(&path, &text)?)
}

fn camera_pose(step: &Step, name: &'static str, camera: &Camera) -> CameraPose {
    let pose: Pose = opencv_axes(&camera.world_from_camera);
    let q = pose.rotation;
    CameraPose {
        control_step: step.control_step,
        time_s: step.time_s,
        camera: name,
        position_m: pose.translation.to_array(),
        quaternion_wxyz: [q.w, q.x, q.y, q.z],
    }
}

/// The files of one camera at one moment; depth is written last.
struct PictureFiles {
    rgb: PathBuf,
    depth: PathBuf,
}

impl PictureFiles {
    fn of(folder: &Path, camera: &str, step: &Step) -> PictureFiles {
        let file = |kind: &str| folder.join(camera).join(kind).join(format!("{:06}.png", step.control_step));
        PictureFiles { rgb: file("rgb"), depth: file("depth") }
    }

    fn exist(&self, plan: &PicturesPlan) -> bool {
        self.rgb.exists() && (!plan.depth || self.depth.exists())
    }
}

fn draw(
    scene: &mut EpisodeRenderer,
    view: EpisodeCamera,
    step: &Step,
    plan: &PicturesPlan,
    folder: &Path,
    task: &Task,
) -> Result<(), PicturesError> {
    let files = PictureFiles::of(folder, view.name(task), step);
    if files.exist(plan) {
        return Ok(());
    }
    if !plan.depth {
        return Ok(write_whole(&files.rgb, &scene.colours(view, step, plan.size).png()?)?);
    }
    let drawn = scene.view(view, step, plan.size);
    let Frame { width, height, rgb, depth_m, .. } = scene.draw(step, &drawn);
    let picture = match plan.size {
        None => Picture::new(width, height, rgb),
        size => scene.colours(view, step, size),
    };
    write_whole(&files.rgb, &picture.png()?)?;
    Ok(write_whole(&files.depth, &encode_depth_png(width, height, &depth_m)?)?)
}
