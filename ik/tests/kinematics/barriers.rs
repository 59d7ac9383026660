//! Barriers hold while targets press against them, separate overlapping shapes, and come to rest.

use nalgebra::{Isometry3, Vector3};
use tandem_ik::{
    Configuration, DampingTask, FrameTask, Model, Outcome, PositionBarrier, PostureTask, SelfCollision,
    SolveOptions, Solver, Task,
};

use super::common;

const DT_S: f64 = 0.02;

fn tasks(model: &Model, targets: [Isometry3<f64>; 2]) -> Vec<Task> {
    let sites = ["left_wrist", "right_wrist"].map(|site| model.frame(site).expect("a site"));
    let mut tasks: Vec<Task> =
        sites.iter().zip(targets).map(|(site, target)| Task::Frame(FrameTask::new(*site, target))).collect();
    tasks.push(Task::Posture(PostureTask { target: common::READY_RAD.to_vec(), cost: 1e-2, gain: 1.0 }));
    tasks.push(Task::Damping(DampingTask { cost: 2e-3 }));
    tasks
}

fn wrists(configuration: &Configuration) -> [Isometry3<f64>; 2] {
    ["left_wrist", "right_wrist"]
        .map(|site| configuration.root_from_frame(configuration.model().frame(site).expect("a site")))
}

fn shifted(poses: [Isometry3<f64>; 2], by: [[f64; 3]; 2]) -> [Isometry3<f64>; 2] {
    let mut poses = poses;
    for (pose, by) in poses.iter_mut().zip(by) {
        pose.translation.vector += Vector3::from(by);
    }
    poses
}

fn solver(model: &Model) -> Solver {
    let mut solver = Solver::new(model, DT_S);
    solver.limits.velocity = vec![4.0; model.nv()];
    solver.self_collision = Some(common::self_collision(model));
    solver
}

/// Hands sent through each other, through the trunk and through the head stop at the margin and stay there.
#[test]
fn shapes_keep_apart_and_rest() {
    let model = common::g1();
    let start = common::ready(&model);
    let cases = [
        ("each other", [[0.15, -0.30, 0.1], [0.15, 0.30, 0.1]]),
        ("the trunk", [[-0.05, -0.25, 0.15], [0.0, 0.0, 0.0]]),
        ("the head", [[0.0, -0.22, 0.55], [0.0, 0.22, 0.55]]),
    ];
    for (what, by) in cases {
        let tasks = tasks(&model, shifted(wrists(&start), by));
        let (mut solver, mut configuration) = (solver(&model), start.clone());
        let mut closest = f64::INFINITY;
        for step in 0..400 {
            let outcome = solver.step(&mut configuration, &tasks, &[]);
            assert!(!matches!(outcome, Outcome::Infeasible { .. }), "{what}, step {step}: {outcome:?}");
            closest = closest.min(solver.closest_pair(&configuration).expect("ten pairs").distance_m);
        }
        let fastest = solver.velocity().iter().fold(0.0_f64, |fastest, speed| fastest.max(speed.abs()));
        assert!(closest > 0.0, "{what}: overlap of {} m", -closest);
        assert!(closest < 0.02, "{what}: the hands never came near, {closest} m");
        assert!(fastest < 0.05, "{what}: still moving at {fastest} rad/s");
    }
}

#[test]
fn overlapping_shapes_come_apart_at_bounded_speed() {
    let model = common::g1();
    let start = common::ready(&model);
    let mut free = solver(&model);
    free.self_collision = None;
    let mut configuration = start.clone();
    let crossed = tasks(&model, shifted(wrists(&start), [[0.15, -0.20, 0.1], [0.15, 0.20, 0.1]]));
    free.solve(&mut configuration, &crossed, &SolveOptions::default());
    let mut solver = solver(&model);
    let overlap = solver.closest_pair(&configuration).expect("ten pairs").distance_m;
    assert!(overlap < -0.02, "the start does not overlap: {overlap} m");
    for _ in 0..200 {
        let outcome = solver.step(&mut configuration, &crossed, &[]);
        assert!(!matches!(outcome, Outcome::Infeasible { .. }), "{outcome:?}");
        assert!(solver.velocity().iter().all(|speed| speed.abs() < 4.0 + 1e-9));
    }
    let apart = solver.closest_pair(&configuration).expect("ten pairs").distance_m;
    assert!(apart > 0.0, "still {apart} m");
}

/// Two barriers with opposite demands hold still rather than fail; one that contradicts an equality is named.
#[test]
fn contradictions_hold_still_or_are_named() {
    let model = common::g1();
    let mut configuration = common::ready(&model);
    let left = model.frame("left_wrist").expect("a site");
    let height = configuration.root_from_frame(left).translation.vector.z;
    let mut solver = solver(&model);
    let plane = |sign: f64, by: f64| PositionBarrier {
        frame: left,
        normal: Vector3::z() * sign,
        offset_m: sign * height + by,
        gain: 0.5,
    };
    solver.position_barriers = vec![plane(1.0, 0.1), plane(-1.0, 0.1)];
    let tasks = tasks(&model, wrists(&configuration));
    let outcome = solver.step(&mut configuration, &tasks, &[]);
    assert!(!matches!(outcome, Outcome::Infeasible { .. }), "{outcome:?}");
    assert!((configuration.root_from_frame(left).translation.vector.z - height).abs() < 1e-4);

    solver.position_barriers = vec![plane(1.0, -0.01)];
    let below = shifted(wrists(&configuration), [[0.0, 0.0, -0.02], [0.0, 0.0, 0.0]]);
    let through = [Task::Frame(FrameTask::new(left, below[0]))];
    let Outcome::Infeasible { constraint } = solver.step(&mut configuration, &tasks, &through) else {
        panic!("a hand cannot be on both sides of a plane");
    };
    assert!(constraint.contains("left_wrist"), "{constraint}");
}

#[test]
fn a_frame_stays_beyond_its_plane() {
    let model = common::g1();
    let mut configuration = common::ready(&model);
    let left = model.frame("left_wrist").expect("a site");
    let floor_m = configuration.root_from_frame(left).translation.vector.z - 0.05;
    let tasks = tasks(&model, shifted(wrists(&configuration), [[0.1, 0.0, -0.2], [0.0, 0.0, 0.0]]));
    let mut solver = solver(&model);
    solver.position_barriers =
        vec![PositionBarrier { frame: left, normal: Vector3::z(), offset_m: floor_m, gain: 0.3 }];
    for _ in 0..200 {
        solver.step(&mut configuration, &tasks, &[]);
        assert!(configuration.root_from_frame(left).translation.vector.z > floor_m - 1e-4);
    }
    assert!(
        configuration.root_from_frame(left).translation.vector.z < floor_m + 1e-3,
        "the hand stops short"
    );
}

/// Solutions with the barrier on: reached ones are free of overlap, and the report gives the distance of
/// the closest shapes.
#[test]
fn planned_solutions_do_not_overlap() {
    let model = common::g1();
    let file = include_str!("../data/wrist_targets.json");
    let set = tandem_ik::bench::TargetSet::from_json(file).expect("valid targets");
    let json: serde_json::Value = serde_json::from_str(file).expect("valid JSON");
    let mut reached = [0, 0];
    let mut counted = [0, 0];
    for (target, entry) in set.targets.iter().zip(json["targets"].as_array().into_iter().flatten()) {
        let collides = usize::from(entry["witness_self_collides"].as_bool() == Some(true));
        let tasks = set.tasks(&model, target, tandem_ik::bench::TUNED_DAMPING_COST).expect("both wrists");
        let mut solver = Solver::new(&model, DT_S);
        solver.self_collision = Some(SelfCollision { range_m: 0.2, ..common::self_collision(&model) });
        let mut configuration = common::ready(&model);
        let options = SolveOptions { restarts: 10, ..SolveOptions::default() };
        let report = solver.solve(&mut configuration, &tasks, &options);
        counted[collides] += 1;
        if report.outcome == Outcome::Reached {
            let closest = report.closest_pair.expect("ten pairs");
            assert!(closest.distance_m >= 0.0, "{closest:?}");
            reached[collides] += 1;
        }
    }
    println!(
        "reached {} of {} free, {} of {} colliding witnesses",
        reached[0], counted[0], reached[1], counted[1]
    );
    assert_eq!(reached[0], counted[0], "targets that a free posture reaches");
}
