//! Time of one step and of one solution for two wrists and 17 joints on one thread.

use std::{
    hint::black_box,
    time::{Duration, Instant},
};

use nalgebra::Vector3;
use tandem_ik::{Configuration, DampingTask, FrameTask, Model, PostureTask, SolveOptions, Solver, Task};

#[path = "../tests/kinematics/common.rs"]
mod common;

/// Returns targets 12 cm away for both wrists, with posture and damping.
fn tasks(model: &Model, start: &Configuration) -> Vec<Task> {
    let mut tasks: Vec<Task> = ["left_wrist", "right_wrist"]
        .map(|site| {
            let wrist = model.frame(site).expect("a site");
            let mut target = start.root_from_frame(wrist);
            target.translation.vector += Vector3::new(0.1, 0.0, 0.07);
            Task::Frame(FrameTask::new(wrist, target))
        })
        .into();
    tasks.push(Task::Posture(PostureTask { target: common::READY_RAD.to_vec(), cost: 1e-3, gain: 1.0 }));
    tasks.push(Task::Damping(DampingTask { cost: 2e-4 }));
    tasks
}

/// Runs `once` in batches for a second, and prints the time of one run in the median batch.
fn measure(name: &str, mut once: impl FnMut()) {
    const BATCH: u32 = 20;
    let mut batch_us = || {
        let start = Instant::now();
        (0..BATCH).for_each(|_| once());
        start.elapsed().as_secs_f64() * 1e6 / f64::from(BATCH)
    };
    let start = Instant::now();
    let mut times_us = Vec::new();
    while start.elapsed() < Duration::from_secs(1) {
        times_us.push(batch_us());
    }
    times_us.sort_by(f64::total_cmp);
    println!("{name}: {:.1} us", times_us[times_us.len() / 2]);
}

fn main() {
    let model = common::g1();
    let start = common::ready(&model);
    let tasks = tasks(&model, &start);
    let mut configuration = start.clone();
    let mut solver = Solver::new(&model, 0.02);
    let mut step = |name: &str, solver: &mut Solver| {
        measure(name, || {
            configuration.clone_from(&start);
            black_box(solver.step(&mut configuration, &tasks, &[]));
        });
    };
    step("step", &mut solver);
    solver.limits.velocity = vec![2.0; model.nv()];
    step("step at speed limits", &mut solver);
    // Every pair within range: ten rows.
    let barrier = tandem_ik::SelfCollision { range_m: 2.0, ..common::self_collision(&model) };
    solver.self_collision = Some(barrier);
    step("step with ten capsule pairs", &mut solver);
    let mut solver = Solver::new(&model, 0.02);
    measure("solve", || {
        configuration.clone_from(&start);
        black_box(solver.solve(&mut configuration, &tasks, &SolveOptions::default()));
    });
}
