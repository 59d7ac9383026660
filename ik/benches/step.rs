//! Time of one step and of one solution for two wrists and 17 joints on one thread.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use tandem_ik::{Configuration, DampingTask, FrameTask, Model, PostureTask, SolveOptions, Solver, Task};

#[path = "../tests/kinematics/common.rs"]
mod common;

/// Both wrists 12 cm away from where they are, posture and damping.
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

fn step(criterion: &mut Criterion) {
    let model = common::g1();
    let start = common::ready(&model);
    let tasks = tasks(&model, &start);
    let mut group = criterion.benchmark_group("two wrists, 17 joints");
    let mut configuration = start.clone();
    let mut solver = Solver::new(&model, 0.02);
    group.bench_function("step", |bencher| {
        bencher.iter(|| {
            configuration.clone_from(&start);
            solver.step(&mut configuration, &tasks, &[])
        });
    });
    solver.limits.velocity = vec![2.0; model.nv()];
    group.bench_function("step at speed limits", |bencher| {
        bencher.iter(|| {
            configuration.clone_from(&start);
            solver.step(&mut configuration, &tasks, &[])
        });
    });
    // Every pair within range: ten rows.
    let barrier = tandem_ik::SelfCollision { range_m: 2.0, ..common::self_collision(&model) };
    solver.self_collision = Some(barrier);
    group.bench_function("step with ten capsule pairs", |bencher| {
        bencher.iter(|| {
            configuration.clone_from(&start);
            solver.step(&mut configuration, &tasks, &[])
        });
    });
    let mut solver = Solver::new(&model, 0.02);
    group.bench_function("solve", |bencher| {
        bencher.iter(|| {
            configuration.clone_from(&start);
            solver.solve(&mut configuration, &tasks, &SolveOptions::default())
        });
    });
    group.finish();
}

criterion_group!(benches, step);
criterion_main!(benches);
