//! Conversion of file content to dynamics: surfaces, links, equalities, actuators and the initial state.
//! Robots and objects consist of these.

mod equality;
mod machinery;
mod solid;

use rapier3d::math::Pose;

use equality::joint_link;
pub(crate) use equality::{PlacedTree, add_equalities, keep_apart, pair_up};
pub(crate) use machinery::{Machinery, START, begin};
pub(crate) use solid::Solid;

pub(crate) use crate::dynamics::rounded;

use crate::dynamics::{Axis, Collider, ColliderId, DPose3, DQuat, Dynamics, Joint, Link, LinkId, Mass};
use crate::mjcf::{Actuator, AxisJoint, BodyLink, BodyTree, Geom, LinkJoint, Primitive};
use crate::owner::Owner;

/// Converts the pose to double precision, with a normalised quaternion.
pub(crate) fn precise(pose: &Pose) -> DPose3 {
    let [x, y, z, w] = pose.rotation.to_array().map(f64::from);
    DPose3::from_parts(pose.translation.as_dvec3(), DQuat::from_xyzw(x, y, z, w).normalize())
}

/// Adds the collision shape of a geom, if the geom has one, to a link or to the world. The geom's pose is in
/// the frame of the link or of the world.
pub(crate) fn add_collider(
    dynamics: &mut Dynamics,
    geom: &Geom,
    on: Option<LinkId>,
    owner: Option<Owner>,
) -> Option<ColliderId> {
    if !geom.collides {
        return None;
    }
    let (body_from_shape, shape) = geom.collider()?;
    Some(dynamics.add_collider(Collider {
        shape,
        on,
        body_from_shape: precise(&body_from_shape),
        friction: geom.friction,
        endless: matches!(geom.primitive, Primitive::Plane { .. }),
        tag: owner.map_or(0, Owner::tag),
        touches: geom.touches,
    }))
}

/// Builds the links of a file's tree, with the top of the tree placed by `world_from_file`. Drives of
/// its joints have the strength of the file's actuators.
pub(crate) fn links(tree: &BodyTree, world_from_file: &DPose3, actuators: &[Actuator]) -> Vec<Link> {
    tree.links.iter().map(|link| self::link(link, world_from_file, actuators)).collect()
}

fn link(link: &BodyLink, world_from_file: &DPose3, actuators: &[Actuator]) -> Link {
    Link {
        name: link.name.clone(),
        parent: link.parent,
        parent_from_link: match link.parent {
            Some(_) => link.parent_from_link,
            None => *world_from_file * link.parent_from_link,
        },
        joint: match &link.joint {
            LinkJoint::Fixed => Joint::Fixed,
            LinkJoint::Free { .. } => Joint::Free,
            LinkJoint::Hinge(joint) => Joint::Hinge(axis(joint, actuators)),
            LinkJoint::Slide(joint) => Joint::Slide(axis(joint, actuators)),
        },
        mass: Mass::from_rapier(&link.mass),
    }
}

fn axis(joint: &AxisJoint, actuators: &[Actuator]) -> Axis {
    let actuator = actuators.iter().find(|actuator| actuator.joint == joint.name);
    let effort_range = actuator.and_then(|actuator| actuator.effort_range);
    Axis {
        effort_limit: effort_range.map_or(f64::INFINITY, |[_, most]| most),
        speed_limit: actuator.and_then(|actuator| actuator.speed_limit).unwrap_or(f64::INFINITY),
        ..joint.axis.clone()
    }
}
