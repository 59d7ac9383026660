//! Models from MJCF: bodies and sites become frames, a free joint at the root is left out.

use std::collections::HashMap;
use std::path::Path;

use mjcf_rs::body::JointType;
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

use super::parts::{Frame, Joint, JointKind, Mass};
use super::tree::Model;
use crate::error::IkError;

impl Model {
    /// Reads MJCF text. The first top-level body is the root, whatever joint it has; speeds are unlimited, as MJCF has
    /// no velocity limits.
    pub fn from_mjcf(xml: &str) -> Result<Model, IkError> {
        Model::from_mjcf_in(xml, Path::new("."))
    }

    /// The same, for text that includes files named relative to `folder`.
    pub fn from_mjcf_in(xml: &str, folder: &Path) -> Result<Model, IkError> {
        let document = mjcf_rs::Model::from_str(xml, folder)?;
        let mut joints: Vec<Joint> = Vec::new();
        let mut frames = Vec::new();
        let mut masses: Vec<Mass> = Vec::new();
        let mut root_mass = Mass::default();
        // Per body: the joint that moves it, and its pose in that joint's frame.
        let mut placed: HashMap<usize, (Option<usize>, Isometry3<f64>)> = HashMap::new();
        for (id, entry) in document.bodies_iter() {
            let body = &entry.body;
            let (mut owner, mut pose) = match entry.parent.and_then(|parent| placed.get(&parent)) {
                Some((owner, parent_pose)) => (*owner, parent_pose * isometry(&body.pose)),
                None if placed.is_empty() => (None, Isometry3::identity()),
                None => continue,
            };
            for joint in body.joints.iter().filter(|joint| joint.type_ != JointType::Free) {
                let kind = match joint.type_ {
                    JointType::Hinge => JointKind::Hinge,
                    JointType::Slide => JointKind::Slide,
                    other => {
                        return Err(IkError::Unsupported(format!(
                            "joint {:?} is {other:?}; use hinges and slides",
                            joint.name
                        )));
                    }
                };
                let anchor = Translation3::from(Vector3::from(joint.pos));
                let [lower, upper] = joint.range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                joints.push(Joint {
                    name: joint.name.clone().unwrap_or_default(),
                    parent: owner,
                    parent_from_joint: pose * anchor,
                    axis: Unit::new_normalize(Vector3::from(joint.axis)),
                    kind,
                    lower,
                    upper,
                    velocity: f64::INFINITY,
                });
                masses.push(Mass::default());
                owner = Some(joints.len() - 1);
                pose = anchor.inverse() * Isometry3::identity();
            }
            placed.insert(id, (owner, pose));
            if let Some(inertial) = &body.inertial {
                let mass = Mass::new(inertial.mass, isometry(&inertial.pose).translation.vector);
                owner.map_or(&mut root_mass, |joint| &mut masses[joint]).add(&mass, &pose);
            }
            let mut frame = |name: &Option<String>, pose: Isometry3<f64>| {
                let name = name.clone().unwrap_or_default();
                frames.push(Frame { name, joint: owner, joint_from_frame: pose });
            };
            frame(&body.name, pose);
            for site in &body.sites {
                frame(&site.name, pose * isometry(&site.pose));
            }
        }
        masses.push(root_mass);
        Ok(Model::assemble(joints, frames, masses))
    }
}

fn isometry(pose: &mjcf_rs::Pose) -> Isometry3<f64> {
    let (t, r) = (pose.translation, pose.rotation);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(r.w, r.x, r.y, r.z));
    Isometry3::from_parts(Translation3::new(t.x, t.y, t.z), rotation)
}
