//! A robot built by a description from third-party MJCF. Masses, inertias, geometry and ranges are those of
//! the MJCF. Gains are the G1's, scaled to this robot's weight and size, because the base controller relies
//! on them. Those of its actuators are ignored.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::path::Path;

use mjcf_rs::Tristate;
use mjcf_rs::body::JointType;
use rapier3d::glamx::{DPose3, DQuat, DVec3};
use rapier3d::math::{Matrix, Pose, Rotation, Vector};
use xxhash_rust::xxh3::xxh3_64;

use super::description::{BodyFrame, HeadCamera, RobotDescription};
use super::feet::{find_soles, level_frames};
use super::joints::in_published_order;
use super::limits::{FileLimits, JointSources, limits_of_file};
use super::read::{PALM_IN_WRIST_M, assemble, camera, sites};
use super::{BodyScale, JointModel, RobotModel};
use crate::body::layout::{ARM_JOINTS, ARMS, LEG_JOINTS, LEGS, joint_names};
use crate::mjcf::{BodyTree, Document, LinkJoint, MjcfCamera};
use crate::user_file::with_own_separators;
use crate::{Side, SimError, assets};

/// Reads a description and the MJCF that it names. In the returned document, joints, wrists and camera
/// have the published names. The number is a fingerprint of both files.
pub(super) fn read(path: &Path) -> Result<(RobotModel, Document, u64), SimError> {
    let (description, text) = RobotDescription::read(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let mjcf = with_own_separators(folder.join(&description.model));
    let mut fitting = Fitting {
        file: path.display().to_string(),
        like: description.like.as_deref().map(embedded).transpose()?,
        g1: embedded(assets::DEFAULT_ROBOT)?,
        description,
        refused: Vec::new(),
    };
    fitting.check_names();
    fitting.check_ranges();
    let mut document = Document::read_robot(&mjcf).map_err(|error| fitting.all_with(error))?;
    let fingerprint = xxh3_64(format!("{:016x}{text}", document.fingerprint()).as_bytes());
    let model = fitting.fit(&mut document)?;
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
    /// All reasons for refusing the robot.
    refused: Vec<SimError>,
}

impl Fitting {
    fn wrong(&self, what: impl Into<String>) -> SimError {
        SimError::Unsupported { file: self.file.clone(), what: what.into() }
    }

    /// Adds a reason about an entry of the description.
    fn refuse(&mut self, what: impl Into<String>) {
        self.refused.push(self.wrong(what));
    }

    /// Adds a last reason and returns all reasons.
    fn all_with(&mut self, error: SimError) -> SimError {
        self.refused.push(error);
        SimError::several(std::mem::take(&mut self.refused))
    }

    /// Returns a value, or adds the reason why there is none.
    fn keep<T>(&mut self, tried: Result<T, SimError>) -> Option<T> {
        tried.map_err(|error| self.refused.push(error)).ok()
    }

    /// Checks that all joints for which the description gives names or numbers are published ones.
    fn check_names(&mut self) {
        let d = &self.description;
        let keys = |table: &'static str, keys: Vec<&String>| {
            keys.into_iter().map(|key| (table, key.clone())).collect::<Vec<_>>()
        };
        let given = [
            keys("joints", d.joints.keys().collect()),
            keys("rest_rad", d.rest_rad.keys().collect()),
            keys("range_rad", d.range_rad.keys().collect()),
            keys("effort_n_m", d.effort_n_m.keys().collect()),
            keys("speed_limit_rad_s", d.speed_limit_rad_s.keys().collect()),
        ];
        let names = joint_names();
        let wrong: Vec<_> = given.into_iter().flatten().filter(|(_, key)| !names.contains(key)).collect();
        for (index, (table, key)) in wrong.into_iter().enumerate() {
            let have = if index == 0 { &*names.join(", ") } else { "see above" };
            self.refuse(format!("[{table}] has `{key}`; a robot's joints are called: {have}"));
        }
    }

    /// Checks that the ranges of the description are ranges.
    fn check_ranges(&mut self) {
        let ranges = self.description.range_rad.clone();
        for (joint, [low_rad, high_rad]) in
            ranges.iter().filter(|(_, [low, high])| low.partial_cmp(high) != Some(Ordering::Less))
        {
            self.refuse(format!("[range_rad] has {joint} = [{low_rad}, {high_rad}]; the lower end is first"));
        }
    }

    /// Fits the document to the description, and returns its robot.
    fn fit(&mut self, document: &mut Document) -> Result<RobotModel, SimError> {
        let limits = self.keep(limits_of_file(document));
        self.keep_robot(document)?;
        self.check_joints_of(document);
        let limits = self.rename_joints(document, limits.unwrap_or_default());
        self.add_frames(document);
        let tree = level_frames(document).map_err(|error| self.all_with(error))?;
        let joints = self.joints(document, &tree, &limits);
        let legs = joints.as_ref().is_some_and(|joints| self.check_legs(document, &tree, joints));
        let soles = joints.as_ref().and_then(|joints| self.keep(find_soles(document, &tree, joints)));
        self.keep(camera(document, &tree));
        self.keep(sites(document, &tree, "wrist", "or an entry [left_wrist] or [right_wrist] here"));
        let (Some(joints), Some(soles), true, true) = (joints, soles, legs, self.refused.is_empty()) else {
            return Err(SimError::several(std::mem::take(&mut self.refused)));
        };
        let mut model = assemble(document, &tree, joints, soles)?;
        model.bend_legs(&self.g1);
        model.scale = BodyScale::between(&self.g1, &model);
        self.derive_drives(&mut model);
        Ok(model)
    }

    /// Removes all content of the file except the robot, and adds notes.
    fn keep_robot(&mut self, document: &mut Document) -> Result<(), SimError> {
        let trees = document.trees().map_err(|error| self.all_with(error))?;
        let robot = main_tree(document, &trees).map_err(|error| self.all_with(error))?;
        let root = robot.links[0].bodies[0].index;
        let is_fixed = robot.links[0].joint == LinkJoint::Fixed;
        let notes = [
            (trees.len() > 2, "bodies beside the robot's are left out"),
            (trees[0].links.iter().any(|link| !link.geoms.is_empty()), "geoms in the worldbody are left out"),
            (
                !document.model.equality.is_empty(),
                "equalities are left out: every joint of a robot has its motor",
            ),
            (
                !document.model.actuators.is_empty(),
                "gains of actuators are not used: they are a G1's at this robot's scale",
            ),
            (is_fixed, "its root is free to move, as if it had a <freejoint>"),
        ];
        notes.iter().filter(|(holds, _)| *holds).for_each(|(_, what)| document.note(what));
        document.keep_tree(root);
        document.model.equality.clear();
        if is_fixed {
            document.free_root();
        }
        Ok(())
    }

    /// Checks that every joint of the file is used or held, and that every name in the description is one of
    /// the file's joints.
    fn check_joints_of(&mut self, document: &Document) {
        let RobotDescription { model, joints, held_rad, .. } = &self.description;
        let model = model.display();
        let bodies = document.model.bodies.iter().enumerate();
        let own: Vec<(usize, &str)> = bodies
            .filter_map(|(body, entry)| Some((body, entry.body.joints.first()?)))
            .filter(|(_, joint)| joint.type_ != JointType::Free)
            .map(|(body, joint)| (body, joint.name.as_deref().unwrap_or_default()))
            .collect();
        let named = joints.values().map(|name| ("joints", name));
        let unknown: Vec<_> = named
            .chain(held_rad.keys().map(|name| ("held_rad", name)))
            .filter(|(_, name)| own.iter().all(|(_, own)| own != name))
            .collect();
        let have = own.iter().map(|(_, name)| *name).collect::<Vec<_>>().join(", ");
        let mut wrong: Vec<SimError> = Vec::new();
        for (table, name) in unknown {
            let have = if wrong.is_empty() { &*have } else { "see above" };
            let what = format!("[{table}] names `{name}`, and {model} has no such joint; it has: {have}");
            wrong.push(self.wrong(what));
        }
        let published = joint_names();
        let is_used = |name: &str| held_rad.contains_key(name) || published.contains(&self.published(name));
        for (index, (body, name)) in own.iter().filter(|(_, name)| !is_used(name)).enumerate() {
            let have = if index == 0 { &*published.join(", ") } else { "see above" };
            let file = &self.file;
            wrong.push(document.refuse_joint(
                *body,
                &format!("nothing says which joint `{name}` of {model} is: name it in [joints], or give it an angle in [held_rad] of {file}; a robot's joints are called: {have}"),
            ));
        }
        self.refused.extend(wrong);
    }

    fn published(&self, own: &str) -> String {
        let joints = &self.description.joints;
        joints.iter().find(|(_, name)| *name == own).map_or(own, |(published, _)| published).into()
    }

    /// Gives joints their published names and their ranges, and makes held joints rigid. Removes actuators
    /// and keys from the document. Returns the limits by published name.
    fn rename_joints(
        &self,
        document: &mut Document,
        mut limits: BTreeMap<String, FileLimits>,
    ) -> BTreeMap<String, FileLimits> {
        let mut renamed = BTreeMap::new();
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
            let limits = limits.remove(&own).unwrap_or_default();
            let given = self.description.range_rad.get(&published).copied().filter(|[low, high]| low < high);
            if let Some(range) = given.or(limits.control_range_rad.filter(|_| joint.range.is_none())) {
                (joint.range, joint.limited) = (Some(range), Tristate::True);
            }
            joint.name = Some(published.clone());
            joint.damping = 0.0;
            renamed.insert(published, limits);
        }
        document.model.actuators.clear();
        document.model.keyframes.clear();
        renamed
    }

    /// Adds the wrists and the camera of the description. A side without an arm has its wrist on the trunk.
    fn add_frames(&mut self, document: &mut Document) {
        for side in Side::BOTH {
            let name = format!("{}_wrist", side.name());
            let given = match side {
                Side::Left => self.description.left_wrist.take(),
                Side::Right => self.description.right_wrist.take(),
            };
            let frame = match given {
                Some(frame) => frame,
                None if has_arm(document, side) => continue,
                None => BodyFrame::at(document.model.bodies[1].body.name.clone().unwrap_or_default()),
            };
            let BodyFrame { body, position_m, quaternion_wxyz: [w, x, y, z] } = frame;
            let rotation = DQuat::from_xyzw(x, y, z, w).normalize();
            if !rotation.is_finite() {
                self.refuse(format!("the quaternion of [{name}] is 0 0 0 0"));
                continue;
            }
            for entry in &mut document.model.bodies {
                entry.body.sites.retain(|site| site.name.as_deref() != Some(&name));
            }
            let pose = DPose3::from_parts(DVec3::from_array(position_m), rotation);
            let site = mjcf_rs::body::Site { name: Some(name.clone()), pose, ..Default::default() };
            let bodies = &mut document.model.bodies;
            match bodies.iter_mut().find(|entry| entry.body.name.as_deref() == Some(&body)) {
                Some(entry) => entry.body.sites.push(site),
                None => self.refuse_body(document, &name, &body),
            }
        }
        if let Some(camera) = &self.description.camera {
            let (name, lens) = (camera.body.clone(), &self.g1.egocentric);
            let camera = head_camera(camera, lens);
            match document.model.body_id_by_name(&name) {
                Some(_) => {
                    document.cameras.retain(|other| other.name != camera.name);
                    document.cameras.push(camera);
                }
                None => self.refuse_body(document, "camera", &name),
            }
        }
    }

    fn refuse_body(&mut self, document: &Document, entry: &str, name: &str) {
        let have = document.model.bodies_iter().filter_map(|(_, entry)| entry.body.name.as_deref());
        let have = have.collect::<Vec<_>>().join(", ");
        let model = self.description.model.display();
        self.refuse(format!("[{entry}]: {model} has no body `{name}`; it has: {have}"));
    }

    /// Returns all joints in published order, or adds the reasons why they cannot be used.
    fn joints(
        &mut self,
        document: &Document,
        tree: &BodyTree,
        limits: &BTreeMap<String, FileLimits>,
    ) -> Option<Vec<JointModel>> {
        let (mut found, mut refused) = (Vec::new(), Vec::new());
        let sources = JointSources {
            file: &self.file,
            description: &self.description,
            like: self.like.as_ref(),
            g1: &self.g1,
        };
        for (link, of) in tree.links.iter().enumerate().skip(1) {
            let body = of.bodies[0].index;
            let LinkJoint::Hinge(joint) = &of.joint else {
                let what = "is no hinge; use hinges, or hold it in [held_rad]";
                refused.push(document.refuse_joint(body, what));
                continue;
            };
            let usual = FileLimits::default();
            let (model, wrong) = sources.joint(joint, link, of, limits.get(&joint.name).unwrap_or(&usual));
            refused.extend(wrong.iter().map(|what| document.refuse_joint(body, what)));
            found.push(model);
        }
        self.refused.extend(refused);
        let published = joint_names();
        found.retain(|joint| published.contains(&joint.name));
        self.check_efforts(&found);
        self.keep(in_published_order(found).map_err(|what| self.wrong(what)))
    }

    /// Checks that all joints have limits of effort.
    fn check_efforts(&mut self, joints: &[JointModel]) {
        let lacking = joints.iter().filter(|joint| joint.effort_n_m <= 0.0);
        let lacking: Vec<String> = lacking.map(|joint| format!("`{}`", joint.name)).collect();
        if !lacking.is_empty() {
            let (model, joints) = (self.description.model.display(), lacking.join(", "));
            self.refuse(format!(
                "{model} has no limit of effort for {joints}: give them in [effort_n_m], or say whose joints they are like, as with like = \"g1_dex3\""
            ));
        }
    }

    /// Checks that only the legs' joints are between pelvis and feet.
    fn check_legs(&mut self, document: &Document, tree: &BodyTree, joints: &[JointModel]) -> bool {
        let mut wrong = Vec::new();
        for leg in LEGS.map(|first| &joints[first..first + LEG_JOINTS]) {
            let links: Vec<usize> = leg.iter().map(|joint| joint.link).collect();
            let last = links.iter().copied().max().unwrap_or_default();
            for link in std::iter::successors(Some(last), |link| tree.links[*link].parent) {
                if link != 0 && !links.contains(&link) {
                    let what = "is between the pelvis and a foot; only joints of the leg may be: hold it in [held_rad]";
                    wrong.push(document.refuse_joint(tree.links[link].bodies[0].index, what));
                }
            }
        }
        wrong.dedup_by_key(|error| error.to_string());
        self.refused.extend(wrong);
        self.refused.is_empty()
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

/// Returns the heaviest tree of a file, which is its robot.
pub(super) fn main_tree<'a>(document: &Document, trees: &'a [BodyTree]) -> Result<&'a BodyTree, SimError> {
    let mass_kg = |tree: &BodyTree| tree.links.iter().map(|link| link.mass.mass()).sum::<f32>();
    let heaviest = trees.iter().skip(1).max_by(|a, b| mass_kg(a).total_cmp(&mass_kg(b)));
    heaviest.ok_or_else(|| document.unsupported("it has no body; a robot is a body with all others on it"))
}

/// Returns true if the file has a joint of this arm.
fn has_arm(document: &Document, side: Side) -> bool {
    let names = joint_names();
    let arm = &names[ARMS[side]..ARMS[side] + ARM_JOINTS];
    let mut joints = document.model.bodies.iter().flat_map(|entry| &entry.body.joints);
    joints.any(|joint| joint.name.as_ref().is_some_and(|name| arm.contains(name)))
}

/// Returns a camera with the G1's lens: its y axis points up, and it looks along -z.
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
