//! Streaming: targets out of reach bring the joints to rest, and targets that move are followed.

use nalgebra::{Translation3, Vector3};
use tandem_ik::bench::TargetSet;
use tandem_ik::{FrameTask, Model, Outcome, PostureTask, Solver, Task};

use super::common;

const DT_S: f64 = 0.02;
const SPEED_RAD_S: f64 = 4.0;

fn solver(model: &Model, apart: bool) -> Solver {
    let mut solver = Solver::new(model, DT_S);
    solver.limits.velocity = vec![SPEED_RAD_S; model.nv()];
    solver.self_collision = apart.then(|| common::self_collision(model));
    solver
}

/// 50 pairs of targets up to twice an arm's length away, 10 s each.
#[test]
fn unreachable_targets_bring_the_joints_to_rest() {
    let model = common::g1();
    let set = TargetSet::from_json(include_str!("../data/wrist_targets.json")).expect("valid targets");
    let cases = [("plain", 1.0, 0.0, false), ("damped", 0.5, 2e-4, false), ("apart", 0.5, 2e-4, true)];
    for (case, gain, damping, apart) in cases {
        let mut resting = 0;
        for (number, target) in set.targets.iter().take(50).enumerate() {
            let mut tasks = set.tasks(&model, target, damping).expect("both wrists");
            for task in &mut tasks {
                if let Task::Frame(task) = task {
                    let p = task.target.translation.vector;
                    let far = Vector3::new(p.x * 2.5 + 0.3, p.y * 2.5, (p.z - 0.3) * 2.5 + 0.3);
                    task.target.translation = Translation3::from(far);
                    task.gain = gain;
                }
            }
            let mut solver = solver(&model, apart);
            let mut configuration = common::ready(&model);
            let mut outcome = Outcome::Moving;
            let mut fastest = 0.0_f64;
            for step in 0..500 {
                outcome = solver.track(&mut configuration, &tasks, &[]);
                assert!(solver.fastest() <= SPEED_RAD_S + 1e-9);
                if step >= 450 {
                    fastest = fastest.max(solver.fastest());
                }
            }
            assert!(
                !matches!(outcome, Outcome::Reached | Outcome::Infeasible { .. }),
                "{case}, {number}: {outcome:?}"
            );
            // The remaining motion is slow progress along a valley of the objective, not vibration.
            assert!(fastest < 0.3, "{case}, target {number}: {fastest} rad/s in the last second");
            resting += usize::from(fastest < 0.05);
        }
        assert!(resting >= 48, "{case}: {resting} of 50 at rest");
    }
}

/// The left wrist goes round a circle of 8 cm radius in 2 s; removing half of the error per step gives a
/// lag of two steps.
#[test]
fn moving_targets_are_followed() {
    let model = common::g1();
    let mut configuration = common::ready(&model);
    let left = model.frame("left_wrist").expect("a site");
    let start = configuration.root_from_frame(left);
    let target = |time_s: f64| {
        let angle = std::f64::consts::PI * time_s;
        let mut pose = start;
        pose.translation.vector += 0.08 * Vector3::new(angle.sin(), 0.0, 1.0 - angle.cos());
        pose
    };
    let posture = Task::Posture(PostureTask { target: common::READY_RAD.to_vec(), cost: 1e-3, gain: 1.0 });
    let mut solver = solver(&model, true);
    let speed_m_s = 0.08 * std::f64::consts::PI;
    for step in 1..=200 {
        let task = FrameTask { gain: 0.5, ..FrameTask::new(left, target(f64::from(step) * DT_S)) };
        solver.track(&mut configuration, &[Task::Frame(task.clone()), posture.clone()], &[]);
        let lag_m = task.error(&configuration).position_m;
        assert!(lag_m < 1.5 * speed_m_s * DT_S, "step {step}: {lag_m} m behind");
    }
}
