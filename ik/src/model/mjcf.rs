//! Models from MJCF: bodies and sites become frames, a free joint at the root is left out.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use mjcf_rs::Tristate;
use mjcf_rs::body::JointType;
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

use super::parts::{Frame, Joint, JointKind, Mass};
use super::tree::Model;
use crate::error::IkError;

impl Model {
    /// Reads MJCF text. The one top-level body is the root, and its free joint is left out. Speeds are
    /// unlimited, as MJCF has no velocity limits. Only masses stated in the file count, not those of shapes.
    ///
    /// # Errors
    ///
    /// Returns an error if the text is not MJCF, or if an element would place or move a frame
    /// differently from MuJoCo.
    pub fn from_mjcf(xml: &str) -> Result<Model, IkError> {
        Model::from_mjcf_in(xml, Path::new("."))
    }

    /// Reads MJCF text that includes files named relative to `folder`.
    ///
    /// # Errors
    ///
    /// Returns the same errors as [`Model::from_mjcf`].
    pub fn from_mjcf_in(xml: &str, folder: &Path) -> Result<Model, IkError> {
        check_depth(xml)?;
        Model::from_parsed_mjcf(&mjcf_rs::Model::from_str(xml, folder)?)
    }

    /// Builds the model of a parsed file.
    ///
    /// # Errors
    ///
    /// Returns an error if an element would place or move a frame differently from MuJoCo.
    pub fn from_parsed_mjcf(document: &mjcf_rs::Model) -> Result<Model, IkError> {
        check_names(document)?;
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
                None => {
                    let what = "it stands beside the root; put all bodies on the first";
                    return Err(refuse("body", &body.name, what));
                }
            };
            let is_root = placed.is_empty();
            for joint in body.joints.iter().filter(|joint| !is_root || joint.type_ != JointType::Free) {
                let anchor = Translation3::from(Vector3::from(joint.pos));
                joints.push(read_joint(joint, document.compiler.autolimits, owner, pose * anchor)?);
                masses.push(Mass::default());
                owner = Some(joints.len() - 1);
                pose = anchor.inverse() * Isometry3::identity();
            }
            placed.insert(id, (owner, pose));
            if let Some(inertial) = &body.inertial {
                if inertial.mass < 0.0 {
                    return Err(refuse("body", &body.name, "its mass is below 0"));
                }
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

/// Maximum nesting of elements; the parser recurses.
const MAX_NESTING: usize = 200;

fn refuse(kind: &str, name: &Option<String>, what: &str) -> IkError {
    match name {
        Some(name) => IkError::Unsupported(format!("{kind} `{name}`: {what}")),
        None => IkError::Unsupported(format!("{kind} without a name: {what}")),
    }
}

fn read_joint(
    joint: &mjcf_rs::body::Joint,
    autolimits: bool,
    parent: Option<usize>,
    parent_from_joint: Isometry3<f64>,
) -> Result<Joint, IkError> {
    let refuse = |what: &str| refuse("joint", &joint.name, what);
    let kind = match joint.type_ {
        JointType::Hinge => JointKind::Hinge,
        JointType::Slide => JointKind::Slide,
        JointType::Ball | JointType::Free => {
            return Err(refuse(&format!("it is {:?}; use hinges and slides", joint.type_)));
        }
    };
    if joint.ref_ != 0.0 {
        return Err(refuse("`ref` is not read; let the file's coordinate 0 be where the bodies stand"));
    }
    let limited = match (joint.limited, joint.range) {
        (Tristate::True, None) => return Err(refuse("it is limited without a range")),
        (Tristate::Auto, Some(_)) if !autolimits => {
            return Err(refuse("it has a range; state limited, or autolimits=\"true\""));
        }
        (limited, range) => range.filter(|_| limited.resolve(autolimits, true)),
    };
    let [lower, upper] = limited.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    let axis = Unit::try_new(Vector3::from(joint.axis), 1e-10).ok_or_else(|| refuse("its axis is 0 0 0"))?;
    let numbers = joint.pos.iter().chain(axis.iter()).chain(parent_from_joint.translation.vector.iter());
    if lower >= upper || numbers.chain([&lower, &upper]).any(|number| number.is_nan()) {
        return Err(refuse("its place, axis or range is no number, or its range is empty"));
    }
    let (name, velocity) = (joint.name.clone().unwrap_or_default(), f64::INFINITY);
    Ok(Joint { name, parent, parent_from_joint, axis, kind, lower, upper, velocity })
}

/// Checks that joints have distinct names, and so have frames of a kind.
fn check_names(document: &mjcf_rs::Model) -> Result<(), IkError> {
    let mut seen = HashSet::new();
    for (_, entry) in document.bodies_iter() {
        let body = &entry.body;
        let joints = body.joints.iter().map(|joint| ("joint", &joint.name));
        let sites = body.sites.iter().map(|site| ("site", &site.name));
        for (kind, name) in [("body", &body.name)].into_iter().chain(joints).chain(sites) {
            if name.is_some() && !seen.insert((kind, name)) {
                return Err(refuse(kind, name, "there is another of this name"));
            }
        }
    }
    Ok(())
}

fn check_depth(xml: &str) -> Result<(), IkError> {
    let mut rest = xml;
    let mut depth = 0usize;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        let end = if rest.starts_with("<!--") { "-->" } else { ">" };
        let length = rest.find(end).map_or(rest.len(), |at| at + end.len());
        let tag = &rest[..length];
        if tag.starts_with("</") {
            depth = depth.saturating_sub(1);
        } else if !tag.starts_with("<!") && !tag.starts_with("<?") && !tag.ends_with("/>") {
            depth += 1;
        }
        if depth > MAX_NESTING {
            let what = format!("more than {MAX_NESTING} elements inside one another; nest fewer");
            return Err(IkError::Unsupported(what));
        }
        rest = &rest[length..];
    }
    Ok(())
}

fn isometry(pose: &mjcf_rs::Pose) -> Isometry3<f64> {
    let (t, r) = (pose.translation, pose.rotation);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(r.w, r.x, r.y, r.z));
    Isometry3::from_parts(Translation3::new(t.x, t.y, t.z), rotation)
}
