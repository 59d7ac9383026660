//! Target poses, from a file or drawn at random.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::Deserialize;

use crate::error::IkError;
use crate::model::{Configuration, Model};
use crate::solver::random_coordinate;
use crate::tasks::{DampingTask, FrameTask, PostureTask, Task};

const POSTURE_COST: f64 = 1e-3;

/// Frames, start coordinates of the joints, and poses to reach from there.
#[derive(Clone, Debug, Deserialize)]
pub struct TargetSet {
    /// Joints that move; every other joint of the model is locked at 0.
    pub free_joints: Vec<String>,
    /// One start coordinate per free joint, rad.
    pub start_q_rad: Vec<f64>,
    /// Names of the frames to move.
    pub frames: Vec<String>,
    /// Maximum speeds of joints, which replace those in the model's file.
    #[serde(default)]
    pub limits: BTreeMap<String, SpeedLimit>,
    /// One entry per problem.
    pub targets: Vec<Target>,
}

/// Limit of one joint.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct SpeedLimit {
    /// Maximum speed, rad/s.
    pub velocity: f64,
}

/// One problem: a pose for each frame, by name.
#[derive(Clone, Debug, Deserialize)]
pub struct Target {
    /// Poses in the root's frame.
    pub frames: BTreeMap<String, TargetPose>,
}

/// A pose in the format of targets files.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct TargetPose {
    /// x, y, z.
    pub position_m: [f64; 3],
    /// Hamilton, scalar first; normalised on use.
    pub quaternion_wxyz: [f64; 4],
}

impl TargetSet {
    /// Parses a targets file.
    ///
    /// # Errors
    ///
    /// Returns an error if the text is not a valid targets file.
    pub fn from_json(text: &str) -> Result<TargetSet, IkError> {
        Ok(serde_json::from_str(text)?)
    }

    /// Draws `count` targets: each free joint uniform in the middle 80 % of its range, poses by forward
    /// kinematics. The robot's shapes may overlap in these poses.
    ///
    /// # Errors
    ///
    /// Returns an error if `start_q_rad` does not fit the model or a frame is unknown.
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

    /// Returns the model with only the free joints, and with the speed limits of the set.
    ///
    /// # Errors
    ///
    /// Returns an error if the model lacks a joint of the set.
    pub fn reduce(&self, whole: &Model) -> Result<Model, IkError> {
        let free: Vec<&str> = self.free_joints.iter().map(String::as_str).collect();
        let mut model = whole.reduced(&free, &vec![0.0; whole.nv()])?;
        for (name, limit) in &self.limits {
            let joint = model.joint(name)?;
            model.joints[joint].velocity = limit.velocity;
        }
        Ok(model)
    }

    /// Returns the tasks of one target: every frame at its pose, posture at the start, and damping if
    /// its cost is positive.
    ///
    /// # Errors
    ///
    /// Returns an error if the target or the model lacks a frame of the set.
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

    /// Returns the pose as an isometry.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [w, i, j, k] = self.quaternion_wxyz;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        Isometry3::from_parts(Translation3::from(self.position_m), rotation)
    }
}
