//! A model with most of its joints locked: the arms of a robot that stands.

use nalgebra::Isometry3;

use super::parts::{Frame, Joint, Mass};
use super::tree::Model;
use crate::error::IkError;

impl Model {
    /// The same tree with only the joints `free` left, in their given order if that order has parents first; every other
    /// joint is locked at its coordinate in `locked_at` (all joints of this model, rad or m).
    pub fn reduced(&self, free: &[&str], locked_at: &[f64]) -> Result<Model, IkError> {
        if locked_at.len() != self.nv() {
            return Err(IkError::WrongLength { got: locked_at.len(), expected: self.nv() });
        }
        for name in free {
            self.joint(name)?;
        }
        // Per joint: the free joint that it ends up on, and its pose in that joint's frame.
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
}
