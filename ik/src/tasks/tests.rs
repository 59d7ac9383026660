//! Every task's rows against central differences of its error, on the whole G1.

use nalgebra::{UnitQuaternion, Vector3};

use super::*;
use crate::differences::{WITHIN, differences, robot, somewhere};

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
