//! Hinges and slides, for example of doors and drawers: their opening, from the poses of two bodies.

use rapier3d::math::{Pose, Rotation, Vector};

use crate::mechanism::rounded;
use crate::mjcf::{AxisJoint, BodyLink, LinkJoint};

/// A hinge or a slide between a body and the one that carries it.
#[derive(Clone, Debug, PartialEq)]
pub struct Opening {
    pub kind: OpeningKind,
    /// Pose of the body in its carrier's frame as the file places both; the carrier may be the world.
    carrier_from_closed: Pose,
    /// Axis in the body's frame; a positive motion along it leads to the end of the range that is farther
    /// from the pose in the file.
    direction: Vector,
}

/// Kind of a joint of one degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpeningKind {
    Hinge,
    Slide,
}

impl Opening {
    /// Returns the joint of a link; `None` unless it is a hinge or a slide.
    pub(super) fn of(link: &BodyLink) -> Option<Opening> {
        let (kind, joint) = match &link.joint {
            LinkJoint::Fixed | LinkJoint::Free { .. } => return None,
            LinkJoint::Hinge(joint) => (OpeningKind::Hinge, joint),
            LinkJoint::Slide(joint) => (OpeningKind::Slide, joint),
        };
        let towards = if end(joint).is_some_and(|end| end < 0.0) { -1.0 } else { 1.0 };
        let direction = joint.axis.direction.as_vec3() * towards;
        Some(Opening { kind, carrier_from_closed: rounded(&link.parent_from_link), direction })
    }

    /// Returns the motion from the pose in the file, in m or rad: positive towards the end of the range that
    /// is farther away.
    pub fn opened(&self, world_from_carrier: &Pose, world_from_body: &Pose) -> f32 {
        let closed_from_body =
            self.carrier_from_closed.inverse() * (world_from_carrier.inverse() * *world_from_body);
        match self.kind {
            OpeningKind::Slide => closed_from_body.translation.dot(self.direction),
            OpeningKind::Hinge => {
                let [x, y, z, w] = closed_from_body.rotation.to_array();
                let half_rad = Vector::new(x, y, z).dot(self.direction).atan2(w);
                crate::wrapped_rad(2.0 * half_rad)
            }
        }
    }
}

/// Returns the end of a joint's range that is farther from 0; `None` if there is no range.
fn end(joint: &AxisJoint) -> Option<f32> {
    let [low, high] = joint.axis.range?;
    Some(if low.abs() > high.abs() { low } else { high } as f32)
}

/// Returns the pose of a part with its joint at the end of the range that is farther from 0. The pose is in
/// the part's frame with the joint at 0. Returns `None` if there is no range.
pub(super) fn farthest(joint: &LinkJoint) -> Option<Pose> {
    match joint {
        LinkJoint::Fixed | LinkJoint::Free { .. } => None,
        LinkJoint::Hinge(joint) => {
            let (anchor_m, direction) = (joint.axis.anchor_m.as_vec3(), joint.axis.direction.as_vec3());
            let turned = Rotation::from_axis_angle(direction, end(joint)?);
            Some(Pose::from_parts(anchor_m - turned * anchor_m, turned))
        }
        LinkJoint::Slide(joint) => Some(Pose::from_translation(joint.axis.direction.as_vec3() * end(joint)?)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mjcf::Document;

    /// A drawer that opens against its axis, and a door about an axis beside its origin, on a turned chest.
    #[test]
    fn motions_are_told_from_poses_towards_the_farther_end_of_the_range() {
        let xml = r#"<mujoco><worldbody><body name="chest" pos="2 0 1" euler="0 0 90">
            <body name="drawer" pos="0.1 0 0"><joint type="slide" axis="0 1 0" range="-0.3 0.1"/><geom size="0.1"/></body>
            <body name="door"><joint type="hinge" axis="0 0 1" pos="0.5 0 0" range="-1.5 0"/><geom size="0.1"/></body>
          </body></worldbody></mujoco>"#;
        let scene = Document::parse("house.xml", xml).expect("a scene");
        let world_from_chest = scene.scene_body("chest").expect("a chest").scene_from_body;
        for (name, moved, expected) in [
            ("drawer", Pose::from_translation(Vector::new(0.0, -0.2, 0.0)), 0.2),
            ("drawer", Pose::from_translation(Vector::new(0.0, 0.05, 0.0)), -0.05),
            ("door", Pose::from_rotation(Rotation::from_rotation_z(-1.2)), 1.2),
            ("door", Pose::from_rotation(Rotation::from_rotation_z(0.1)), -0.1),
        ] {
            let body = scene.scene_body(name).expect(name);
            let opening = Opening::of(&body.link).expect("a joint");
            // The chest itself has moved meanwhile.
            let carried = Pose::from_parts(Vector::new(0.3, 1.0, 0.0), Rotation::from_rotation_x(0.4));
            let opened =
                opening.opened(&(carried * world_from_chest), &(carried * body.scene_from_body * moved));
            assert!((opened - expected).abs() < 1e-5, "{name}: {opened}, expected {expected}");
        }
    }
}
