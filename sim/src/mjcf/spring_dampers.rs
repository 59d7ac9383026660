//! Joint springs and dampers that a file specifies by time constant and damping ratio.

use rapier3d::glamx::DPose3;
use rapier3d::prelude::MassProperties;

use super::bodies::{BodyTree, Place};
use super::{Document, LinkJoint, pose};
use crate::mass;

impl Document {
    /// Sets stiffness k and damping d of the joints with a `springdamper` T z:
    ///   k = M / (T z)^2,   d = 2 M / T,
    /// M the inertia that the joint moves at the placed poses (kg m^2, or kg of a slide). Source: MuJoCo,
    /// `springdamper` in the XML reference.
    pub(super) fn set_spring_dampers(&self, trees: &mut [BodyTree], places: &[Place]) {
        for (entry, place) in self.model.bodies.iter().zip(places) {
            let stated = entry.body.joints.first().and_then(|joint| joint.springdamper);
            let Some([time_s, ratio]) = stated.filter(|numbers| numbers.iter().all(|number| *number > 0.0))
            else {
                continue;
            };
            let tree = &mut trees[place.tree];
            let moved = moved_inertia(tree, place.link);
            if let LinkJoint::Hinge(joint) | LinkJoint::Slide(joint) = &mut tree.links[place.link].joint {
                joint.axis.stiffness = moved / (time_s * ratio).powi(2);
                joint.axis.damping = 2.0 * moved / time_s;
            }
        }
    }
}

/// Returns the inertia that a link's joint moves: that of the link and all bodies it carries, and the
/// armature.
fn moved_inertia(tree: &BodyTree, link: usize) -> f64 {
    let mut of_link: Vec<Option<DPose3>> = vec![None; tree.links.len()];
    of_link[link] = Some(DPose3::IDENTITY);
    let mut moved = MassProperties::default();
    for (index, one) in tree.links.iter().enumerate().skip(link) {
        if index > link {
            of_link[index] = one.parent.and_then(|parent| Some(of_link[parent]? * one.parent_from_link));
        }
        if let Some(link_from_one) = of_link[index] {
            moved = mass::sum(moved, one.mass.transform_by(&pose(&link_from_one)));
        }
    }
    match &tree.links[link].joint {
        LinkJoint::Hinge(joint) => {
            let axis = &joint.axis;
            let direction = axis.direction.normalize().as_vec3();
            let about_center = direction.dot(moved.reconstruct_inertia_matrix() * direction);
            let away_m = moved.local_com - axis.anchor_m.as_vec3();
            let inertia = about_center + moved.mass() * direction.cross(away_m).length_squared();
            f64::from(inertia) + axis.armature
        }
        LinkJoint::Slide(joint) => f64::from(moved.mass()) + joint.axis.armature,
        LinkJoint::Free { .. } | LinkJoint::Fixed => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use crate::mjcf::Document;

    /// Stiffness and damping in MuJoCo 4.0.0 for the same file.
    const EXPECTED: [[f64; 2]; 2] = [[8.39738443, 2.14973041], [50.0, 10.0]];

    #[test]
    fn springs_and_dampers_are_those_of_mujoco() {
        let document = Document::parse(
            "arm.xml",
            r#"<mujoco><compiler angle="radian"/><worldbody><body name="a" pos="0 0 1">
                 <joint name="h" axis="0 1 0" pos="0.1 0 0" armature="0.01" springdamper="0.2 0.8"/>
                 <geom type="box" size="0.1 0.2 0.3" mass="2" pos="0.3 0 0"/>
                 <body name="b" pos="0.5 0 0" euler="0 0 0.7">
                   <joint name="s" type="slide" axis="1 0 0" springdamper="0.1 1"/>
                   <geom type="sphere" size="0.1" mass="0.5" pos="0 0.1 0"/></body></body></worldbody></mujoco>"#,
        )
        .expect("an arm");
        let trees = document.trees().expect("trees");
        let axes: Vec<_> = trees[1].links.iter().filter_map(|link| link.joint.axis()).collect();
        for (axis, expected) in axes.iter().zip(EXPECTED) {
            let found = [axis.stiffness, axis.damping];
            let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5 * b);
            assert!(near, "{found:?} in place of {expected:?}");
        }
        assert_eq!(axes.len(), EXPECTED.len());
    }
}
