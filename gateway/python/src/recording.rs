//! Recordings as arrays, and new renderings of their steps.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use numpy::{PyArray3, PyArray4};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;
use tandem_episodes::replay::{EpisodeCamera, EpisodeRenderer, PictureSize};
use tandem_episodes::rows::{ActionKind, STATE_COLUMNS, state_row};
use tandem_episodes::{Grip, RecordedSetpoints, Recording, RecordingError};
use tandem_sim::render::{CameraModel, Frame, RendererKind};
use tandem_sim::{CONTROL_DT_S, JOINTS, Side, Step};
use tandem_tools_spec::{ACTION_ROW_LEN, DRIVE_ROW_LEN};

use crate::arrays::{Colours, Depths, action_row, pose_row, shaped, vector_row};
use crate::refusal::{failed, refused};
use crate::worlds::contract_json;

/// A recording in memory.
#[pyclass(frozen, name = "Recording", module = "tandem._native")]
pub struct NativeRecording {
    recording: Recording,
    steps: Vec<Step>,
    /// Renderer, created for the first image.
    renderer: Mutex<Option<EpisodeRenderer>>,
}

#[pymethods]
impl NativeRecording {
    /// Reads a file and checks every byte. Images are rendered by the named renderer with the named model of
    /// the head cameras. Without names, they are rendered like those of the episode.
    #[staticmethod]
    fn read(
        py: Python,
        path: PathBuf,
        renderer: Option<&str>,
        camera: Option<&str>,
    ) -> PyResult<NativeRecording> {
        let renderer =
            renderer.map(|name| found(py, "renderer", RendererKind::ALL, RendererKind::name, name));
        let renderer = renderer.transpose()?;
        let camera = camera.map(|name| found(py, "camera model", CameraModel::ALL, CameraModel::name, name));
        let camera = camera.transpose()?;
        let read = || {
            let mut recording = Recording::read(&path)?;
            recording.spec.renderer = renderer.unwrap_or(recording.spec.renderer);
            recording.spec.camera = camera.unwrap_or(recording.spec.camera);
            let steps = recording.steps().collect::<Result<_, _>>()?;
            Ok(NativeRecording { recording, steps, renderer: Mutex::default() })
        };
        py.detach(read).map_err(|error: RecordingError| failed(py, &error))
    }

    /// Returns the description of the recording as JSON: episode, build, controller, result, phases,
    /// names of objects and cameras, and calls.
    fn about(&self, py: Python) -> PyResult<String> {
        let Recording { spec, locomotion, build, result, .. } = &self.recording;
        let calls = self.recording.tool_calls().map_err(|error| failed(py, &error))?;
        let calls = calls.iter().map(|call| {
            let (reply, problem) = (call.outcome.as_ref().ok(), call.outcome.as_ref().err());
            let reply = reply.and_then(|text| serde_json::from_str::<serde_json::Value>(text).ok());
            json!({
                "time_s": call.time_s,
                "thought_s": call.thought.as_secs_f64(),
                "tool": call.tool,
                "arguments": call.arguments,
                "operator": call.operator,
                "reply": reply,
                "problem": problem,
            })
        });
        let objects = self.steps.first().map_or(&[][..], |step| &step.objects[..]);
        let (task, words) = (&spec.task, spec.task_words());
        let about = json!({
            "spec": spec,
            "locomotion": locomotion,
            "build": build,
            "result": result,
            "phases": self.recording.phases().map_err(|error| failed(py, &error))?,
            "instruction": words.joint,
            "instructions": task.robot_names().zip(&words.robots).collect::<BTreeMap<_, _>>(),
            "robots": task.robots.iter().map(|robot| robot.name).collect::<Vec<_>>(),
            "objects": objects.iter().map(|object| &object.name).collect::<Vec<_>>(),
            "cameras": EpisodeCamera::all(task).iter().map(|camera| camera.name(task)).collect::<Vec<_>>(),
            "calls": calls.collect::<Vec<_>>(),
        });
        Ok(about.to_string())
    }

    /// Returns the layout of a robot's rows as JSON.
    fn row_contract(&self, py: Python) -> PyResult<String> {
        contract_json(py, &self.recording.spec, ActionKind::Joints)
    }

    /// Returns the hash of every state, including the one before the first step.
    fn state_hashes(&self, py: Python) -> PyResult<Vec<String>> {
        let hashes = self.recording.state_hashes().map(|hash| hash.map(|(_, hash)| hash));
        hashes.collect::<Result<_, _>>().map_err(|error| failed(py, &error))
    }

    /// Returns the values of all steps by name. The first entry is the state before the first step.
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = py.detach(|| Columns::of(&self.steps));
        columns.arrays(py)
    }

    /// Returns the setpoints of a robot's motors at the end of every step, 5 by 43; NaN where the robot's own
    /// controller drives it. Returns `None` if that controller drives it in all steps.
    fn motor_setpoints<'py>(
        &self,
        py: Python<'py>,
        robot: &str,
    ) -> PyResult<Option<Bound<'py, PyArray3<f32>>>> {
        let driven = self.recording.motor_setpoints(robot).map_err(|error| failed(py, &error))?;
        if driven.is_empty() {
            return Ok(None);
        }
        let blocks = DRIVE_ROW_LEN / JOINTS;
        let mut setpoints = vec![f32::NAN; self.steps.len() * DRIVE_ROW_LEN];
        for RecordedSetpoints { time_s, rows } in &driven {
            let step =
                self.steps.partition_point(|step| step.time_s < time_s - 0.5 * f64::from(CONTROL_DT_S));
            let place = setpoints.chunks_exact_mut(DRIVE_ROW_LEN).nth(step);
            if let (Some(place), Some(row)) = (place, rows.last().filter(|row| row.len() == DRIVE_ROW_LEN)) {
                place.copy_from_slice(row);
            }
        }
        shaped(py, &setpoints, [self.steps.len(), blocks, JOINTS]).map(Some)
    }

    /// Returns the grip of each hand of each robot on each object at every step, as in the scoring: 0 for
    /// none, 1 for touching, 2 for holding.
    fn grips<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray4<u8>>> {
        let grips = py.detach(|| self.all_grips()).map_err(|error| failed(py, &error))?;
        let (robots, objects) =
            self.steps.first().map_or((0, 0), |step| (step.robots.len(), step.objects.len()));
        shaped(py, &grips, [self.steps.len(), robots, 2, objects])
    }

    /// Renders the colours and depth of a camera after a step. The size is the camera's size, or another
    /// width and height.
    fn picture<'py>(
        &self,
        py: Python<'py>,
        camera: &str,
        step: usize,
        size: Option<(u32, u32)>,
    ) -> PyResult<(Colours<'py>, Depths<'py>)> {
        let draw = |renderer: &mut EpisodeRenderer, camera, step: &Step, size| {
            let view = renderer.view(camera, step, size);
            renderer.draw(step, &view)
        };
        let Frame { width, height, rgb, depth_m, .. } = self.drawn(py, camera, step, size, draw)?;
        let (height, width) = (height as usize, width as usize);
        Ok((shaped(py, &rgb, [height, width, 3])?, shaped(py, &depth_m, [height, width])?))
    }

    /// Renders only the colours, like an image for a policy that requests this size.
    fn colours<'py>(
        &self,
        py: Python<'py>,
        camera: &str,
        step: usize,
        size: Option<(u32, u32)>,
    ) -> PyResult<Colours<'py>> {
        let picture = self.drawn(py, camera, step, size, |renderer, camera, step, size| {
            renderer.colours(camera, step, size)
        })?;
        shaped(py, picture.rgb(), [picture.height as usize, picture.width as usize, 3])
    }
}

/// Returns the element of `all` with this name.
fn found<T: Copy, const N: usize>(
    py: Python,
    what: &str,
    all: [T; N],
    name_of: fn(T) -> &'static str,
    name: &str,
) -> PyResult<T> {
    let names = all.map(name_of).join(", ");
    let found = all.into_iter().find(|one| name_of(*one) == name);
    found.ok_or_else(|| failed(py, &format!("no {what} {name:?}; have: {names}")))
}

impl NativeRecording {
    /// Renders the state after a step with `draw`.
    fn drawn<T: Send>(
        &self,
        py: Python,
        camera: &str,
        step: usize,
        size: Option<(u32, u32)>,
        draw: impl FnOnce(&mut EpisodeRenderer, EpisodeCamera, &Step, Option<PictureSize>) -> T + Send,
    ) -> PyResult<T> {
        let spec = &self.recording.spec;
        let camera = EpisodeCamera::find(camera, &spec.task).map_err(|text| failed(py, &text))?;
        let Some(step) = self.steps.get(step) else {
            let last = self.steps.len().saturating_sub(1);
            return Err(failed(py, &format!("no step {step} in this recording; have 0 to {last}")));
        };
        let size = size.map(|(width, height)| PictureSize { width, height });
        let drawn = py.detach(|| {
            let mut renderer = self.renderer.lock().unwrap_or_else(PoisonError::into_inner);
            let renderer = match &mut *renderer {
                Some(made) => made,
                none => none.insert(EpisodeRenderer::of(spec)?),
            };
            Ok(draw(renderer, camera, step, size))
        });
        drawn.map_err(|error: tandem_episodes::EpisodeError| refused(py, &error.into()))
    }

    /// Returns grips by step, robot, hand (left, right) and object. There is no grip before the first step.
    fn all_grips(&self) -> Result<Vec<u8>, RecordingError> {
        let Some(start) = self.steps.first() else { return Ok(Vec::new()) };
        let spec = &self.recording.spec;
        let mut scores = spec.task.scores(&spec.robot.model()?, start)?;
        let mut grips = vec![0; start.robots.len() * 2 * start.objects.len()];
        for step in &self.steps[1..] {
            let facts = scores.update(step).facts;
            for robot in 0..step.robots.len() {
                for side in Side::BOTH {
                    grips.extend(step.objects.iter().map(|object| {
                        let facts = facts.objects.iter().find(|facts| facts.name == object.name);
                        match facts.map(|facts| facts.hands[robot][side]) {
                            None | Some(Grip::Off) => 0,
                            Some(Grip::Touching) => 1,
                            Some(Grip::Holding) => 2,
                        }
                    }));
                }
            }
        }
        Ok(grips)
    }
}

/// Values of all steps, step by step.
#[derive(Default)]
struct Columns {
    shape: (usize, usize, usize),
    time_s: Vec<f64>,
    q_rad: Vec<f32>,
    qd_rad_s: Vec<f32>,
    torque_n_m: Vec<f32>,
    action: Vec<f32>,
    state: Vec<f32>,
    pelvis_in_world: Vec<f32>,
    pelvis_in_start: Vec<f32>,
    wrists_in_pelvis: Vec<f32>,
    wrists_in_world: Vec<f32>,
    hand_force_n: Vec<f32>,
    fallen: Vec<bool>,
    objects_in_world: Vec<f32>,
    contact_force_n: Vec<f32>,
}

impl Columns {
    fn of(steps: &[Step]) -> Columns {
        let (robots, objects) = steps.first().map_or((0, 0), |step| (step.robots.len(), step.objects.len()));
        let mut columns = Columns { shape: (steps.len(), robots, objects), ..Columns::default() };
        columns.contact_force_n = vec![0.0; steps.len() * robots * objects * HAND_NUMBERS * 2];
        steps.iter().enumerate().for_each(|(index, step)| columns.add(index, step));
        columns
    }

    fn add(&mut self, index: usize, step: &Step) {
        let (_, robots, objects) = self.shape;
        self.time_s.push(step.time_s);
        for robot in &step.robots {
            let (sensed, truth) = (&robot.sensed, &robot.truth);
            self.q_rad.extend(sensed.joints.q_rad);
            self.qd_rad_s.extend(sensed.joints.qd_rad_s);
            self.torque_n_m.extend(sensed.joints.torque_n_m);
            self.action.extend(action_row(&robot.command));
            self.state.extend(state_row(robot));
            self.pelvis_in_world.extend(pose_row(&truth.world_from_pelvis()));
            self.pelvis_in_start.extend(pose_row(&sensed.start_from_pelvis));
            let forces_n = robot.hand_force_in_world_n();
            for side in Side::BOTH {
                self.wrists_in_pelvis.extend(pose_row(&sensed.pelvis_from_wrist[side]));
                self.wrists_in_world.extend(pose_row(&truth.world_from_wrist[side]));
                self.hand_force_n.extend(vector_row(forces_n[side]));
            }
            self.fallen.push(truth.fallen);
        }
        for object in &step.objects {
            self.objects_in_world.extend(pose_row(&object.state.world_from_object));
        }
        for touch in &step.touches {
            let hand = (index * robots + touch.robot) * 2
                + Side::BOTH.iter().position(|side| *side == touch.side).unwrap_or(0);
            let first = (hand * objects + touch.object) * HAND_NUMBERS;
            let parts =
                [touch.contacts.thumb_n, touch.contacts.fingers_n, touch.contacts.palm_n].map(vector_row);
            self.contact_force_n[first..first + HAND_NUMBERS].copy_from_slice(parts.as_flattened());
        }
    }

    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (steps, robots, objects) = self.shape;
        let arrays = PyDict::new(py);
        arrays.set_item("time_s", shaped(py, &self.time_s, [steps])?)?;
        arrays.set_item("q_rad", shaped(py, &self.q_rad, [steps, robots, JOINTS])?)?;
        arrays.set_item("qd_rad_s", shaped(py, &self.qd_rad_s, [steps, robots, JOINTS])?)?;
        arrays.set_item("torque_n_m", shaped(py, &self.torque_n_m, [steps, robots, JOINTS])?)?;
        arrays.set_item("actions", shaped(py, &self.action, [steps, robots, ACTION_ROW_LEN])?)?;
        arrays.set_item("states", shaped(py, &self.state, [steps, robots, STATE_COLUMNS])?)?;
        arrays.set_item("pelvis_in_world", shaped(py, &self.pelvis_in_world, [steps, robots, 7])?)?;
        arrays.set_item("pelvis_in_start", shaped(py, &self.pelvis_in_start, [steps, robots, 7])?)?;
        arrays.set_item("wrists_in_pelvis", shaped(py, &self.wrists_in_pelvis, [steps, robots, 2, 7])?)?;
        arrays.set_item("wrists_in_world", shaped(py, &self.wrists_in_world, [steps, robots, 2, 7])?)?;
        arrays.set_item("hand_force_n", shaped(py, &self.hand_force_n, [steps, robots, 2, 3])?)?;
        arrays.set_item("fallen", shaped(py, &self.fallen, [steps, robots])?)?;
        arrays.set_item("objects_in_world", shaped(py, &self.objects_in_world, [steps, objects, 7])?)?;
        let contacts = shaped(py, &self.contact_force_n, [steps, robots, 2, objects, 3, 3])?;
        arrays.set_item("contact_force_n", contacts)?;
        Ok(arrays)
    }
}

/// Number of contact force values of a hand: three values each for thumb, fingers and palm.
const HAND_NUMBERS: usize = 9;
