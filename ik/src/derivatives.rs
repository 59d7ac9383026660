//! All derivatives against central differences, on the whole G1: Jacobians of frames, rows of tasks and
//! of barriers.

use nalgebra::{Point3, UnitQuaternion, Vector3, Vector6};

use crate::barriers::{Capsule, PositionBarrier, SelfCollision};
use crate::model::{Configuration, Joint, Model};
use crate::qp::{Qp, Rows};
use crate::spatial::Log6;
use crate::tasks::{
    CenterOfMassTask, FrameTask, JointCouplingTask, PostureTask, RelativeFrameTask, Sink, StepContext, Task,
    TaskScratch,
};

const ROBOT: &str = include_str!("../../sim/assets/robots/g1_dex3/robot.xml");
/// Step of the differences, rad, which are then accurate to about 1e-9.
const STEP: f64 = 1e-5;
const WITHIN: f64 = 1e-7;

/// Returns coordinates within every joint's range, different for each joint.
fn somewhere(model: &Model) -> Vec<f64> {
    let place = |(index, joint): (usize, &Joint)| {
        0.5 * (joint.lower + joint.upper) + 0.3 * (joint.upper - joint.lower) * (1.7 * index as f64).sin()
    };
    model.joints().iter().enumerate().map(place).collect()
}

/// Returns the central difference of `value` along each joint.
fn differences(configuration: &Configuration, value: impl Fn(&Configuration) -> Vec<f64>) -> Vec<Vec<f64>> {
    let shifted = |joint: usize, by: f64| {
        let mut q = configuration.q().to_vec();
        q[joint] += by;
        value(&Configuration::new(configuration.model(), &q).expect("finite"))
    };
    let along = |joint| {
        let (ahead, behind) = (shifted(joint, STEP), shifted(joint, -STEP));
        ahead.iter().zip(behind).map(|(ahead, behind)| (ahead - behind) / (2.0 * STEP)).collect()
    };
    (0..configuration.model().nv()).map(along).collect()
}

fn robot() -> Model {
    Model::from_mjcf(ROBOT).expect("the robot's file")
}

#[test]
fn frame_jacobian_is_the_body_velocity() {
    let model = robot();
    let configuration = Configuration::new(&model, &somewhere(&model)).expect("all joints");
    let frame = model.frame("right_palm").expect("a site");
    let mut columns = vec![Vector6::zeros(); model.nv()];
    configuration.frame_jacobian(frame, &mut columns);
    let here = configuration.root_from_frame(frame).inverse();
    let derivatives = differences(&configuration, |at| {
        Log6::of(&(here * at.root_from_frame(frame))).twist.as_slice().to_vec()
    });
    for (joint, column) in columns.iter().enumerate() {
        let difference = Vector6::from_column_slice(&derivatives[joint]);
        assert!((column - difference).amax() < WITHIN, "joint {joint}: {column} against {difference}");
    }
}

/// Rows of one task: dense W J, and alpha W e.
struct Recorder {
    nv: usize,
    rows: Vec<(Vec<f64>, f64)>,
}

impl Sink for Recorder {
    fn row(&mut self, entries: &[(usize, f64)], error: f64) {
        let mut dense = vec![0.0; self.nv];
        for (joint, value) in entries {
            dense[*joint] += value;
        }
        self.rows.push((dense, error));
    }

    fn diagonal(&mut self, weight: f64, error: &dyn Fn(usize) -> f64) {
        for joint in 0..self.nv {
            self.row(&[(joint, weight)], weight * error(joint));
        }
    }

    fn damp(&mut self, _: f64) {}
}

fn rows(task: &Task, configuration: &Configuration) -> Vec<(Vec<f64>, f64)> {
    let nv = configuration.model().nv();
    let mut recorder = Recorder { nv, rows: Vec::new() };
    let context = StepContext { dt_s: 0.02, last_velocity: &vec![0.0; nv], error_clamp: None };
    task.goal().write(configuration, &context, &mut TaskScratch::new(nv), &mut recorder);
    recorder.rows
}

/// J dq = e for the best dq, so J = -de/dq.
#[test]
fn task_jacobians_are_minus_the_derivatives_of_their_errors() {
    let model = robot();
    let configuration = Configuration::new(&model, &somewhere(&model)).expect("all joints");
    let [left, right] = ["left_wrist", "right_wrist"].map(|site| model.frame(site).expect("a site"));
    let [target, other] = [left, right].map(|frame| {
        let mut pose = configuration.root_from_frame(frame);
        pose.translation.vector += Vector3::new(0.1, -0.2, 0.05);
        pose.append_rotation_wrt_center_mut(&UnitQuaternion::from_euler_angles(0.8, -0.5, 0.3));
        pose
    });
    let tasks = [
        Task::Frame(FrameTask {
            position_cost: 2.0,
            orientation_cost: 0.5,
            gain: 0.7,
            ..FrameTask::new(left, target)
        }),
        Task::RelativeFrame(RelativeFrameTask {
            frame: left,
            reference: right,
            target: other.inverse() * target,
            position_cost: 1.0,
            orientation_cost: 3.0,
            gain: 0.7,
        }),
        Task::CenterOfMass(CenterOfMassTask {
            target: Vector3::zeros(),
            cost: Vector3::new(1.0, 2.0, 3.0),
            gain: 0.7,
        }),
        Task::Posture(PostureTask { target: vec![0.1; model.nv()], cost: 0.3, gain: 0.7 }),
        Task::JointCoupling(JointCouplingTask {
            ratios: vec![(3, 1.0), (7, -2.0)],
            offset: 0.2,
            cost: 1.5,
            gain: 0.7,
        }),
    ];
    for task in &tasks {
        let derivatives =
            differences(&configuration, |at| rows(task, at).iter().map(|(_, error)| *error).collect());
        for (number, (row, _)) in rows(task, &configuration).iter().enumerate() {
            for (joint, value) in row.iter().enumerate() {
                let difference = -derivatives[joint][number] / 0.7;
                assert!(
                    (value - difference).abs() < WITHIN,
                    "{}: row {number}, joint {joint}: {value} against {difference}",
                    task.goal().describe(&model)
                );
            }
        }
    }
}

#[test]
fn barrier_rows_are_derivatives_of_distances() {
    let model = robot();
    let configuration = Configuration::new(&model, &somewhere(&model)).expect("all joints");
    let [left, right, torso] =
        ["left_wrist", "right_wrist", "torso_link"].map(|frame| model.frame(frame).expect("a frame"));
    let ends = [Point3::new(0.0, 0.0, 0.0), Point3::new(0.15, 0.02, 0.01)];
    let capsule = |frame, ends| Capsule { frame, ends, radius_m: 0.03 };
    let head = [Point3::new(0.0, 0.0, 0.4); 2];
    let shapes = SelfCollision {
        capsules: vec![capsule(left, ends), capsule(right, ends), capsule(torso, head)],
        pairs: vec![[0, 1], [0, 2], [2, 1]],
        margin_m: 0.01,
        range_m: 10.0,
        gain: 0.5,
    };
    let plane =
        PositionBarrier { frame: left, normal: Vector3::new(0.6, 0.0, 0.8), offset_m: 0.1, gain: 0.5 };
    let barrier_rows = |at: &Configuration| -> Vec<(Vec<f64>, f64)> {
        let (mut qp, mut owners) = (Qp::new(model.nv()), Vec::new());
        let mut rows = Rows { qp: &mut qp, owners: &mut owners };
        shapes.write(at, &mut Vec::new(), &mut rows, |pair| pair);
        plane.write(at, rows.push(shapes.pairs.len()));
        qp.rows().iter().map(|row| (row.coefficients.clone(), -row.bound / 0.5)).collect()
    };
    let derivatives =
        differences(&configuration, |at| barrier_rows(at).iter().map(|(_, height)| *height).collect());
    let rows = barrier_rows(&configuration);
    assert_eq!(rows.len(), 4);
    for (number, (row, _)) in rows.iter().enumerate() {
        for (joint, value) in row.iter().enumerate() {
            let difference = derivatives[joint][number];
            assert!(
                (value - difference).abs() < WITHIN,
                "row {number}, joint {joint}: {value} against {difference}"
            );
        }
    }
}
