//! Two wrists of a G1 on 200 reachable targets, compared with Pink 4.4 with quadprog on the same targets.

use nalgebra::{Isometry3, Translation3};
use serde_json::Value;
use tandem_ik::bench::{DT_S, TUNED_DAMPING_COST, Target, TargetSet};
use tandem_ik::{Configuration, Limits, Model, Outcome, SolveOptions, Solver, Task};

const MAX_ITERATIONS: u64 = 300;
const TARGETS: &str = include_str!("../data/wrist_targets.json");

struct Bench {
    model: Model,
    set: TargetSet,
}

fn bench() -> Bench {
    let set = TargetSet::from_json(TARGETS).expect("valid targets");
    let model = Model::from_urdf(include_str!("../data/g1_upper_body.urdf")).expect("valid URDF");
    Bench { model: set.reduce(&model).expect("the same joints"), set }
}

impl Bench {
    fn tasks(&self, target: &Target, damping_cost: f64) -> Vec<Task> {
        self.set.tasks(&self.model, target, damping_cost).expect("both wrists")
    }

    fn start(&self) -> Configuration<'_> {
        Configuration::new(&self.model, &self.set.start_q_rad).expect("17 numbers")
    }

    /// Steps until every wrist is at its target, as Pink's users write the loop.
    fn iterate(&self, target: &Target, damping_cost: f64) -> Option<u64> {
        let tasks = self.tasks(target, damping_cost);
        let mut solver = Solver::new(&self.model, DT_S);
        let mut configuration = self.start();
        for iteration in 0..MAX_ITERATIONS {
            if solver.is_reached(&configuration, &tasks) {
                return Some(iteration);
            }
            let outcome = solver.step(&mut configuration, &tasks, &[]);
            assert!(!matches!(outcome, Outcome::Infeasible { .. }), "{outcome:?}");
        }
        solver.is_reached(&configuration, &tasks).then_some(MAX_ITERATIONS)
    }

    fn solved(&self, options: &SolveOptions) -> f64 {
        let reached = self.set.targets.iter().filter(|target| {
            let mut configuration = self.start();
            let tasks = self.tasks(target, TUNED_DAMPING_COST);
            let mut solver = Solver::new(&self.model, DT_S);
            let report = solver.solve(&mut configuration, &tasks, options);
            for (joint, q) in self.model.joints().iter().zip(configuration.q()) {
                assert!(*q >= joint.lower && *q <= joint.upper, "{} leaves its range", joint.name);
            }
            report.outcome == Outcome::Reached
        });
        reached.count() as f64 / self.set.targets.len() as f64
    }
}

#[test]
fn iterates_are_pinks() {
    let bench = bench();
    let file: Value = serde_json::from_str(TARGETS).expect("valid JSON");
    for (config, damping_cost, expected) in [("default", 0.0, 0.74), ("tuned", TUNED_DAMPING_COST, 0.90)] {
        let ours: Vec<Option<u64>> =
            bench.set.targets.iter().map(|target| bench.iterate(target, damping_cost)).collect();
        let pink = |target: &Value| target["pink_iterations"][config].as_u64();
        let pinks: Vec<Option<u64>> = file["targets"].as_array().into_iter().flatten().map(pink).collect();
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
    for target in bench.set.targets.iter().take(50) {
        let mut tasks = bench.tasks(target, TUNED_DAMPING_COST);
        for task in &mut tasks {
            if let Task::Frame(task) = task {
                let p = task.target.translation.vector;
                let far = Translation3::new(p.x * 2.5 + 0.3, p.y * 2.5, (p.z - 0.3) * 2.5 + 0.3);
                task.target = Isometry3::from_parts(far, task.target.rotation);
            }
        }
        let mut solver = Solver::new(&bench.model, DT_S);
        let mut configuration = bench.start();
        let report = solver.solve(&mut configuration, &tasks, &SolveOptions::default());
        assert!(matches!(report.outcome, Outcome::Stalled { .. }), "{report:?}");
        assert!(report.final_speed < 0.05, "{report:?}");
    }
}

#[test]
fn a_start_outside_the_limits_recovers_at_bounded_speed() {
    let bench = bench();
    let mut start = bench.set.start_q_rad.clone();
    start[1] = bench.model.joints()[1].upper + 0.4;
    let mut solver = Solver::new(&bench.model, DT_S);
    solver.limits = Limits { velocity: vec![2.0; 17], ..Limits::of(&bench.model) };
    let mut configuration = Configuration::new(&bench.model, &start).expect("17 numbers");
    let tasks = bench.tasks(&bench.set.targets[1], TUNED_DAMPING_COST);
    for _ in 0..60 {
        let outcome = solver.step(&mut configuration, &tasks, &[]);
        assert!(!matches!(outcome, Outcome::Infeasible { .. }), "{outcome:?}");
        assert!(solver.velocity().iter().all(|velocity| velocity.abs() <= 2.0 + 1e-9));
    }
    assert!(configuration.q()[1] <= bench.model.joints()[1].upper + 1e-6);
}
