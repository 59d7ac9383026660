//! The ONNX file of a velocity policy: which tensors it must have, and how it is run.
//!
//! The network takes `root_link_quat_w`, `root_ang_vel_b`, `velocity_commands`, `joint_pos` and `joint_vel` and gives
//! `action_joint_pos`, `action_joint_pos_kp_gains` and `action_joint_pos_kd_gains`. Every other input `X` (last actions,
//! histories) is a memory: the output `X_out` is its value at the next step.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tract_onnx::pb::ModelProto;
use tract_onnx::prelude::*;
use tract_onnx::tract_hir::infer::Factoid;
use tract_onnx::tract_hir::internal::DimLike;
use xxhash_rust::xxh3::xxh3_64;

use super::joints::{CONTROLLED_JOINTS, OBSERVED_JOINTS};
use crate::SimError;

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
/// Targets (rad), stiffness (N m/rad), damping (N m s/rad).
const ACTIONS: [&str; 3] = ["action_joint_pos", "action_joint_pos_kp_gains", "action_joint_pos_kd_gains"];
/// What a memory's output is called beyond the input's name.
const FED_BACK: &str = "_out";
/// Beyond the five frames that histories have, so that the actions in them have settled.
const STEPS_TO_REMEMBER: usize = 25;

/// What the network sees at one control step.
#[derive(Clone, Debug)]
pub(super) struct Observation {
    /// Pelvis in the world.
    pub quaternion_wxyz: [f32; 4],
    /// Of the pelvis, in its own frame.
    pub angular_velocity_rad_s: [f32; 3],
    /// Forward m/s, left m/s, turning rad/s.
    pub velocity_command: [f32; 3],
    /// In the order of [`super::joints::OBSERVED`].
    pub q_rad: [f32; OBSERVED_JOINTS],
    pub qd_rad_s: [f32; OBSERVED_JOINTS],
}

/// What the network asks of the joints, in the order of [`super::joints::CONTROLLED`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Action {
    pub target_rad: [f32; CONTROLLED_JOINTS],
    pub kp_n_m_rad: [f32; CONTROLLED_JOINTS],
    pub kd_n_m_s_rad: [f32; CONTROLLED_JOINTS],
}

/// Values of the memory inputs, in the order of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Memory(pub(super) Vec<Vec<f32>>);

/// A checked file, ready to run. Robots share it; what differs between them is [`Memory`].
pub struct Network {
    name: String,
    plan: Arc<TypedRunnableModel>,
    inputs: Vec<Input>,
    /// Positions of [`ACTIONS`] among the outputs.
    actions: [usize; 3],
    memories: Vec<MemoryTensor>,
}

enum Input {
    Sensed(&'static str),
    Memory(usize),
}

struct MemoryTensor {
    shape: Vec<usize>,
    /// Position of its next value among the outputs.
    output: usize,
}

impl Network {
    /// Reads a file, checks names and shapes, and runs it once.
    pub fn from_file(path: &Path) -> Result<Network, SimError> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| SimError::Read { path: file.clone(), source })?;
        let not_onnx = |source: TractError| SimError::NotOnnx { path: file.clone(), source: source.into() };
        let proto = tract_onnx::onnx().proto_model_for_read(&mut bytes.as_slice()).map_err(not_onnx)?;
        let outputs = output_names(&proto, &file)?;
        let not_runnable =
            |source: TractError| SimError::NotRunnable { path: file.clone(), source: source.into() };
        let model = tract_onnx::onnx().model_for_proto_model(&proto).map_err(not_runnable)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = format!("{name}+{:016x}", xxh3_64(&bytes));
        let network = Network::check(&file, name, model, &outputs)?;
        let still = Observation {
            quaternion_wxyz: [1.0, 0.0, 0.0, 0.0],
            angular_velocity_rad_s: [0.0; 3],
            velocity_command: [0.0; 3],
            q_rad: [0.0; OBSERVED_JOINTS],
            qd_rad_s: [0.0; OBSERVED_JOINTS],
        };
        let (action, _) = network.run(&still, &network.blank()).map_err(not_runnable)?;
        if !action.usable() {
            return Err(SimError::PolicyOutput { path: file });
        }
        Ok(network)
    }

    /// The file's name without its folders, and a hash of its content.
    pub fn name(&self) -> &str {
        &self.name
    }

    fn check(
        file: &str,
        name: String,
        mut model: InferenceModel,
        outputs: &[String],
    ) -> Result<Network, SimError> {
        let not_runnable =
            |source: TractError| SimError::NotRunnable { path: file.into(), source: source.into() };
        let missing = |kind, tensor: &str, have: &[String]| SimError::MissingTensor {
            path: file.into(),
            kind,
            tensor: tensor.into(),
            have: have.join(", "),
        };
        let names: Vec<String> = model
            .input_outlets()
            .map_err(not_runnable)?
            .iter()
            .map(|outlet| model.node(outlet.node).name.clone())
            .collect();
        if let Some((name, _)) = SENSED.iter().find(|(name, _)| !names.iter().any(|have| have == name)) {
            return Err(missing("input", name, &names));
        }
        let output = |name: &str| {
            let found = outputs.iter().position(|output| output == name);
            found.ok_or_else(|| missing("output", name, outputs))
        };
        let actions = [output(ACTIONS[0])?, output(ACTIONS[1])?, output(ACTIONS[2])?];
        let mut inputs = Vec::with_capacity(names.len());
        let mut memories = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let have = input_shape(&model, index).map_err(not_runnable)?;
            let shape = match SENSED.iter().find(|(sensed, _)| sensed == name) {
                Some((sensed, width)) => {
                    inputs.push(Input::Sensed(sensed));
                    vec![1, *width]
                }
                None => {
                    inputs.push(Input::Memory(memories.len()));
                    memories.push(MemoryTensor {
                        shape: have.clone(),
                        output: output(&format!("{name}{FED_BACK}"))?,
                    });
                    have.clone()
                }
            };
            expect_shape(file, "input", name, &have, &shape)?;
            model.set_input_fact(index, f32::fact(&shape).into()).map_err(not_runnable)?;
        }
        let model = model.into_optimized().map_err(not_runnable)?;
        for (tensor, index) in ACTIONS.iter().zip(actions) {
            expect_shape(
                file,
                "output",
                tensor,
                &output_shape(&model, index).map_err(not_runnable)?,
                &[1, CONTROLLED_JOINTS],
            )?;
        }
        for memory in &memories {
            let have = output_shape(&model, memory.output).map_err(not_runnable)?;
            expect_shape(file, "output", &outputs[memory.output], &have, &memory.shape)?;
        }
        let plan = model.into_runnable().map_err(not_runnable)?;
        Ok(Network { name, plan, inputs, actions, memories })
    }

    /// The memory of a robot that has stood as in `observation` for half a second, acting as the policy wanted. One that
    /// had not acted before would be thrown into the policy's own stance: it hops a third of a metre.
    pub(super) fn remember(&self, observation: &Observation) -> TractResult<Memory> {
        let mut memory = self.blank();
        for _ in 0..STEPS_TO_REMEMBER {
            memory = self.run(observation, &memory)?.1;
        }
        Ok(memory)
    }

    pub(super) fn blank(&self) -> Memory {
        Memory(self.memories.iter().map(|tensor| vec![0.0; tensor.shape.iter().product()]).collect())
    }

    /// One control step.
    pub(super) fn run(&self, observation: &Observation, memory: &Memory) -> TractResult<(Action, Memory)> {
        let inputs = self.inputs.iter().map(|input| {
            let tensor = match input {
                Input::Sensed(name) => {
                    let values = observation.values(name);
                    Tensor::from_shape(&[1, values.len()], values)
                }
                Input::Memory(index) => Tensor::from_shape(&self.memories[*index].shape, &memory.0[*index]),
            };
            tensor.map(TValue::from)
        });
        let inputs = inputs.collect::<TractResult<TVec<TValue>>>()?;
        let outputs = self.plan.run(inputs);
        clear_vector_registers();
        let outputs = outputs?;
        let values = |index: usize| -> TractResult<Vec<f32>> {
            Ok(outputs[index].to_plain_array_view::<f32>()?.iter().copied().collect())
        };
        let joints = |index: usize| -> TractResult<[f32; CONTROLLED_JOINTS]> {
            let values = values(self.actions[index])?;
            // Shapes have been checked, so that none is left out.
            Ok(std::array::from_fn(|joint| values.get(joint).copied().unwrap_or(f32::NAN)))
        };
        let action = Action { target_rad: joints(0)?, kp_n_m_rad: joints(1)?, kd_n_m_s_rad: joints(2)? };
        let next = self.memories.iter().map(|tensor| values(tensor.output)).collect::<TractResult<_>>()?;
        Ok((action, Memory(next)))
    }
}

impl fmt::Debug for Network {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Network").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Observation {
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
    /// Whether joints can be driven by it: numbers, and stiffness above zero.
    pub(super) fn usable(&self) -> bool {
        let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        finite(&self.target_rad)
            && finite(&self.kp_n_m_rad)
            && finite(&self.kd_n_m_s_rad)
            && self.kp_n_m_rad.iter().all(|kp| *kp > 0.0)
            && self.kd_n_m_s_rad.iter().all(|kd| *kd >= 0.0)
    }
}

/// Ends the use of the wide vector registers, which tract's kernels leave to their callers: with their upper halves in use,
/// every SSE instruction of the thread takes longer, and physics twice its time.
#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "one instruction that has no safe form")]
fn clear_vector_registers() {
    #[target_feature(enable = "avx")]
    fn clear() {
        std::arch::x86_64::_mm256_zeroupper();
    }
    if std::arch::is_x86_feature_detected!("avx") {
        // SAFETY: the processor has the instruction.
        unsafe { clear() }
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn clear_vector_registers() {}

/// Names of the outputs in the file's order. Refuses a file without a graph, as an empty one, and a graph that does not
/// make what it declares.
fn output_names(proto: &ModelProto, file: &str) -> Result<Vec<String>, SimError> {
    let Some(graph) = &proto.graph else {
        return Err(SimError::NotOnnx { path: file.into(), source: "it holds no graph".into() });
    };
    let made = |name: &String| {
        graph.node.iter().any(|node| node.output.contains(name))
            || graph.input.iter().any(|input| input.name == *name)
            || graph.initializer.iter().any(|constant| constant.name == *name)
    };
    let names: Vec<String> = graph.output.iter().map(|output| output.name.clone()).collect();
    match names.iter().find(|name| !made(name)) {
        Some(name) => {
            let source = format!("no node makes the output `{name}`").into();
            Err(SimError::NotRunnable { path: file.into(), source })
        }
        None => Ok(names),
    }
}

/// Dimensions without a size, as a batch, count as 1.
fn input_shape(model: &InferenceModel, index: usize) -> TractResult<Vec<usize>> {
    let dims = model.input_fact(index)?.shape.dims();
    Ok(dims.map(|dim| dim.concretize().and_then(|dim| dim.to_usize().ok()).unwrap_or(1)).collect())
}

fn output_shape(model: &TypedModel, index: usize) -> TractResult<Vec<usize>> {
    model.output_fact(index)?.shape.iter().map(|dim| Ok(dim.to_usize()?)).collect()
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
