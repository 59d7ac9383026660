//! A robot built by a description from third-party MJCF. Masses, inertias, geometry and ranges are those
//! of the MJCF. Gains are the G1's, scaled to this robot's weight and size, whatever its actuators
//! specify: the base controller relies on them.

use std::collections::BTreeMap;
use std::path::Path;

use mjcf_rs::body::JointType;
use rapier3d::glamx::{DPose3, DQuat, DVec3};
use rapier3d::math::{Matrix, Pose, Rotation, Vector};
use xxhash_rust::xxh3::xxh3_64;

use super::description::{BodyFrame, HeadCamera, RobotDescription};
use super::joints::in_published_order;
use super::read::{PALM_IN_WRIST_M, assemble, corners_m, only_tree};
use super::{BodyScale, JointModel, RobotModel, SiteModel};
use crate::body::layout::{LEG_JOINTS, LEGS, joint_names};
use crate::mjcf::{AxisJoint, BodyTree, Document, LinkJoint, MjcfCamera};
use crate::user_file::with_own_separators;
use crate::{Side, Sides, SimError, assets};

/// Reads a description and the MJCF that it names. In the returned document, joints, wrists and camera
/// have the published names. The number is a fingerprint of both files.
pub(super) fn read(path: &Path) -> Result<(RobotModel, Document, u64), SimError> {
    let (description, text) = RobotDescription::read(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut document = Document::read(&with_own_separators(folder.join(&description.model)))?;
    let fingerprint = xxh3_64(format!("{:016x}{text}", document.fingerprint()).as_bytes());
    let fitting = Fitting {
        file: path.display().to_string(),
        like: description.like.as_deref().map(embedded).transpose()?,
        g1: embedded(assets::DEFAULT_ROBOT)?,
        description,
    };
    fitting.check_names()?;
    let said = fitting.rename_joints(&mut document)?;
    fitting.add_frames(&mut document)?;
    let model = fitting.robot(&document, &said)?;
    Ok((model, document, fingerprint))
}

fn embedded(name: &str) -> Result<RobotModel, SimError> {
    RobotModel::parse(name, assets::robot(name)?)
}

struct Fitting {
    /// Name of the description in messages.
    file: String,
    description: RobotDescription,
    like: Option<RobotModel>,
    g1: RobotModel,
}

/// Data of a joint that the MJCF gives in places other than the joint itself.
#[derive(Default)]
struct SaidElsewhere {
    effort_range_n_m: Option<[f64; 2]>,
    rest_rad: Option<f64>,
}

impl Fitting {
    fn refuse(&self, what: impl Into<String>) -> SimError {
        SimError::Unsupported { file: self.file.clone(), what: what.into() }
    }

    /// Checks that all joints for which the description gives names or numbers are published ones.
    fn check_names(&self) -> Result<(), SimError> {
        let RobotDescription { joints, rest_rad, effort_n_m, speed_limit_rad_s, .. } = &self.description;
        let names = joint_names();
        let tables =
            [("rest_rad", rest_rad), ("effort_n_m", effort_n_m), ("speed_limit_rad_s", speed_limit_rad_s)];
        let keys = tables.iter().flat_map(|(table, entries)| entries.keys().map(move |key| (*table, key)));
        let given = joints.keys().map(|key| ("joints", key)).chain(keys);
        for (table, key) in given {
            if !names.contains(key) {
                let have = names.join(", ");
                return Err(
                    self.refuse(format!("[{table}] has `{key}`; a robot's joints are called: {have}"))
                );
            }
        }
        Ok(())
    }

    /// Gives joints their published names, and makes held joints rigid. Returns the data that the file
    /// gives outside the joints, by published name, and removes it from the document.
    fn rename_joints(&self, document: &mut Document) -> Result<BTreeMap<String, SaidElsewhere>, SimError> {
        let mut rest_rad = rest_rad(document)?;
        let mut said = BTreeMap::new();
        let efforts: BTreeMap<String, [f64; 2]> = document
            .actuators()?
            .into_iter()
            .filter_map(|actuator| Some((actuator.joint, actuator.effort_range?)))
            .collect();
        self.check_joints_of(document)?;
        for body in document.model.bodies.iter_mut().map(|entry| &mut entry.body) {
            let Some(joint) = body.joints.first_mut().filter(|joint| joint.type_ != JointType::Free) else {
                continue;
            };
            let own = joint.name.clone().unwrap_or_default();
            if let Some(held_rad) = self.description.held_rad.get(&own) {
                let anchor = DPose3::from_translation(DVec3::from_array(joint.pos));
                let turn = DQuat::from_axis_angle(DVec3::from_array(joint.axis).normalize(), *held_rad);
                body.pose = body.pose * anchor * DPose3::from_rotation(turn) * anchor.inverse();
                body.joints.clear();
                continue;
            }
            let published = self.published(&own);
            joint.name = Some(published.clone());
            joint.damping = 0.0;
            let elsewhere = SaidElsewhere {
                effort_range_n_m: efforts.get(&own).copied(),
                rest_rad: rest_rad.remove(&own),
            };
            said.insert(published, elsewhere);
        }
        for (name, elsewhere) in &mut said {
            let own = self.description.joints.get(name).unwrap_or(name);
            elsewhere.effort_range_n_m = elsewhere.effort_range_n_m.or(document.effort_range(own, None));
        }
        document.model.actuators.clear();
        document.model.keyframes.clear();
        Ok(said)
    }

    fn published(&self, own: &str) -> String {
        let joints = &self.description.joints;
        joints.iter().find(|(_, name)| *name == own).map_or(own, |(published, _)| published).into()
    }

    /// Checks that every joint of the file has a use or is held, and that every name of the description
    /// is one of the file's joints.
    fn check_joints_of(&self, document: &Document) -> Result<(), SimError> {
        let RobotDescription { model, joints, held_rad, .. } = &self.description;
        let model = model.display();
        let bodies = document.model.bodies.iter().flat_map(|entry| &entry.body.joints);
        let own: Vec<&str> = bodies
            .filter(|joint| joint.type_ != JointType::Free)
            .map(|joint| joint.name.as_deref().unwrap_or_default())
            .collect();
        let named = joints.values().map(|name| ("joints", name));
        if let Some((table, name)) = named
            .chain(held_rad.keys().map(|name| ("held_rad", name)))
            .find(|(_, name)| !own.contains(&name.as_str()))
        {
            let have = own.join(", ");
            return Err(self
                .refuse(format!("[{table}] names `{name}`, and {model} has no such joint; it has: {have}")));
        }
        let published = joint_names();
        let useless = own
            .iter()
            .find(|name| !held_rad.contains_key(**name) && !published.contains(&self.published(name)));
        if let Some(name) = useless {
            let have = published.join(", ");
            return Err(self.refuse(format!(
                "nothing says which joint `{name}` of {model} is: name it in [joints], or give it an angle in [held_rad]; a robot's joints are called: {have}"
            )));
        }
        Ok(())
    }

    /// Adds the wrists and the camera of the description.
    fn add_frames(&self, document: &mut Document) -> Result<(), SimError> {
        let RobotDescription { left_wrist, right_wrist, camera, .. } = &self.description;
        for (side, frame) in [(Side::Left, left_wrist), (Side::Right, right_wrist)] {
            let Some(BodyFrame { body, position_m, quaternion_wxyz: [w, x, y, z] }) = frame else { continue };
            let rotation = DQuat::from_xyzw(*x, *y, *z, *w).normalize();
            if !rotation.is_finite() {
                return Err(self.refuse(format!("the quaternion of {}_wrist is 0 0 0 0", side.name())));
            }
            let name = format!("{}_wrist", side.name());
            for entry in &mut document.model.bodies {
                entry.body.sites.retain(|site| site.name.as_deref() != Some(&name));
            }
            let pose = DPose3::from_parts(DVec3::from_array(*position_m), rotation);
            let site = mjcf_rs::body::Site { name: Some(name), pose, ..Default::default() };
            let found =
                document.model.bodies.iter_mut().find(|entry| entry.body.name.as_deref() == Some(body));
            found.ok_or_else(|| self.no_body(body))?.body.sites.push(site);
        }
        if let Some(camera) = camera {
            if document.model.bodies.iter().all(|entry| entry.body.name.as_deref() != Some(&camera.body)) {
                return Err(self.no_body(&camera.body));
            }
            document.cameras.retain(|other| other.name != self.g1.egocentric.name);
            document.cameras.push(head_camera(camera, &self.g1.egocentric));
        }
        Ok(())
    }

    fn no_body(&self, name: &str) -> SimError {
        self.refuse(format!("{} has no body `{name}`", self.description.model.display()))
    }

    fn robot(
        &self,
        document: &Document,
        said: &BTreeMap<String, SaidElsewhere>,
    ) -> Result<RobotModel, SimError> {
        let tree = only_tree(document)?;
        let mut found = Vec::new();
        for (link, of) in tree.links.iter().enumerate().skip(1) {
            let LinkJoint::Hinge(joint) = &of.joint else {
                return Err(
                    self.refuse(format!("joint `{}` is no hinge", of.joint.name().unwrap_or_default()))
                );
            };
            found.push(self.joint(joint, link, said.get(&joint.name))?);
        }
        let joints = in_published_order(found).map_err(|what| self.refuse(what))?;
        let soles = LEGS.map(|first| sole(&tree, joints[first + LEG_JOINTS - 1].link));
        let soles = match soles {
            Sides { left: Some(left), right: Some(right) } => Sides { left, right },
            Sides { .. } => return Err(self.refuse("needs geoms that collide on both feet, to stand on")),
        };
        let mut model = assemble(document, &tree, joints, soles)?;
        model.bend_legs(&self.g1);
        model.scale = BodyScale::between(&self.g1, &model);
        self.derive_drives(&mut model);
        Ok(model)
    }

    /// Returns a joint with the data of the file and the description; the parts that depend on the
    /// robot's size follow later.
    fn joint(
        &self,
        joint: &AxisJoint,
        link: usize,
        said: Option<&SaidElsewhere>,
    ) -> Result<JointModel, SimError> {
        let (name, axis) = (&joint.name, &joint.axis);
        let refuse = |what: &str| self.refuse(format!("joint `{name}` {what}"));
        let alike = |robot: &RobotModel| robot.joints.iter().find(|other| other.name == *name).cloned();
        let like = self.like.as_ref().and_then(alike);
        let [lower, upper] = axis.range.ok_or_else(|| refuse("needs a range"))?;
        if axis.anchor_m != DVec3::ZERO {
            return Err(refuse("turns beside its body's origin; put the body there"));
        }
        if axis.stiffness != 0.0 {
            return Err(refuse("has a spring"));
        }
        let of_file = match said.and_then(|said| said.effort_range_n_m) {
            Some([low, high]) if low == -high => Some(high as f32),
            Some(_) => return Err(refuse("is stronger one way; use a range of -x x")),
            None => None,
        };
        let RobotDescription { effort_n_m, speed_limit_rad_s, rest_rad, .. } = &self.description;
        let effort = effort_n_m.get(name).copied().or(of_file).or(like.as_ref().map(|like| like.effort_n_m));
        let effort_n_m = effort.filter(|effort| *effort > 0.0).ok_or_else(|| {
            refuse("has no limit of effort: give it one in [effort_n_m], or say whose joints it is like, as with like = \"g1_dex3\"")
        })?;
        let speed = speed_limit_rad_s.get(name).copied().or(like.as_ref().map(|like| like.speed_limit_rad_s));
        let own_rest_rad =
            rest_rad.get(name).copied().or(said.and_then(|said| said.rest_rad).map(|rest| rest as f32));
        let g1_rest_rad = || alike(&self.g1).map_or(0.0, |g1| g1.rest_rad);
        let (lower_rad, upper_rad) = (lower as f32, upper as f32);
        let or_like = |own: f64, of: fn(&JointModel) -> f32| match &like {
            Some(like) if own == 0.0 => of(like),
            Some(_) | None => own as f32,
        };
        Ok(JointModel {
            name: name.clone(),
            link,
            axis: axis.direction.as_vec3().normalize(),
            lower_rad,
            upper_rad,
            armature_kg_m2: or_like(axis.armature, |like| like.armature_kg_m2),
            friction_n_m: or_like(axis.friction_loss, |like| like.friction_n_m),
            kp_n_m_rad: 0.0,
            kd_n_m_s_rad: 0.0,
            effort_n_m,
            speed_limit_rad_s: speed.unwrap_or(f32::INFINITY),
            rest_rad: own_rest_rad.unwrap_or_else(g1_rest_rad).clamp(lower_rad, upper_rad),
        })
    }

    /// Sets gains, missing rotor inertias, and palms to those of a G1 of this weight and size.
    fn derive_drives(&self, model: &mut RobotModel) {
        let scale = model.scale.clone();
        for (joint, g1) in model.joints.iter_mut().zip(&self.g1.joints).filter(|(joint, _)| joint.exists()) {
            joint.kp_n_m_rad = scale.moment_n_m(g1.kp_n_m_rad);
            joint.kd_n_m_s_rad = scale.damping_n_m_s(g1.kd_n_m_s_rad);
            if joint.armature_kg_m2 == 0.0 {
                joint.armature_kg_m2 = scale.inertia_kg_m2(g1.armature_kg_m2);
            }
        }
        for (hand, wrist) in model.hands.iter_mut().zip(model.wrists.iter()) {
            hand.palm_in_wrist_m = wrist.link_from_site * (PALM_IN_WRIST_M * scale.length_m(1.0));
        }
    }
}

/// Returns the angles of the file's first key, by the file's joint names; empty without a key.
fn rest_rad(document: &Document) -> Result<BTreeMap<String, f64>, SimError> {
    let Some(key) = document.keys()?.into_iter().next() else { return Ok(BTreeMap::new()) };
    let joints = document.model.bodies.iter().flat_map(|entry| &entry.body.joints);
    let mut positions = key.positions.into_iter();
    let mut angles_rad = BTreeMap::new();
    for joint in joints {
        if joint.type_ == JointType::Free {
            positions.by_ref().take(7).for_each(drop);
        } else if let Some(angle_rad) = positions.next() {
            angles_rad.insert(joint.name.clone().unwrap_or_default(), angle_rad);
        }
    }
    Ok(angles_rad)
}

/// Returns the middle of the area that a foot stands on.
fn sole(tree: &BodyTree, link: usize) -> Option<SiteModel> {
    let corners_m = corners_m(&tree.links[link].geoms);
    let low_m = corners_m.iter().copied().reduce(Vector::min)?;
    let high_m = corners_m.iter().copied().reduce(Vector::max)?;
    let middle_m = Vector::new(0.5 * (low_m.x + high_m.x), 0.5 * (low_m.y + high_m.y), low_m.z);
    Some(SiteModel { link, link_from_site: Pose::from_translation(middle_m) })
}

/// Returns a camera with the lens of the G1's: its y axis points up, and it looks along -z.
fn head_camera(camera: &HeadCamera, g1: &MjcfCamera) -> MjcfCamera {
    let (sine, cosine) = camera.down_deg.to_radians().sin_cos();
    let (right, up) = (-Vector::Y, Vector::new(sine, 0.0, cosine));
    let rotation = Rotation::from_mat3(&Matrix::from_cols(right, up, right.cross(up)));
    MjcfCamera {
        body: Some(camera.body.clone()),
        body_from_camera: Pose::from_parts(Vector::from_array(camera.position_m), rotation),
        ..g1.clone()
    }
}
