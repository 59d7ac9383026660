//! Models from URDF: links become frames, fixed joints are merged.

use std::collections::HashMap;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use urdf_rs::JointType;

use super::parts::{Frame, Joint, JointKind, Mass};
use super::tree::Model;
use crate::error::IkError;

impl Model {
    /// Reads URDF text. Joints are ordered depth first, children in file order.
    ///
    /// # Errors
    ///
    /// Returns an error if the text is not URDF, or has loops or joints of unsupported types.
    pub fn from_urdf(xml: &str) -> Result<Model, IkError> {
        let robot = urdf_rs::read_from_string(xml)?;
        let links: HashMap<&str, &urdf_rs::Link> =
            robot.links.iter().map(|link| (link.name.as_str(), link)).collect();
        let is_child = |link: &str| robot.joints.iter().any(|joint| joint.child.link == link);
        let root = robot.links.iter().find(|link| !is_child(&link.name));
        let root = root.ok_or_else(|| IkError::Unsupported("the links form a loop: no root".into()))?;
        let mut parts = Parts {
            robot: &robot,
            links,
            joints: Vec::new(),
            frames: Vec::new(),
            masses: Vec::new(),
            root: Mass::default(),
        };
        parts.add_link(&root.name, None, Isometry3::identity())?;
        let Parts { joints, frames, mut masses, root, .. } = parts;
        masses.push(root);
        Ok(Model::assemble(joints, frames, masses))
    }
}

struct Parts<'a> {
    robot: &'a urdf_rs::Robot,
    links: HashMap<&'a str, &'a urdf_rs::Link>,
    joints: Vec<Joint>,
    frames: Vec<Frame>,
    masses: Vec<Mass>,
    root: Mass,
}

impl Parts<'_> {
    /// Adds a link that moves with `owner`, at `pose` in that joint's frame, and all links below it.
    fn add_link(&mut self, name: &str, owner: Option<usize>, pose: Isometry3<f64>) -> Result<(), IkError> {
        self.frames.push(Frame { name: name.into(), joint: owner, joint_from_frame: pose });
        if let Some(link) = self.links.get(name) {
            let centre = isometry(&link.inertial.origin).translation.vector;
            let mass = Mass::new(link.inertial.mass.value, centre);
            owner.map_or(&mut self.root, |joint| &mut self.masses[joint]).add(&mass, &pose);
        }
        let robot = self.robot;
        for joint in robot.joints.iter().filter(|joint| joint.parent.link == name) {
            let origin = pose * isometry(&joint.origin);
            let kind = match joint.joint_type {
                JointType::Fixed => {
                    self.add_link(&joint.child.link, owner, origin)?;
                    continue;
                }
                JointType::Revolute | JointType::Continuous => JointKind::Hinge,
                JointType::Prismatic => JointKind::Slide,
                ref other => {
                    return Err(IkError::Unsupported(format!(
                        "joint `{}` is {other:?}; use revolute and prismatic",
                        joint.name
                    )));
                }
            };
            let unlimited = joint.joint_type == JointType::Continuous;
            self.joints.push(Joint {
                name: joint.name.clone(),
                parent: owner,
                parent_from_joint: origin,
                axis: Unit::new_normalize(Vector3::from(joint.axis.xyz.0)),
                kind,
                lower: if unlimited { f64::NEG_INFINITY } else { joint.limit.lower },
                upper: if unlimited { f64::INFINITY } else { joint.limit.upper },
                velocity: if joint.limit.velocity > 0.0 { joint.limit.velocity } else { f64::INFINITY },
            });
            self.masses.push(Mass::default());
            self.add_link(&joint.child.link, Some(self.joints.len() - 1), Isometry3::identity())?;
        }
        Ok(())
    }
}

fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let [x, y, z] = pose.xyz.0;
    let [roll, pitch, yaw] = pose.rpy.0;
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}
