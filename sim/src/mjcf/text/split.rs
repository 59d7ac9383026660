//! Conversion of bodies with several joints to chains of bodies with one joint each, and of ball joints to
//! three hinges.
//!
//! MuJoCo applies the joints of a body one after the other, each in the frame that the previous one leaves.
//! A chain of bodies at the same place has the same effect. All but the last have neither mass nor shape; the
//! last has the content of the original body.

use mjcf_rs::body::{Body, Joint, JointType};
use mjcf_rs::{BodyEntry, Model, Pose, Tristate};

use super::check::BodyBytes;

/// Axes of the hinges that replace a ball, with the suffixes of their names.
const BALL_AXES: [(&str, [f64; 3]); 3] =
    [("x", [1.0, 0.0, 0.0]), ("y", [0.0, 1.0, 0.0]), ("z", [0.0, 0.0, 1.0])];

/// Record of the split bodies of a file.
#[derive(Clone, Debug, Default)]
pub(in crate::mjcf) struct Split {
    /// True for each body that only carries one of several joints of the next body.
    pub is_part: Vec<bool>,
    /// Position of the first ball joint in the text.
    pub ball: Option<usize>,
}

/// Splits all bodies of a model, and the list of their positions in the text.
pub(in crate::mjcf) fn split(model: &mut Model, bytes: &mut Vec<BodyBytes>) -> Split {
    let mut split = Split::default();
    let (mut bodies, mut places) = (Vec::new(), Vec::new());
    // New index of each body of the file.
    let mut numbers: Vec<usize> = Vec::new();
    for (entry, place) in model.bodies.drain(..).zip(bytes.drain(..)) {
        let BodyEntry { parent, mut body } = entry;
        let mut parent = parent.map(|parent| numbers[parent]);
        let mut joints = hinged(std::mem::take(&mut body.joints), &place, &mut split);
        let last = joints.pop();
        for (joint, byte) in joints {
            let name = body.name.as_deref().zip(joint.name.as_deref());
            let part = Body {
                name: name.map(|(body, joint)| format!("{body}/{joint}")),
                pose: std::mem::replace(&mut body.pose, Pose::IDENTITY),
                joints: vec![joint],
                ..Body::default()
            };
            bodies.push(BodyEntry { parent, body: part });
            places.push(BodyBytes { body: place.body, joints: vec![byte], geoms: Vec::new() });
            split.is_part.push(true);
            parent = Some(bodies.len() - 1);
        }
        let (joints, joint_bytes) = last.into_iter().unzip();
        body.joints = joints;
        bodies.push(BodyEntry { parent, body });
        places.push(BodyBytes { joints: joint_bytes, ..place });
        split.is_part.push(false);
        numbers.push(bodies.len() - 1);
    }
    (model.bodies, *bytes) = (bodies, places);
    split
}

/// Returns the joints of a body, with ball joints replaced by hinges, each with its position in the text.
fn hinged(joints: Vec<Joint>, place: &BodyBytes, split: &mut Split) -> Vec<(Joint, usize)> {
    let mut found = Vec::new();
    for (joint, byte) in joints.into_iter().zip(&place.joints) {
        if joint.type_ != JointType::Ball {
            found.push((joint, *byte));
            continue;
        }
        split.ball.get_or_insert(*byte);
        found.extend(BALL_AXES.map(|(suffix, axis)| {
            let name = joint.name.as_ref().map(|name| format!("{name}/{suffix}"));
            let (limited, type_) = (Tristate::False, JointType::Hinge);
            (Joint { name, type_, axis, limited, range: None, ..joint.clone() }, *byte)
        }));
    }
    found
}

#[cfg(test)]
mod tests {
    use crate::mjcf::{BodyTree, Document, LinkJoint};

    fn tree(body: &str) -> BodyTree {
        let xml = format!("<mujoco><worldbody>{body}</worldbody></mujoco>");
        let mut trees = Document::parse("room.xml", &xml).expect("a room").trees().expect("trees");
        trees.remove(1)
    }

    #[test]
    fn several_joints_of_a_body_act_one_after_the_other() {
        let tree = tree(
            r#"<body name="cart" pos="0 0 1"><joint name="x" type="slide" axis="1 0 0"/>
                 <joint name="turn" pos="0.1 0 0"/><geom size="0.1" mass="2"/>
                 <body name="pole" pos="0 0 1"><joint name="tilt"/><geom size="0.1"/></body></body>"#,
        );
        let names: Vec<&str> = tree.links.iter().map(|link| link.name.as_str()).collect();
        assert_eq!(names, ["cart/x", "cart", "pole"]);
        assert_eq!(tree.links.iter().map(|link| link.parent).collect::<Vec<_>>(), [None, Some(0), Some(1)]);
        assert_eq!(tree.links.iter().map(|link| link.is_part).collect::<Vec<_>>(), [true, false, false]);
        let heights_m = tree.links.iter().map(|link| link.parent_from_link.translation.z);
        assert_eq!(heights_m.collect::<Vec<_>>(), [1.0, 0.0, 1.0]);
        assert_eq!([0, 1].map(|link: usize| tree.links[link].mass.mass()), [0.0, 2.0]);
        assert!(matches!(&tree.links[1].joint, LinkJoint::Hinge(hinge) if hinge.axis.anchor_m.x == 0.1));
    }

    #[test]
    fn a_ball_is_three_hinges() {
        let tree = tree(
            r#"<body name="lamp"><joint name="b" type="ball" damping="2" range="0 1"/><geom size="0.1"/></body>"#,
        );
        let axes = tree.links.iter().filter_map(|link| link.joint.axis());
        let found: Vec<_> = axes.map(|axis| (axis.direction.to_array(), axis.damping, axis.range)).collect();
        let hinge = |axis: [f64; 3]| (axis, 2.0, None);
        assert_eq!(found, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(hinge));
    }
}
