//! Policies built for tests: the requirements on a file, and a robot driven by a valid one.

use std::path::PathBuf;

use rten_onnx::onnx::{
    DataType, Dimension, GraphProto, ModelProto, NodeProto, OperatorSetIdProto, TensorProto,
    TensorShapeProto, TypeProto, TypeProtoTensor, ValueInfoProto,
};

use super::network::Network;
use super::*;
use crate::body::{ARMS, HANDS};
use crate::locomotion::LocomotionChoice;
use crate::{RobotCommand, RobotPlacement, SimError, World, WorldSpec};

/// Indices of the controlled joints among the observed ones.
const CONTROLLED_OF_OBSERVED: [i64; 14] = [0, 1, 3, 4, 5, 6, 7, 8, 9, 10, 13, 14, 17, 18];

fn value(name: &str, shape: &[i64]) -> ValueInfoProto {
    let size = |size: &i64| Dimension { dim_value: Some(*size), ..Dimension::default() };
    let shape = TensorShapeProto { dim: shape.iter().map(size).collect() };
    let tensor = TypeProtoTensor { elem_type: Some(DataType::FLOAT), shape: Some(shape) };
    let tensor = TypeProto { tensor_type: Some(tensor), ..TypeProto::default() };
    ValueInfoProto { name: Some(name.into()), r#type: Some(tensor) }
}

fn node(op: &str, inputs: [&str; 2], output: &str) -> NodeProto {
    NodeProto {
        op_type: Some(op.into()),
        name: Some(output.into()),
        input: inputs.map(String::from).into(),
        output: vec![output.into()],
        ..NodeProto::default()
    }
}

fn floats(name: &str, shape: &[i64], value: f32) -> TensorProto {
    let float_data = vec![value; shape.iter().product::<i64>() as usize];
    TensorProto {
        name: Some(name.into()),
        dims: shape.into(),
        data_type: Some(DataType::FLOAT),
        float_data,
        ..TensorProto::default()
    }
}

fn integers(name: &str, values: &[i64]) -> TensorProto {
    TensorProto {
        name: Some(name.into()),
        dims: vec![values.len() as i64],
        data_type: Some(DataType::INT64),
        int64_data: values.into(),
        ..TensorProto::default()
    }
}

/// Builds a policy whose targets are the joints' present angles plus a milliradian more with every step,
/// at stiffness `kp`.
fn limp(kp: f32) -> GraphProto {
    GraphProto {
        input: vec![
            value("root_link_quat_w", &[1, 4]),
            value("root_ang_vel_b", &[1, 3]),
            value("velocity_commands", &[1, 3]),
            value("joint_pos", &[1, 29]),
            value("joint_vel", &[1, 29]),
            value("last_actions", &[1, 14]),
            value("shift_history", &[1, 2, 14]),
        ],
        output: vec![
            value("action_joint_pos", &[1, 14]),
            value("action_joint_pos_kp_gains", &[1, 14]),
            value("action_joint_pos_kd_gains", &[1, 14]),
            value("last_actions_out", &[1, 14]),
            value("shift_history_out", &[1, 2, 14]),
        ],
        initializer: vec![
            integers("joints", &CONTROLLED_OF_OBSERVED),
            // Gather works along axis 0, so the row of joints is made a column and back.
            integers("column", &[29, 1]),
            integers("row", &[1, 14]),
            floats("milliradian", &[1, 14], 1e-3),
            floats("one", &[1], 1.0),
            floats("action_joint_pos_kp_gains", &[1, 14], kp),
            floats("action_joint_pos_kd_gains", &[1, 14], 3.0),
        ],
        node: vec![
            node("Reshape", ["joint_pos", "column"], "joint_column"),
            node("Gather", ["joint_column", "joints"], "controlled_column"),
            node("Reshape", ["controlled_column", "row"], "controlled"),
            node("Add", ["last_actions", "milliradian"], "last_actions_out"),
            node("Add", ["controlled", "last_actions_out"], "action_joint_pos"),
            node("Add", ["shift_history", "one"], "shift_history_out"),
        ],
        ..GraphProto::default()
    }
}

fn file(folder: &tempfile::TempDir, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join("policy.onnx");
    std::fs::write(&path, bytes).unwrap();
    path
}

fn read(graph: GraphProto) -> Result<Network, SimError> {
    let opset = OperatorSetIdProto { version: Some(17), ..OperatorSetIdProto::default() };
    let model = ModelProto {
        ir_version: Some(8),
        opset_import: vec![opset],
        graph: Some(graph),
        ..ModelProto::default()
    };
    let folder = tempfile::tempdir().unwrap();
    Network::from_file(&file(&folder, &model.write_buf().unwrap()))
}

fn without(tensor: &str) -> GraphProto {
    let mut graph = limp(50.0);
    graph.input.retain(|input| input.name.as_deref() != Some(tensor));
    graph.output.retain(|output| output.name.as_deref() != Some(tensor));
    graph
}

fn reshaped(tensor: &str, shape: &[i64]) -> GraphProto {
    let mut graph = limp(50.0);
    graph
        .input
        .iter_mut()
        .filter(|input| input.name.as_deref() == Some(tensor))
        .for_each(|input| *input = value(tensor, shape));
    graph
}

#[test]
fn a_wrong_file_is_told_what_it_lacks() {
    for (graph, expected) in [
        (without("joint_vel"), "no input `joint_vel`"),
        (without("root_link_quat_w"), "no input `root_link_quat_w`"),
        (without("action_joint_pos_kp_gains"), "no output `action_joint_pos_kp_gains`"),
        (without("last_actions_out"), "no output `last_actions_out`"),
        (without("shift_history_out"), "no output `shift_history_out`"),
        (reshaped("root_ang_vel_b", &[1, 4]), "input `root_ang_vel_b` has shape [1, 4]"),
        (
            reshaped("joint_vel", &[1, 43]),
            "input `joint_vel` has shape [1, 43]; a velocity policy for the G1 has [1, 29]",
        ),
        (limp(-50.0), "gains that are not positive"),
    ] {
        let message = read(graph).unwrap_err().to_string();
        assert!(message.contains(expected) && message.contains("policy.onnx"), "{message}");
    }
}

#[test]
fn a_graph_that_does_not_make_its_outputs_is_no_panic() {
    let mut graph = limp(50.0);
    graph.node.retain(|node| node.name.as_deref() != Some("last_actions_out"));
    let message = read(graph).unwrap_err().to_string();
    assert!(message.contains("no node makes") || message.contains("cannot be run"), "{message}");
    graph = limp(50.0);
    graph.node[0].op_type = Some("Frobnicate".into());
    let message = read(graph).unwrap_err().to_string();
    assert!(message.contains("cannot be run"), "{message}");
}

#[test]
fn what_is_no_onnx_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (bytes, expected) in [
        (&b"velocity: 0.4\n"[..], "is not an ONNX file"),
        (&b""[..], "holds no graph"),
        (&[0xff; 64][..], "is not an ONNX file"),
    ] {
        let message = Network::from_file(&file(&folder, bytes)).unwrap_err().to_string();
        assert!(message.contains(expected) && message.contains("policy.onnx"), "{message}");
    }
    let message = Network::from_file(&folder.path().join("none.onnx")).unwrap_err().to_string();
    assert!(message.contains("cannot read") && message.contains("none.onnx"), "{message}");
}

#[test]
fn memories_come_back_and_begin_as_after_half_a_second() {
    let network = read(limp(50.0)).unwrap();
    let observation = NetworkInputs {
        quaternion_wxyz: [1.0, 0.0, 0.0, 0.0],
        angular_velocity_rad_s: [0.0; 3],
        velocity_command: [0.0; 3],
        q_rad: std::array::from_fn(|joint| joint as f32),
        qd_rad_s: [0.0; 29],
    };
    let mut memory = network.remember(&observation).unwrap();
    for step in 26..=28 {
        let (action, next) = network.run(&observation, &memory).unwrap();
        let expected = CONTROLLED_OF_OBSERVED.map(|joint| joint as f32 + step as f32 * 1e-3);
        let largest = action.target_rad.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(largest < 1e-5, "{action:?}");
        assert_eq!((action.kp_n_m_rad, action.kd_n_m_s_rad), ([50.0; 14], [3.0; 14]));
        memory = next;
    }
    assert_eq!(memory.0[1], [28.0; 28]);
}

/// Builds a policy whose targets are the joints' angles plus the forward velocity command that the
/// policy receives.
fn telling() -> GraphProto {
    let mut graph = limp(50.0);
    graph.initializer.extend([integers("forward", &[0; 14]), integers("command_column", &[3, 1])]);
    graph.node.retain(|node| node.name.as_deref() != Some("action_joint_pos"));
    graph.node.extend([
        node("Reshape", ["velocity_commands", "command_column"], "commands"),
        node("Gather", ["commands", "forward"], "forward_column"),
        node("Reshape", ["forward_column", "row"], "told"),
        node("Add", ["controlled", "told"], "action_joint_pos"),
    ]);
    graph
}

/// The robot does not move. The policy receives the plain command, or with the loop a command that would
/// catch up.
#[test]
fn a_policy_is_told_the_command_unless_a_loop_is_asked_for() {
    let network = Arc::new(read(telling()).unwrap());
    let body = crate::body::posed::Posed::standing().body();
    let command = BaseCommand { vx_m_s: 0.2, ..BaseCommand::standing(LIMITS.pelvis_height_m[0]) };
    let told = |looped: bool| {
        let mut agile = Agile::new(network.clone(), looped);
        for _ in 0..100 * PHYSICS_STEPS_PER_CONTROL {
            agile.tick(&body, &command, crate::PHYSICS_DT_S);
        }
        agile.state.unwrap().action.target_rad[0] - body.q_rad[agile.joints.controlled[0]]
    };
    assert!((told(false) - 0.2).abs() < 1e-5, "{}", told(false));
    assert!(told(true) > 0.5, "{}", told(true));
}

#[test]
fn a_policy_drives_the_robot_and_snapshots_continue_bit_for_bit() {
    let network = Arc::new(read(limp(50.0)).unwrap());
    let placement = RobotPlacement { name: "A".into(), position_m: [0.0, 0.0], yaw_rad: 0.0 };
    let spec = WorldSpec { scene: "floor".into(), robots: vec![placement], objects: vec![] };
    let world = || {
        let mut world = World::new(&spec).unwrap();
        world.set_locomotion(0, Box::new(Agile::new(network.clone(), true)));
        world
    };
    let mut first = world();
    let command = first.rest_command(0);
    assert_eq!(command.base.pelvis_height_m, LIMITS.pelvis_height_m[0]);
    let run = |world: &mut World, steps: u32| {
        (0..steps).for_each(|_| drop(world.control_step(&[command]).unwrap()))
    };
    run(&mut first, 6);
    let snapshot = first.snapshot().unwrap();
    run(&mut first, 6);
    let mut second = world();
    second.restore(&snapshot).unwrap();
    run(&mut second, 6);
    assert_eq!(first.state_hash(), second.state_hash());
    // The policy's waist target is ever further ahead of the waist, and the waist follows.
    let waist_rad = first.present().robots[0].sensed.joints.q_rad[WAIST + 1];
    assert!(waist_rad > 2e-3, "{waist_rad}");
}

/// Without a base controller, the policy's joints have the policy's gains; the other joints follow their
/// commands.
#[test]
fn a_policy_at_the_motors_leaves_arms_to_the_command() {
    let network = Arc::new(read(limp(50.0)).unwrap());
    let placement = RobotPlacement { name: "A".into(), position_m: [0.0, 0.0], yaw_rad: 0.0 };
    let spec = WorldSpec { scene: "floor".into(), robots: vec![placement], objects: vec![] };
    let world = World::new(&spec).unwrap();
    let RobotCommand { mut upper_rad, base } = world.rest_command(0);
    upper_rad[3] = 0.7;
    let body = world.robots()[0].body();
    let choice = LocomotionChoice::Onnx { network: network.clone(), looped: false };
    let setpoints = choice.motor_controller().unwrap().act(body, &upper_rad, &base);
    let q_rad = body.q_rad;
    let (knee, elbow, thumb) = (3, ARMS.left + 3, HANDS.left);
    assert!((setpoints.q_rad[knee] - q_rad[knee] - 1e-3).abs() < 1e-5, "{}", setpoints.q_rad[knee]);
    assert_eq!((setpoints.kp_n_m_rad[knee], setpoints.kd_n_m_s_rad[knee]), (50.0, 3.0));
    assert_eq!(setpoints.q_rad[elbow], 0.7);
    assert_eq!((setpoints.kp_n_m_rad[elbow], setpoints.kp_n_m_rad[thumb]), (80.0, 3.0));
    for refused in [LocomotionChoice::Balance, LocomotionChoice::Onnx { network, looped: true }] {
        let error = refused.motor_controller().map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(&refused.name()), "{error}");
    }
}
