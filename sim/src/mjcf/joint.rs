//! Joints of bodies, as plain data.

use mjcf_rs::body::JointType;
use rapier3d::glamx::DVec3;

use super::Document;
use crate::SimError;
use crate::dynamics::Axis;

/// What a body may do against its parent.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkJoint {
    Fixed,
    /// Only a top-level body has it.
    Free {
        name: String,
    },
    Hinge(AxisJoint),
    Slide(AxisJoint),
}

/// A joint of one degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisJoint {
    pub name: String,
    /// Without a limit of effort, which is the actuator's.
    pub axis: Axis,
}

impl LinkJoint {
    pub fn name(&self) -> Option<&str> {
        match self {
            LinkJoint::Fixed => None,
            LinkJoint::Free { name } => Some(name),
            LinkJoint::Hinge(joint) | LinkJoint::Slide(joint) => Some(&joint.name),
        }
    }

    pub fn axis(&self) -> Option<&Axis> {
        match self {
            LinkJoint::Fixed | LinkJoint::Free { .. } => None,
            LinkJoint::Hinge(joint) | LinkJoint::Slide(joint) => Some(&joint.axis),
        }
    }

    /// Numbers of MuJoCo's `qvel`.
    pub fn freedoms(&self) -> usize {
        match self {
            LinkJoint::Fixed => 0,
            LinkJoint::Free { .. } => 6,
            LinkJoint::Hinge(_) | LinkJoint::Slide(_) => 1,
        }
    }

    /// Numbers of MuJoCo's `qpos`: a free joint has a position and a quaternion.
    pub fn coordinates(&self) -> usize {
        match self {
            LinkJoint::Fixed => 0,
            LinkJoint::Free { .. } => 7,
            LinkJoint::Hinge(_) | LinkJoint::Slide(_) => 1,
        }
    }
}

/// The joint of body `id` of a document.
pub(super) fn read(document: &Document, id: usize) -> Result<LinkJoint, SimError> {
    let entry = &document.model.bodies[id];
    let body = entry.body.name.as_deref().unwrap_or_default();
    let joint = match entry.body.joints.as_slice() {
        [] => return Ok(LinkJoint::Fixed),
        [joint] => joint,
        several => {
            let what = format!("body `{body}` has {} joints; put a body between two joints", several.len());
            return Err(document.unsupported(what));
        }
    };
    let name = joint.name.clone().unwrap_or_default();
    if joint.ref_ != 0.0 || joint.springdamper.is_some() {
        let what =
            format!("joint `{name}`: `ref` and `springdamper` are not read; state stiffness and damping");
        return Err(document.unsupported(what));
    }
    match joint.type_ {
        JointType::Free if entry.parent == Some(0) => Ok(LinkJoint::Free { name }),
        JointType::Free => {
            Err(document.unsupported(format!("free body `{body}` lies in another; move it to the top level")))
        }
        JointType::Hinge => Ok(LinkJoint::Hinge(axis(document, name, joint))),
        JointType::Slide => Ok(LinkJoint::Slide(axis(document, name, joint))),
        JointType::Ball => {
            Err(document.unsupported(format!("joint `{name}` is a ball; use free, hinge or slide")))
        }
    }
}

fn axis(document: &Document, name: String, joint: &mjcf_rs::body::Joint) -> AxisJoint {
    let limited = joint.limited.resolve(document.model.compiler.autolimits, joint.range.is_some());
    let axis = Axis {
        anchor_m: DVec3::from_array(joint.pos),
        armature: joint.armature,
        friction_loss: joint.frictionloss,
        damping: joint.damping,
        stiffness: joint.stiffness,
        spring_rest: joint.springref,
        range: joint.range.filter(|_| limited),
        ..Axis::along(DVec3::from_array(joint.axis))
    };
    AxisJoint { name, axis }
}
