//! A G1 moves both wrists in steps of 20 ms: `cargo run -p tandem-ik --release --example reach`.
//!
//! The loop is the one that users of Pink know: set targets, solve for velocities, integrate. In
//! addition it has speed limits, a barrier between the hands, and a report of the outcome.

use std::error::Error;

use nalgebra::{Point3, Vector3};
use tandem_ik::{
    Capsule, Configuration, DampingTask, FrameTask, Model, Outcome, PostureTask, SelfCollision, Solver, Task,
};

const DT_S: f64 = 0.02;

fn main() -> Result<(), Box<dyn Error>> {
    let robot = Model::from_mjcf(include_str!("../../sim/assets/robots/g1_dex3/robot.xml"))?;

    // Waist and arms move; legs and fingers keep still.
    let moves = |name: &str| ["waist", "shoulder", "elbow", "wrist"].iter().any(|part| name.contains(part));
    let free: Vec<&str> =
        robot.joints().iter().map(|joint| joint.name.as_str()).filter(|name| moves(name)).collect();
    let model = robot.reduced(&free, &vec![0.0; robot.nv()])?;

    let mut start = vec![0.0; model.nv()];
    start[model.joint("left_elbow_joint")?] = 1.28;
    start[model.joint("right_elbow_joint")?] = 1.28;
    let mut configuration = Configuration::new(&model, &start)?;

    let left = model.frame("left_wrist")?;
    let right = model.frame("right_wrist")?;
    let mut left_target = configuration.root_from_frame(left);
    left_target.translation.vector += Vector3::new(0.10, -0.05, 0.20);
    let mut right_target = configuration.root_from_frame(right);
    right_target.translation.vector += Vector3::new(0.15, 0.05, 0.05);
    let tasks = [
        Task::Frame(FrameTask::new(left, left_target)),
        Task::Frame(FrameTask { orientation_cost: 0.5, ..FrameTask::new(right, right_target) }),
        Task::Posture(PostureTask { target: start, cost: 1e-3, gain: 1.0 }),
        Task::Damping(DampingTask { cost: 2e-4 }),
    ];

    let mut solver = Solver::new(&model, DT_S);
    solver.limits.velocity = vec![3.0; model.nv()];
    let hand =
        |frame| Capsule { frame, ends: [Point3::origin(), Point3::new(0.15, 0.0, 0.0)], radius_m: 0.045 };
    solver.self_collision = Some(SelfCollision {
        capsules: vec![hand(left), hand(right)],
        pairs: vec![[0, 1]],
        margin_m: 0.01,
        range_m: 0.2,
        gain: 0.3,
    });

    for step in 1..=200 {
        let outcome = solver.step(&mut configuration, &tasks, &[]);
        let errors: Vec<f64> =
            tandem_ik::frame_errors(&configuration, &tasks).map(|error| error.position_m).collect();
        let clamped: Vec<&str> = solver
            .clamped(&configuration)
            .map(|clamped| model.joints()[clamped.joint].name.as_str())
            .collect();
        println!("{:.2} s  errors {errors:.4?} m  at a limit: {clamped:?}", f64::from(step) * DT_S);
        match outcome {
            Outcome::Moving => {}
            Outcome::Reached => return Ok(()),
            other => return Err(format!("{other:?}").into()),
        }
    }
    Err("200 steps were not enough".into())
}
