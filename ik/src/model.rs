//! A tree of joints with one degree of freedom each, frames fixed to them, and the masses they carry.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::IkError;

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis; coordinate in rad.
    Hinge,
    /// Slides along its axis; coordinate in m.
    Slide,
}

/// One joint and its limits.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Name in the file.
    pub name: String,
    /// The joint before it in the tree; `None` on the root.
    pub parent: Option<usize>,
    /// Pose at coordinate 0 in the parent joint's frame.
    pub parent_from_joint: Isometry3<f64>,
    /// In the joint's frame.
    pub axis: Unit<Vector3<f64>>,
    /// Hinge or slide.
    pub kind: JointKind,
    /// Smallest coordinate, rad or m.
    pub lower: f64,
    /// Largest coordinate, rad or m.
    pub upper: f64,
    /// Largest speed, rad/s or m/s; infinite where the file gives none.
    pub velocity: f64,
}

/// A frame fixed to a joint, or to the root.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Name of a body, link or site.
    pub name: String,
    /// Joint that it moves with; `None` on the root.
    pub joint: Option<usize>,
    /// Pose in that joint's frame.
    pub joint_from_frame: Isometry3<f64>,
}

/// Handle of a frame of one model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameId(pub(crate) usize);

/// Mass that moves with a joint.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mass {
    pub mass_kg: f64,
    /// Mass times centre, in the joint's frame.
    pub moment_kg_m: Vector3<f64>,
}

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

impl Joint {
    /// Pose in the joint's frame at rest after moving by `q`.
    pub(crate) fn motion(&self, q: f64) -> Isometry3<f64> {
        match self.kind {
            JointKind::Hinge => Isometry3::from_parts(
                Translation3::identity(),
                UnitQuaternion::from_axis_angle(&self.axis, q),
            ),
            JointKind::Slide => {
                Isometry3::from_parts((self.axis.into_inner() * q).into(), UnitQuaternion::identity())
            }
        }
    }
}

impl Mass {
    /// A body's mass, whose centre lies at `centre_m` in its frame.
    pub(crate) fn new(mass_kg: f64, centre_m: Vector3<f64>) -> Mass {
        Mass { mass_kg, moment_kg_m: centre_m * mass_kg }
    }

    /// Adds a mass given in another frame, whose pose in this one is `pose`.
    pub(crate) fn add(&mut self, other: &Mass, pose: &Isometry3<f64>) {
        self.mass_kg += other.mass_kg;
        self.moment_kg_m += pose.rotation * other.moment_kg_m + pose.translation.vector * other.mass_kg;
    }
}

fn names<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names.map(String::as_str).collect::<Vec<_>>().join(", ")
}
