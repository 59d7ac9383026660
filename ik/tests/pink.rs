//! Two wrists of a G1 on 200 reachable targets, held against Pink 4.4 with quadprog on the same targets.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde_json::Value;
use tandem_ik::{
    Configuration, DampingTask, FrameTask, Limits, Model, Outcome, PostureTask, SolveOptions, Solver, Task,
};

const DT_S: f64 = 0.02;
const MAX_ITERATIONS: usize = 300;
const POSTURE_COST: f64 = 1e-3;
/// Pink's damping task leaves dt out, so its cost of 0.01 is ours times dt.
const TUNED_DAMPING_COST: f64 = 1e-2 * DT_S;

struct Bench {
    model: Model,
    start_rad: Vec<f64>,
    targets: Vec<[Isometry3<f64>; 2]>,
    pink: Vec<Value>,
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|i| value[i].as_f64().expect("a number"))
}

fn bench() -> Bench {
    let data: Value = serde_json::from_str(include_str!("data/wrist_targets.json")).expect("valid JSON");
    let model = Model::from_urdf(include_str!("data/g1_upper_body.urdf")).expect("valid URDF");
    let free: Vec<&str> = data["free_joints"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    let names: Vec<&str> = model.joints().iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, free);
    let targets = data["targets"].as_array().expect("a list");
    let pose = |target: &Value, side: &str| {
        let [x, y, z] = numbers(&target[format!("{side}_position_m")]);
        let [w, i, j, k] = numbers(&target[format!("{side}_quaternion_wxyz")]);
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        Isometry3::from_parts(Translation3::new(x, y, z), rotation)
    };
    Bench {
        model,
        start_rad: numbers::<17>(&data["start_q_rad"]).to_vec(),
        targets: targets.iter().map(|target| [pose(target, "left"), pose(target, "right")]).collect(),
        pink: targets.iter().map(|target| target["pink_iterations"].clone()).collect(),
    }
}

impl Bench {
    fn tasks(&self, targets: &[Isometry3<f64>; 2], damping_cost: f64) -> Vec<Task> {
        let frame = |name: &str, target| {
            Task::Frame(FrameTask::new(self.model.frame(name).expect("a wrist"), target))
        };
        let mut tasks = vec![
            frame("left_wrist_yaw_link", targets[0]),
            frame("right_wrist_yaw_link", targets[1]),
            Task::Posture(PostureTask { target: self.start_rad.clone(), cost: POSTURE_COST, gain: 1.0 }),
        ];
        if damping_cost > 0.0 {
            tasks.push(Task::Damping(DampingTask { cost: damping_cost }));
        }
        tasks
    }

    /// Steps until every wrist is there, as Pink's users write the loop.
    fn iterate(&self, targets: &[Isometry3<f64>; 2], damping_cost: f64) -> Option<u64> {
        let tasks = self.tasks(targets, damping_cost);
        let mut solver = Solver::new(&self.model, DT_S);
        let mut configuration = Configuration::new(&self.model, &self.start_rad).expect("17 numbers");
        for iteration in 0..MAX_ITERATIONS as u64 {
            if solver.is_reached(&configuration, &tasks) {
                return Some(iteration);
            }
            let outcome = solver.step(&mut configuration, &tasks, &[]);
            assert!(!matches!(outcome, Outcome::Infeasible { .. }), "{outcome:?}");
        }
        solver.is_reached(&configuration, &tasks).then_some(MAX_ITERATIONS as u64)
    }

    fn solved(&self, options: &SolveOptions) -> f64 {
        let reached = self.targets.iter().filter(|targets| {
            let mut configuration = Configuration::new(&self.model, &self.start_rad).expect("17 numbers");
            let tasks = self.tasks(targets, TUNED_DAMPING_COST);
            let mut solver = Solver::new(&self.model, DT_S);
            let report = solver.solve(&mut configuration, &tasks, options);
            for (joint, q) in self.model.joints().iter().zip(configuration.q()) {
                assert!(*q >= joint.lower && *q <= joint.upper, "{} leaves its range", joint.name);
            }
            report.outcome == Outcome::Reached
        });
        reached.count() as f64 / self.targets.len() as f64
    }
}

#[test]
fn iterates_are_pinks() {
    let bench = bench();
    for (config, damping_cost, expected) in [("default", 0.0, 0.74), ("tuned", TUNED_DAMPING_COST, 0.90)] {
        let ours: Vec<Option<u64>> = bench.targets.iter().map(|targets| bench.iterate(targets, damping_cost)).collect();
        let pinks: Vec<Option<u64>> = bench.pink.iter().map(|iterations| iterations[config].as_u64()).collect();
        let equal = ours.iter().zip(&pinks).filter(|(ours, pinks)| ours == pinks).count();
        let reached = ours.iter().flatten().count() as f64 / ours.len() as f64;
        assert_eq!(equal, 200, "{config}: {equal} of 200 iteration counts are Pink's");
        assert!((reached - expected).abs() < 1e-9, "{config}: reached {reached}");
    }
}

#[test]
fn clamp_and_line_search_reach_more_and_restarts_reach_all() {
    let bench = bench();
    let once = bench.solved(&SolveOptions::default());
    assert!(once >= 0.94, "reached {once} without restarts");
    let restarted = bench.solved(&SolveOptions { restarts: 10, ..SolveOptions::default() });
    assert!(restarted == 1.0, "reached {restarted} with ten restarts");
}

#[test]
fn unreachable_targets_come_to_rest() {
    let bench = bench();
    for targets in bench.targets.iter().take(50) {
        let far = targets.map(|target| {
            let p = target.translation.vector;
            Isometry3::from_parts(Translation3::new(p.x * 2.5 + 0.3, p.y * 2.5, (p.z - 0.3) * 2.5 + 0.3), target.rotation)
        });
        let tasks = bench.tasks(&far, TUNED_DAMPING_COST);
        let mut solver = Solver::new(&bench.model, DT_S);
        let mut configuration = Configuration::new(&bench.model, &bench.start_rad).expect("17 numbers");
        let report = solver.solve(&mut configuration, &tasks, &SolveOptions::default());
        assert!(matches!(report.outcome, Outcome::Stalled { .. }), "{report:?}");
        assert!(report.final_speed < 0.05, "{report:?}");
    }
}

#[test]
fn a_start_outside_the_limits_recovers_at_bounded_speed() {
    let bench = bench();
    let mut start = bench.start_rad.clone();
    start[1] = bench.model.joints()[1].upper + 0.4;
    let mut solver = Solver::new(&bench.model, DT_S);
    solver.limits = Limits { velocity: vec![2.0; 17], ..Limits::of(&bench.model) };
    let mut configuration = Configuration::new(&bench.model, &start).expect("17 numbers");
    let tasks = bench.tasks(&bench.targets[1], TUNED_DAMPING_COST);
    for _ in 0..60 {
        let outcome = solver.step(&mut configuration, &tasks, &[]);
        assert!(!matches!(outcome, Outcome::Infeasible { .. }), "{outcome:?}");
        assert!(solver.velocity().iter().all(|velocity| velocity.abs() <= 2.0 + 1e-9));
    }
    assert!(configuration.q()[1] <= bench.model.joints()[1].upper + 1e-6);
}
