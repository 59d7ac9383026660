//! Benchmark of the crate on pairs of wrist targets, measured like Pink and related solvers.
//!
//! A targets file holds the free joints, their start coordinates, and poses to reach:
//! ```text
//!   {"free_joints": [NAME], "start_q_rad": [NUMBER], "frames": [NAME], "limits": {NAME: {"velocity": rad/s}},
//!    "targets": [{"frames": {NAME: {"position_m": [x, y, z], "quaternion_wxyz": [w, x, y, z]}}}]}
//! ```
//! Without a file, [`TargetSet::sample`] draws targets by forward kinematics, which makes them reachable.

mod targets;

use std::time::Instant;

use serde::Serialize;

pub use targets::{SpeedLimit, Target, TargetPose, TargetSet};

use crate::error::IkError;
use crate::model::{Configuration, Model};
use crate::solver::{Limits, Outcome, SolveOptions, Solver};
use crate::tasks::Task;

/// Length of a step, s.
pub const DT_S: f64 = 0.02;
const MAX_STEPS: usize = 300;
/// Damping cost of the tuned run. Pink's damping task leaves dt out, so this is its cost of 0.01 times dt.
pub const TUNED_DAMPING_COST: f64 = 1e-2 * DT_S;
const RESTARTS: usize = 10;

/// Measurements of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// One entry per method.
    pub configurations: Vec<Measured>,
}

/// Results of one method over all targets.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Name of the method. `default` and `tuned` are Pink's, the others use features beyond Pink.
    pub name: &'static str,
    /// Share of the targets reached, 0..=1.
    pub reached: f64,
    /// Median number of steps, over reached targets.
    pub iterations_median: f64,
    /// Median time for kinematics, Jacobians and quadratic program of one step, us.
    pub step_us_median: f64,
    /// Median time from start to target, over reached targets, ms.
    pub solve_ms_median: f64,
}

/// A method of approaching targets.
#[derive(Clone, Copy)]
struct Way {
    name: &'static str,
    damping_cost: f64,
    /// Number of restarts; `None` steps until the frames reach their targets, as Pink's users write the loop.
    restarts: Option<usize>,
}

const WAYS: [Way; 4] = [
    Way { name: "default", damping_cost: 0.0, restarts: None },
    Way { name: "tuned", damping_cost: TUNED_DAMPING_COST, restarts: None },
    Way { name: "clamp and line search", damping_cost: TUNED_DAMPING_COST, restarts: Some(0) },
    Way { name: "at most 10 restarts", damping_cost: TUNED_DAMPING_COST, restarts: Some(RESTARTS) },
];

/// Solves every target with every method. `whole` may have more joints than the set frees.
///
/// # Errors
///
/// Returns an error if the set names joints or frames that the model lacks.
pub fn run(whole: &Model, set: &TargetSet) -> Result<Report, IkError> {
    let model = set.reduce(whole)?;
    let configurations = WAYS.iter().map(|way| measure(&model, set, way)).collect::<Result<_, _>>()?;
    Ok(Report { configurations })
}

fn measure(model: &Model, set: &TargetSet, way: &Way) -> Result<Measured, IkError> {
    let mut solver = Solver::new(model, DT_S);
    solver.limits = Limits::of(model);
    let mut configuration = Configuration::new(model, &set.start_q_rad)?;
    let (mut iterations, mut step_us, mut solve_ms) = (Vec::new(), Vec::new(), Vec::new());
    for target in &set.targets {
        let tasks = set.tasks(model, target, way.damping_cost)?;
        configuration.set(&set.start_q_rad)?;
        solver.rest();
        let start = Instant::now();
        let needed = match way.restarts {
            None => step_until_reached(&mut solver, &mut configuration, &tasks, &mut step_us),
            Some(restarts) => {
                let options = SolveOptions { restarts, ..SolveOptions::default() };
                let report = solver.solve(&mut configuration, &tasks, &options);
                step_us.push(start.elapsed().as_secs_f64() * 1e6 / report.iterations.max(1) as f64);
                (report.outcome == Outcome::Reached).then_some(report.iterations)
            }
        };
        if let Some(needed) = needed {
            iterations.push(needed as f64);
            solve_ms.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    Ok(Measured {
        name: way.name,
        reached: iterations.len() as f64 / set.targets.len().max(1) as f64,
        iterations_median: median(&mut iterations),
        step_us_median: median(&mut step_us),
        solve_ms_median: median(&mut solve_ms),
    })
}

/// Steps as Pink's users write the loop. Returns the number of steps, or `None` if the target was not
/// reached.
fn step_until_reached(
    solver: &mut Solver,
    configuration: &mut Configuration,
    tasks: &[Task],
    step_us: &mut Vec<f64>,
) -> Option<usize> {
    for taken in 0..MAX_STEPS {
        if solver.is_reached(configuration, tasks) {
            return Some(taken);
        }
        let start = Instant::now();
        let outcome = solver.step(configuration, tasks, &[]);
        step_us.push(start.elapsed().as_secs_f64() * 1e6);
        if matches!(outcome, Outcome::Infeasible { .. }) {
            return None;
        }
    }
    solver.is_reached(configuration, tasks).then_some(MAX_STEPS)
}

/// Returns the median, or 0 without values.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
