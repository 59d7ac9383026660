//! The tree itself: its joints, frames and masses, found by name.

use super::parts::{Frame, FrameId, Joint, Mass};
use crate::error::IkError;

/// Kinematic tree with a fixed root. Joints come parents first.
#[derive(Clone, Debug, Default)]
pub struct Model {
    pub(crate) joints: Vec<Joint>,
    pub(crate) frames: Vec<Frame>,
    /// One per joint, and the root's last.
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

    /// Joints in the order of all coordinate vectors.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Number of joints.
    pub fn nv(&self) -> usize {
        self.joints.len()
    }

    /// Frames in file order.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Index of a joint.
    pub fn joint(&self, name: &str) -> Result<usize, IkError> {
        self.joints.iter().position(|joint| joint.name == name).ok_or_else(|| IkError::UnknownJoint {
            name: name.into(),
            have: names(self.joints.iter().map(|joint| &joint.name)),
        })
    }

    /// Handle of a frame.
    pub fn frame(&self, name: &str) -> Result<FrameId, IkError> {
        let index = self.frames.iter().position(|frame| frame.name == name);
        index.map(FrameId).ok_or_else(|| IkError::UnknownFrame {
            name: name.into(),
            have: names(self.frames.iter().map(|frame| &frame.name)),
        })
    }

    /// Name of a frame.
    pub fn frame_name(&self, frame: FrameId) -> &str {
        &self.frames[frame.0].name
    }

    /// Joints that move a frame, root first.
    pub(crate) fn support(&self, frame: FrameId) -> &[usize] {
        self.frames[frame.0].joint.map_or(&[], |joint| &self.supports[joint])
    }
}

fn names<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names.map(String::as_str).collect::<Vec<_>>().join(", ")
}
