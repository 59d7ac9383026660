//! Measures the crate on pairs of wrist targets, the way that Pink and its relatives are measured.
//!
//! A targets file holds the joints that are free, where they start, and poses to reach:
//! ```text
//!   {"free_joints": [NAME], "start_q_rad": [NUMBER], "frames": [NAME], "limits": {NAME: {"velocity": rad/s}},
//!    "targets": [{"frames": {NAME: {"position_m": [x, y, z], "quaternion_wxyz": [w, x, y, z]}}}]}
//! ```
//! Without a file, [`TargetSet::sample`] draws targets that are reachable because joint coordinates put them there.

use std::collections::BTreeMap;
use std::time::Instant;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

use crate::solve::random_coordinate;
use crate::{
    Configuration, DampingTask, FrameTask, IkError, Limits, Model, Outcome, PostureTask, SolveOptions,
    Solver, Task,
};

/// Length of a step, s.
pub const DT_S: f64 = 0.02;
const MAX_STEPS: usize = 300;
const POSTURE_COST: f64 = 1e-3;
/// Pink's damping task leaves dt out, so its cost of 0.01 is ours times dt.
pub const TUNED_DAMPING_COST: f64 = 1e-2 * DT_S;
const RESTARTS: usize = 10;

/// Frames, where the joints start, and poses to reach from there.
#[derive(Clone, Debug, Deserialize)]
pub struct TargetSet {
    /// Joints that move; every other joint of the model is locked at 0.
    pub free_joints: Vec<String>,
    /// One per free joint, rad.
    pub start_q_rad: Vec<f64>,
    /// Names of the frames to move.
    pub frames: Vec<String>,
    /// Largest speeds where the model's file gives none or others.
    #[serde(default)]
    pub limits: BTreeMap<String, SpeedLimit>,
    /// One entry per problem.
    pub targets: Vec<Target>,
}

/// Limit of one joint.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct SpeedLimit {
    /// rad/s.
    pub velocity: f64,
}

/// One problem: a pose for each frame, by name.
#[derive(Clone, Debug, Deserialize)]
pub struct Target {
    /// In the root's frame.
    pub frames: BTreeMap<String, TargetPose>,
}

/// A pose as files write it.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct TargetPose {
    /// x, y, z.
    pub position_m: [f64; 3],
    /// Hamilton, scalar first; normalised on use.
    pub quaternion_wxyz: [f64; 4],
}

/// What a run measured.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// One entry per way to solve.
    pub configurations: Vec<Measured>,
}

/// One way to solve, over all targets.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// `default` and `tuned` are Pink's two; the others add what this crate has beyond it.
    pub name: &'static str,
    /// Part of the targets reached, 0..=1.
    pub reached: f64,
    /// Steps, over reached targets.
    pub iterations_median: f64,
    /// Kinematics, Jacobians and quadratic program of one step, us.
    pub step_us_median: f64,
    /// From start to target, over reached targets, ms.
    pub solve_ms_median: f64,
}

/// How targets are approached.
#[derive(Clone, Copy)]
struct Way {
    name: &'static str,
    damping_cost: f64,
    /// `None` steps until the frames are there, as Pink's users write the loop.
    restarts: Option<usize>,
}

const WAYS: [Way; 4] = [
    Way { name: "default", damping_cost: 0.0, restarts: None },
    Way { name: "tuned", damping_cost: TUNED_DAMPING_COST, restarts: None },
    Way { name: "clamp and line search", damping_cost: TUNED_DAMPING_COST, restarts: Some(0) },
    Way { name: "at most 10 restarts", damping_cost: TUNED_DAMPING_COST, restarts: Some(RESTARTS) },
];

impl TargetSet {
    /// Reads a targets file.
    pub fn from_json(text: &str) -> Result<TargetSet, IkError> {
        Ok(serde_json::from_str(text)?)
    }

    /// Draws `count` targets: each free joint uniform in the middle 80 % of its range, poses by forward kinematics.
    /// Shapes may overlap there.
    pub fn sample(
        model: &Model,
        frames: &[&str],
        start_q_rad: &[f64],
        count: usize,
        seed: u64,
    ) -> Result<TargetSet, IkError> {
        let mut configuration = Configuration::new(model, start_q_rad)?;
        let ids = frames.iter().map(|frame| model.frame(frame)).collect::<Result<Vec<_>, _>>()?;
        let mut random = seed.max(1);
        let mut targets = Vec::with_capacity(count);
        for _ in 0..count {
            let q: Vec<f64> =
                model.joints().iter().map(|joint| random_coordinate(joint, &mut random)).collect();
            configuration.set(&q)?;
            let poses = ids.iter().map(|id| TargetPose::of(&configuration.root_from_frame(*id)));
            targets
                .push(Target { frames: frames.iter().map(|frame| frame.to_string()).zip(poses).collect() });
        }
        Ok(TargetSet {
            free_joints: model.joints().iter().map(|joint| joint.name.clone()).collect(),
            start_q_rad: start_q_rad.to_vec(),
            frames: frames.iter().map(|frame| frame.to_string()).collect(),
            limits: BTreeMap::new(),
            targets,
        })
    }

    /// The model with the free joints only, at the speeds that the set asks for.
    pub fn reduce(&self, whole: &Model) -> Result<Model, IkError> {
        let free: Vec<&str> = self.free_joints.iter().map(String::as_str).collect();
        let mut model = whole.reduced(&free, &vec![0.0; whole.nv()])?;
        for (name, limit) in &self.limits {
            let joint = model.joint(name)?;
            model.joints[joint].velocity = limit.velocity;
        }
        Ok(model)
    }

    /// The tasks of one target: every frame at its pose, posture at the start, damping if it costs anything.
    pub fn tasks(&self, model: &Model, target: &Target, damping_cost: f64) -> Result<Vec<Task>, IkError> {
        let mut tasks = Vec::with_capacity(self.frames.len() + 2);
        for name in &self.frames {
            let pose = target.frames.get(name).ok_or_else(|| IkError::UnknownFrame {
                name: name.clone(),
                have: target.frames.keys().cloned().collect::<Vec<_>>().join(", "),
            })?;
            tasks.push(Task::Frame(FrameTask::new(model.frame(name)?, pose.isometry())));
        }
        tasks.push(Task::Posture(PostureTask {
            target: self.start_q_rad.clone(),
            cost: POSTURE_COST,
            gain: 1.0,
        }));
        if damping_cost > 0.0 {
            tasks.push(Task::Damping(DampingTask { cost: damping_cost }));
        }
        Ok(tasks)
    }
}

impl TargetPose {
    fn of(pose: &Isometry3<f64>) -> TargetPose {
        let (p, q) = (pose.translation.vector, pose.rotation);
        TargetPose { position_m: [p.x, p.y, p.z], quaternion_wxyz: [q.w, q.i, q.j, q.k] }
    }

    /// The pose.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [w, i, j, k] = self.quaternion_wxyz;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        Isometry3::from_parts(Translation3::from(self.position_m), rotation)
    }
}

/// Solves every target in every way. `whole` may have more joints than the set frees.
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

/// Steps as Pink's users write the loop; how many it took, unless they run out.
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

/// 0 where nothing was measured.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
