//! Parts of a model: joints, frames fixed to joints, and masses that joints carry.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

/// Kind of motion of a joint.
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
    /// Axis in the joint's frame.
    pub axis: Unit<Vector3<f64>>,
    /// Hinge or slide.
    pub kind: JointKind,
    /// Smallest coordinate, rad or m.
    pub lower: f64,
    /// Largest coordinate, rad or m.
    pub upper: f64,
    /// Maximum speed, rad/s or m/s; infinite if the file gives none.
    pub velocity: f64,
}

/// A frame fixed to a joint, or to the root.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Name of the body, link or site.
    pub name: String,
    /// Joint that the frame moves with; `None` on the root.
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

impl Joint {
    /// Returns the pose, in the joint's frame at rest, after moving by `q`.
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
    /// Creates a body's mass, whose centre is at `centre_m` in its frame.
    pub(crate) fn new(mass_kg: f64, centre_m: Vector3<f64>) -> Mass {
        Mass { mass_kg, moment_kg_m: centre_m * mass_kg }
    }

    /// Adds a mass given in another frame, whose pose in this one is `pose`.
    pub(crate) fn add(&mut self, other: &Mass, pose: &Isometry3<f64>) {
        self.mass_kg += other.mass_kg;
        self.moment_kg_m += pose.rotation * other.moment_kg_m + pose.translation.vector * other.mass_kg;
    }
}
