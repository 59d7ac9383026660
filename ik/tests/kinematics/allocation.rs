//! A step that moves does not allocate, with any tasks and constraints.
#![allow(unsafe_code, reason = "a global allocator that counts cannot be written without")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use nalgebra::Vector3;
use tandem_ik::{
    CenterOfMassTask, DampingTask, FrameTask, JointCouplingTask, LowAccelerationTask, Outcome,
    PositionBarrier, PostureTask, RelativeFrameTask, Solver, Task,
};

use super::common;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn moving_steps_do_not_allocate() {
    let model = common::g1();
    let configuration = common::ready(&model);
    let [left, right] = ["left_wrist", "right_wrist"].map(|site| model.frame(site).expect("a site"));
    let mut target = configuration.root_from_frame(left);
    target.translation.vector += Vector3::new(0.1, -0.25, 0.1);
    let relative = configuration.root_from_frame(left).inverse() * configuration.root_from_frame(right);
    let tasks = [
        Task::Frame(FrameTask::new(left, target)),
        Task::RelativeFrame(RelativeFrameTask {
            frame: right,
            reference: left,
            target: relative,
            position_cost: 0.5,
            orientation_cost: 0.1,
            gain: 1.0,
        }),
        Task::CenterOfMass(CenterOfMassTask {
            target: configuration.center_of_mass(),
            cost: Vector3::new(0.1, 0.1, 0.0),
            gain: 1.0,
        }),
        Task::Posture(PostureTask { target: common::READY_RAD.to_vec(), cost: 1e-3, gain: 1.0 }),
        Task::Damping(DampingTask { cost: 1e-3 }),
        Task::LowAcceleration(LowAccelerationTask { cost: 1e-3 }),
    ];
    let upright = JointCouplingTask { ratios: vec![(1, 1.0)], offset: 0.0, cost: 1.0, gain: 1.0 };
    let mut solver = Solver::new(&model, 0.02);
    solver.limits.velocity = vec![0.5; model.nv()];
    solver.limits.acceleration = Some(vec![20.0; model.nv()]);
    solver.self_collision = Some(common::self_collision(&model));
    solver.position_barriers =
        vec![PositionBarrier { frame: left, normal: Vector3::z(), offset_m: -0.2, gain: 0.5 }];
    let constraints = [Task::JointCoupling(upright)];
    // Rows are allocated when they first appear.
    let mut rehearsal = configuration.clone();
    for _ in 0..20 {
        solver.step(&mut rehearsal, &tasks, &constraints);
    }
    for step in [Solver::step, Solver::track] {
        solver.rest();
        let mut configuration = configuration.clone();
        let before = ALLOCATIONS.with(Cell::get);
        for _ in 0..20 {
            let outcome = step(&mut solver, &mut configuration, &tasks, &constraints);
            assert_eq!(outcome, Outcome::Moving);
        }
        assert_eq!(ALLOCATIONS.with(Cell::get) - before, 0);
    }
}
