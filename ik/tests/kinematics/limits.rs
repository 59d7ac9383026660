//! Joint limits hold in every step, and reports name the joint and the limit.

use nalgebra::Vector3;
use tandem_ik::{
    CenterOfMassTask, FrameTask, JointCouplingTask, JointVelocityTask, LimitKind, Outcome, PostureTask,
    RelativeFrameTask, SolveOptions, Solver, Task,
};

use super::common;

const DT_S: f64 = 0.02;

/// Joints sent past their ranges accelerate, brake and stop inside, all within the acceleration limit.
#[test]
fn joints_brake_before_their_range_ends() {
    let model = common::g1();
    let beyond: Vec<f64> = model.joints().iter().map(|joint| joint.upper + 0.5).collect();
    let task = [Task::Posture(PostureTask { target: beyond, cost: 1.0, gain: 1.0 })];
    for (acceleration, speed) in [(5.0, 2.0), (20.0, 4.0), (50.0, 10.0)] {
        let mut configuration = common::ready(&model);
        let mut solver = Solver::new(&model, DT_S);
        solver.limits.velocity = vec![speed; 17];
        solver.limits.acceleration = Some(vec![acceleration; 17]);
        let mut last = vec![0.0; 17];
        for step in 0..600 {
            let outcome = solver.step(&mut configuration, &task, &[]);
            assert!(!matches!(outcome, Outcome::Infeasible { .. }), "{outcome:?}");
            for (joint, (now, before)) in solver.velocity().iter().zip(&last).enumerate() {
                let name = &model.joints()[joint].name;
                assert!(now.abs() <= speed + 1e-9, "{name}, step {step}: {now} rad/s");
                let change = (now - before).abs() / DT_S;
                assert!(
                    change <= acceleration * (1.0 + 1e-6),
                    "{name}, step {step}: {change} rad/s^2 of {acceleration}"
                );
            }
            last.copy_from_slice(solver.velocity());
        }
        for (joint, q) in model.joints().iter().zip(configuration.q()) {
            assert!(
                *q <= joint.upper + 1e-9 && *q > joint.upper - 0.02,
                "{} rests at {q} of {}",
                joint.name,
                joint.upper
            );
        }
    }
}

#[test]
fn clamped_joints_are_named_with_their_limit() {
    let model = common::g1();
    let elbow = model.joint("left_elbow_joint").expect("a joint");
    let mut target = common::READY_RAD.to_vec();
    target[elbow] = model.joints()[elbow].upper + 1.0;
    let task = [Task::Posture(PostureTask { target, cost: 1.0, gain: 1.0 })];
    let mut configuration = common::ready(&model);
    let mut solver = Solver::new(&model, DT_S);
    solver.limits.velocity = vec![1.0; 17];
    let mut seen = Vec::new();
    for _ in 0..200 {
        solver.step(&mut configuration, &task, &[]);
        for clamped in solver.clamped(&configuration) {
            assert_eq!(clamped.joint, elbow);
            assert!(
                (clamped.margin - (model.joints()[elbow].upper - configuration.q()[elbow])).abs() < 1e-12
            );
            if seen.last() != Some(&clamped.limit) {
                seen.push(clamped.limit);
            }
        }
    }
    assert_eq!(seen, [LimitKind::Velocity, LimitKind::Configuration]);
    assert_eq!(tandem_ik::saturated(&configuration), [elbow]);
}

/// Both hands carry a tray: their relative pose is a constraint while the left hand moves.
#[test]
fn constraints_hold_while_tasks_pull() {
    let model = common::g1();
    let mut configuration = common::ready(&model);
    let [left, right] = ["left_wrist", "right_wrist"].map(|site| model.frame(site).expect("a site"));
    let right_in_left = configuration.root_from_frame(left).inverse() * configuration.root_from_frame(right);
    let tray = Task::RelativeFrame(RelativeFrameTask {
        frame: right,
        reference: left,
        target: right_in_left,
        position_cost: 1.0,
        orientation_cost: 1.0,
        gain: 1.0,
    });
    let mut target = configuration.root_from_frame(left);
    target.translation.vector += Vector3::new(0.08, 0.0, 0.10);
    let posture = Task::Posture(PostureTask { target: common::READY_RAD.to_vec(), cost: 1e-3, gain: 1.0 });
    let tasks = [Task::Frame(FrameTask::new(left, target)), posture];
    let mut solver = Solver::new(&model, DT_S);
    solver.limits.velocity = vec![1.0; 17];
    let mut outcome = Outcome::Moving;
    for _ in 0..100 {
        outcome = solver.step(&mut configuration, &tasks, std::slice::from_ref(&tray));
        let error = tray.error(&configuration).expect("a pose");
        assert!(error.position_m < 1e-3 && error.orientation_rad < 2e-3, "{error:?}");
    }
    assert_eq!(outcome, Outcome::Reached);
}

#[test]
fn impossible_constraints_are_named() {
    let model = common::g1();
    let waist = model.joint("waist_yaw_joint").expect("a joint");
    let far = Task::JointCoupling(JointCouplingTask {
        ratios: vec![(waist, 1.0)],
        offset: 2.0,
        cost: 1.0,
        gain: 1.0,
    });
    let mut configuration = common::ready(&model);
    let mut solver = Solver::new(&model, DT_S);
    solver.limits.velocity = vec![1.0; 17];
    let posture = [Task::Posture(PostureTask { target: common::READY_RAD.to_vec(), cost: 1.0, gain: 1.0 })];
    let Outcome::Infeasible { constraint } = solver.step(&mut configuration, &posture, &[far]) else {
        panic!("2 rad in one step");
    };
    assert!(constraint.contains("waist_yaw_joint"), "{constraint}");
    assert_eq!(configuration.q(), common::READY_RAD);
}

#[test]
fn the_other_tasks_do_what_they_say() {
    let model = common::g1();
    let mut configuration = common::ready(&model);
    let mut solver = Solver::new(&model, DT_S);
    let mut speeds = vec![0.0; 17];
    speeds[5] = 0.4;
    solver.step(
        &mut configuration,
        &[Task::JointVelocity(JointVelocityTask { target: speeds.clone(), cost: 1.0 })],
        &[],
    );
    for (speed, asked) in solver.velocity().iter().zip(&speeds) {
        assert!((speed - asked).abs() < 1e-6, "{speed} of {asked} rad/s");
    }

    let goal = configuration.center_of_mass() + Vector3::new(0.02, 0.03, 0.0);
    let cost = Vector3::new(1.0, 1.0, 0.0);
    let centre = [
        Task::CenterOfMass(CenterOfMassTask { target: goal, cost, gain: 1.0 }),
        Task::Posture(PostureTask { target: common::READY_RAD.to_vec(), cost: 1e-3, gain: 1.0 }),
    ];
    let report = solver.solve(&mut configuration, &centre, &SolveOptions::default());
    assert_eq!(report.outcome, Outcome::Reached);
    assert!((configuration.center_of_mass() - goal).xy().norm() < 1e-3);
}

/// A joint that may not move keeps its coordinate bit for bit, even if a solution restarts from random
/// coordinates.
#[test]
fn a_joint_without_speed_stays_through_steps_and_restarts() {
    let model = common::g1();
    let mut solver = Solver::new(&model, DT_S);
    let held: Vec<usize> =
        (0..model.nv()).filter(|joint| model.joints()[*joint].name.starts_with("left")).collect();
    for joint in &held {
        solver.limits.velocity[*joint] = 0.0;
    }
    let wrist = model.frame("right_wrist").expect("a frame");
    let far = nalgebra::Isometry3::translation(0.9, -0.2, 0.2);
    let tasks = [Task::Frame(FrameTask::new(wrist, far))];
    let mut configuration = common::ready(&model);
    let options = SolveOptions { restarts: 3, ..SolveOptions::default() };
    assert_eq!(solver.solve(&mut configuration, &tasks, &options).restarts, 3, "nothing is that near");
    let start = common::ready(&model);
    assert!(
        held.iter().all(|joint| configuration.q()[*joint] == start.q()[*joint]),
        "{:?}",
        configuration.q()
    );
    assert!(configuration.q() != start.q());
}
