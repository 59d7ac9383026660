//! Loading and running of a velocity policy's ONNX file, and the tensors that it must have.
//!
//! The network takes `root_link_quat_w`, `root_ang_vel_b`, `velocity_commands`, `joint_pos` and `joint_vel`.
//! It returns `action_joint_pos`, `action_joint_pos_kp_gains` and `action_joint_pos_kd_gains`. Every other
//! input `X` (last actions, histories) is a memory: the output `X_out` is its value at the next step.

use std::error::Error;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use prost::Message;
use rten::{Dimension, LoadErrorKind, Model, NodeId, RunOptions, ThreadPool, Value, ValueView};
use rten_tensor::{Layout, Tensor};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::joints::{CONTROLLED_JOINTS, OBSERVED_JOINTS};
use crate::SimError;
use crate::user_file::read_bytes;

/// Maximum size of a network's file in bytes.
const MAX_NETWORK_BYTES: u64 = 1 << 30;

const ORIENTATION: &str = "root_link_quat_w";
const ANGULAR_VELOCITY: &str = "root_ang_vel_b";
const COMMAND: &str = "velocity_commands";
const POSITIONS: &str = "joint_pos";
const VELOCITIES: &str = "joint_vel";
const SENSED: [(&str, usize); 5] = [
    (ORIENTATION, 4),
    (ANGULAR_VELOCITY, 3),
    (COMMAND, 3),
    (POSITIONS, OBSERVED_JOINTS),
    (VELOCITIES, OBSERVED_JOINTS),
];
/// Names of the outputs for targets (rad), stiffness (N m/rad) and damping (N m s/rad).
const ACTIONS: [&str; 3] = ["action_joint_pos", "action_joint_pos_kp_gains", "action_joint_pos_kd_gains"];
/// Suffix of a memory's output, after the name of its input.
const FED_BACK: &str = "_out";
/// Number of warm-up steps: more than the five frames of a history, so that the actions in it have settled.
const STEPS_TO_REMEMBER: usize = 25;

/// Observation of the network at one control step.
#[derive(Clone, Debug)]
pub(super) struct NetworkInputs {
    /// Orientation of the pelvis in the world.
    pub quaternion_wxyz: [f32; 4],
    /// Angular velocity of the pelvis, in its own frame.
    pub angular_velocity_rad_s: [f32; 3],
    /// Forward m/s, left m/s, turning rad/s.
    pub velocity_command: [f32; 3],
    /// Joint angles, in the order of [`super::joints::OBSERVED`].
    pub q_rad: [f32; OBSERVED_JOINTS],
    pub qd_rad_s: [f32; OBSERVED_JOINTS],
}

/// Targets and gains of the joints, in the order of [`super::joints::CONTROLLED`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Action {
    pub target_rad: [f32; CONTROLLED_JOINTS],
    pub kp_n_m_rad: [f32; CONTROLLED_JOINTS],
    pub kd_n_m_s_rad: [f32; CONTROLLED_JOINTS],
}

/// Values of the memory inputs, in the order of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct RecurrentState(pub(super) Vec<Vec<f32>>);

/// A checked file, ready to run. Robots share it; each has its own `RecurrentState`.
pub struct Network {
    name: String,
    model: Model,
    inputs: Vec<Input>,
    /// Outputs: those of [`ACTIONS`], then the next values of the memories.
    outputs: Vec<NodeId>,
    /// Shapes of the memories.
    memories: Vec<Vec<usize>>,
    /// One thread: the layers are too small to distribute, and sums do not depend on the number of cores.
    thread: Arc<ThreadPool>,
}

struct Input {
    node: NodeId,
    source: Source,
}

enum Source {
    Sensed(&'static str),
    Recurrent(usize),
}

/// The result of a run, which may fail.
type RunResult<T> = Result<T, Box<dyn Error + Send + Sync>>;

impl Network {
    /// Reads a file, checks names and shapes, and runs it once.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be read, is not ONNX, has other tensors or shapes, or does
    /// not run.
    pub fn from_file(path: &Path) -> Result<Network, SimError> {
        let file = path.display().to_string();
        let bytes = read_bytes(path, MAX_NETWORK_BYTES)
            .map_err(|source| SimError::Read { path: file.clone(), source })?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = format!("{name}+{:016x}", xxh3_64(&bytes));
        let model = load(&file, bytes)?;
        let network = Network::check(&file, name, model)?;
        let still = NetworkInputs {
            quaternion_wxyz: [1.0, 0.0, 0.0, 0.0],
            angular_velocity_rad_s: [0.0; 3],
            velocity_command: [0.0; 3],
            q_rad: [0.0; OBSERVED_JOINTS],
            qd_rad_s: [0.0; OBSERVED_JOINTS],
        };
        let not_runnable = |source| SimError::NotRunnable { path: file.clone(), source };
        let outputs = network.evaluate(&still, &network.blank()).map_err(not_runnable)?;
        network.expect_outputs(&file, &outputs)?;
        let (action, _) = network.split(outputs).map_err(not_runnable)?;
        if !action.usable() {
            return Err(SimError::PolicyOutput { path: file });
        }
        Ok(network)
    }

    /// Returns the file's name without its folders, and a hash of its content.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Finds every tensor by its name and checks the inputs' shapes.
    fn check(file: &str, name: String, model: Model) -> Result<Network, SimError> {
        let (input_names, output_names) =
            (names(&model, model.input_ids()), names(&model, model.output_ids()));
        let missing = |kind, tensor: &str, have: &[String]| SimError::MissingTensor {
            path: file.into(),
            kind,
            tensor: tensor.into(),
            have: have.join(", "),
        };
        if let Some((name, _)) = SENSED.iter().find(|(name, _)| !input_names.iter().any(|have| have == name))
        {
            return Err(missing("input", name, &input_names));
        }
        let output = |name: &str| {
            let found = output_names.iter().position(|output| output == name);
            found.map(|index| model.output_ids()[index]).ok_or_else(|| missing("output", name, &output_names))
        };
        let mut outputs = ACTIONS.into_iter().map(output).collect::<Result<Vec<_>, _>>()?;
        let mut inputs = Vec::with_capacity(input_names.len());
        let mut memories = Vec::new();
        for (index, (name, node)) in input_names.iter().zip(model.input_ids()).enumerate() {
            let have = input_shape(&model, index);
            let source = match SENSED.iter().find(|(sensed, _)| sensed == name) {
                Some((sensed, width)) => {
                    expect_shape(file, "input", name, &have, &[1, *width])?;
                    Source::Sensed(sensed)
                }
                None => {
                    outputs.push(output(&format!("{name}{FED_BACK}"))?);
                    memories.push(have);
                    Source::Recurrent(memories.len() - 1)
                }
            };
            inputs.push(Input { node: *node, source });
        }
        let thread = Arc::new(ThreadPool::with_num_threads(1));
        Ok(Network { name, model, inputs, outputs, memories, thread })
    }

    /// Checks that the outputs of a run match the joints, and the memories that they are fed back into.
    fn expect_outputs(&self, file: &str, values: &[Value]) -> Result<(), SimError> {
        let action = [1, CONTROLLED_JOINTS];
        let expected = ACTIONS.iter().map(|_| &action[..]).chain(self.memories.iter().map(Vec::as_slice));
        for ((name, value), expected) in names(&self.model, &self.outputs).iter().zip(values).zip(expected) {
            expect_shape(file, "output", name, &value.shape(), expected)?;
        }
        Ok(())
    }

    /// Returns the memory of a robot that has stood as in `observation` for half a second and has followed
    /// the policy's actions. Without this warm-up, the policy would throw the robot into its own stance, with
    /// a hop of a third of a metre.
    pub(super) fn remember(&self, observation: &NetworkInputs) -> RunResult<RecurrentState> {
        let mut memory = self.blank();
        for _ in 0..STEPS_TO_REMEMBER {
            memory = self.run(observation, &memory)?.1;
        }
        Ok(memory)
    }

    pub(super) fn blank(&self) -> RecurrentState {
        RecurrentState(self.memories.iter().map(|shape| vec![0.0; shape.iter().product()]).collect())
    }

    /// Runs one control step.
    pub(super) fn run(
        &self,
        observation: &NetworkInputs,
        memory: &RecurrentState,
    ) -> RunResult<(Action, RecurrentState)> {
        self.split(self.evaluate(observation, memory)?)
    }

    /// Returns the values of [`Network::outputs`].
    fn evaluate(&self, observation: &NetworkInputs, memory: &RecurrentState) -> RunResult<Vec<Value>> {
        let mut inputs = Vec::with_capacity(self.inputs.len());
        for input in &self.inputs {
            let value = match input.source {
                Source::Sensed(name) => {
                    let values = observation.values(name);
                    ValueView::from_shape([1, values.len()], values)?
                }
                Source::Recurrent(index) => ValueView::from_shape(&self.memories[index], &memory.0[index])?,
            };
            inputs.push((input.node, value.into()));
        }
        let options = RunOptions::default().with_thread_pool(Some(self.thread.clone()));
        Ok(self.model.run(inputs, &self.outputs, Some(options))?)
    }

    /// Splits the outputs into action and memory. Shapes have been checked, so that no value is left out.
    fn split(&self, outputs: Vec<Value>) -> RunResult<(Action, RecurrentState)> {
        let floats = |value: Value| {
            let tensor: Option<Tensor<f32>> = value.into_tensor();
            Ok(tensor.ok_or("an output is not of 32-bit floats")?.into_data())
        };
        let mut values = outputs.into_iter().map(floats).collect::<RunResult<Vec<Vec<f32>>>>()?;
        let memory = RecurrentState(values.split_off(ACTIONS.len()));
        let joints = |index: usize| {
            let values: &Vec<f32> = &values[index];
            std::array::from_fn(|joint| values.get(joint).copied().unwrap_or(f32::NAN))
        };
        Ok((Action { target_rad: joints(0), kp_n_m_rad: joints(1), kd_n_m_s_rad: joints(2) }, memory))
    }
}

impl fmt::Debug for Network {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Network").field("name", &self.name).finish_non_exhaustive()
    }
}

impl NetworkInputs {
    fn values(&self, name: &str) -> &[f32] {
        match name {
            ORIENTATION => &self.quaternion_wxyz,
            ANGULAR_VELOCITY => &self.angular_velocity_rad_s,
            COMMAND => &self.velocity_command,
            POSITIONS => &self.q_rad,
            _ => &self.qd_rad_s,
        }
    }
}

impl Action {
    /// Returns true if the action can drive joints: all values are finite, stiffness is above zero and
    /// damping is not negative.
    pub(super) fn usable(&self) -> bool {
        let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        finite(&self.target_rad)
            && finite(&self.kp_n_m_rad)
            && finite(&self.kd_n_m_s_rad)
            && self.kp_n_m_rad.iter().all(|kp| *kp > 0.0)
            && self.kd_n_m_s_rad.iter().all(|kd| *kd >= 0.0)
    }
}

/// The part of an ONNX file that distinguishes it from others. Some files of other formats would keep
/// rten's reader busy forever.
#[derive(Clone, PartialEq, Message)]
struct Outline {
    #[prost(message, optional, tag = "7")]
    graph: Option<()>,
}

fn load(file: &str, bytes: Vec<u8>) -> Result<Model, SimError> {
    let not_onnx = |source| SimError::NotOnnx { path: file.into(), source };
    let outline = Outline::decode(bytes.as_slice()).map_err(|source| not_onnx(source.into()))?;
    if outline.graph.is_none() {
        return Err(not_onnx("it holds no graph".into()));
    }
    Model::load(bytes).map_err(|source| match source.kind() {
        LoadErrorKind::ParseError | LoadErrorKind::UnknownFileType => not_onnx(source.into()),
        _ => SimError::NotRunnable { path: file.into(), source: source.into() },
    })
}

fn names(model: &Model, nodes: &[NodeId]) -> Vec<String> {
    let name =
        |node: &NodeId| model.node_info(*node).and_then(|info| info.name()).unwrap_or_default().to_owned();
    nodes.iter().map(name).collect()
}

/// Returns an input's shape. Dimensions without a fixed size, for example a batch, count as 1.
fn input_shape(model: &Model, index: usize) -> Vec<usize> {
    let size = |dimension| match dimension {
        Dimension::Fixed(size) => size,
        Dimension::Symbolic(_) => 1,
    };
    model.input_shape(index).unwrap_or_default().into_iter().map(size).collect()
}

fn expect_shape(
    file: &str,
    kind: &'static str,
    tensor: &str,
    have: &[usize],
    expected: &[usize],
) -> Result<(), SimError> {
    if have == expected {
        return Ok(());
    }
    Err(SimError::TensorShape {
        path: file.into(),
        kind,
        tensor: tensor.into(),
        have: have.to_vec(),
        expected: expected.to_vec(),
    })
}
