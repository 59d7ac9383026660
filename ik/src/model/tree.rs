//! The tree: its joints, frames and masses, found by name. Locking joints reduces it, for example for a robot
//! that stands and moves its arms.

use nalgebra::Isometry3;

use super::parts::{Frame, FrameId, Joint, Mass};
use crate::error::IkError;

/// Kinematic tree with a fixed root. Joints are ordered parents first.
#[derive(Clone, Debug, Default)]
pub struct Model {
    pub(crate) joints: Vec<Joint>,
    pub(crate) frames: Vec<Frame>,
    /// One mass per joint, and the root's last.
    pub(crate) masses: Vec<Mass>,
    /// Joints from the root to each joint, that joint last.
    pub(crate) supports: Vec<Vec<usize>>,
}

impl Model {
    /// Builds a model from its parts; `masses` has one more entry than `joints`, the root's.
    pub(crate) fn assemble(joints: Vec<Joint>, frames: Vec<Frame>, masses: Vec<Mass>) -> Model {
        let mut supports: Vec<Vec<usize>> = Vec::with_capacity(joints.len());
        for (index, joint) in joints.iter().enumerate() {
            let mut support = joint.parent.map_or_else(Vec::new, |parent| supports[parent].clone());
            support.push(index);
            supports.push(support);
        }
        Model { joints, frames, masses, supports }
    }

    /// Returns the same tree with only the joints `free`, in model order. Every other joint is locked at
    /// its coordinate in `locked_at` (all joints of this model, rad or m).
    ///
    /// # Errors
    ///
    /// Returns an error if `locked_at` has the wrong length or a joint is unknown.
    pub fn reduced(&self, free: &[&str], locked_at: &[f64]) -> Result<Model, IkError> {
        if locked_at.len() != self.nv() {
            return Err(IkError::WrongLength { got: locked_at.len(), expected: self.nv() });
        }
        for name in free {
            self.joint(name)?;
        }
        // Per joint: the free joint that it is attached to, and its pose in that joint's frame.
        let mut placed: Vec<(Option<usize>, Isometry3<f64>)> = Vec::with_capacity(self.nv());
        let mut joints = Vec::new();
        let mut masses = vec![Mass::default(); free.len() + 1];
        for (index, joint) in self.joints.iter().enumerate() {
            let (parent, before) =
                joint.parent.map_or((None, Isometry3::identity()), |parent| placed[parent]);
            let pose = before * joint.parent_from_joint;
            if free.contains(&joint.name.as_str()) {
                joints.push(Joint { parent, parent_from_joint: pose, ..joint.clone() });
                placed.push((Some(joints.len() - 1), Isometry3::identity()));
            } else {
                placed.push((parent, pose * joint.motion(locked_at[index])));
            }
            let (owner, pose) = placed[index];
            masses[owner.unwrap_or(free.len())].add(&self.masses[index], &pose);
        }
        masses[free.len()].add(&self.masses[self.nv()], &Isometry3::identity());
        let frames = self.frames.iter().map(|frame| {
            let (joint, pose) = frame.joint.map_or((None, Isometry3::identity()), |joint| placed[joint]);
            Frame { name: frame.name.clone(), joint, joint_from_frame: pose * frame.joint_from_frame }
        });
        Ok(Model::assemble(joints, frames.collect(), masses))
    }

    /// Returns the joints in the order of all coordinate vectors.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Returns the number of joints.
    pub fn nv(&self) -> usize {
        self.joints.len()
    }

    /// Returns the frames in file order.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Returns the index of a joint.
    ///
    /// # Errors
    ///
    /// Returns an error with the available names if there is no such joint.
    pub fn joint(&self, name: &str) -> Result<usize, IkError> {
        self.joints.iter().position(|joint| joint.name == name).ok_or_else(|| IkError::UnknownJoint {
            name: name.into(),
            have: names(self.joints.iter().map(|joint| &joint.name)),
        })
    }

    /// Returns the handle of a frame.
    ///
    /// # Errors
    ///
    /// Returns an error with the available names if there is no such frame.
    pub fn frame(&self, name: &str) -> Result<FrameId, IkError> {
        let index = self.frames.iter().position(|frame| frame.name == name);
        index.map(FrameId).ok_or_else(|| IkError::UnknownFrame {
            name: name.into(),
            have: names(self.frames.iter().map(|frame| &frame.name)),
        })
    }

    /// Returns the name of a frame.
    pub fn frame_name(&self, frame: FrameId) -> &str {
        &self.frames[frame.0].name
    }

    /// Returns the joints that move a frame, root first.
    pub(crate) fn support(&self, frame: FrameId) -> &[usize] {
        self.frames[frame.0].joint.map_or(&[], |joint| &self.supports[joint])
    }
}

fn names<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names.map(String::as_str).collect::<Vec<_>>().join(", ")
}
