//! Changes to a robot's file before it is used: other content is removed, and bodies get the frames in which
//! robots are computed.

use std::path::Path;

use mjcf_rs::body::{Geom, GeomType, Joint, JointType};
use rapier3d::glamx::{DPose3, DVec3};
use rapier3d::math::Pose;

use super::geometry::between;
use super::{BodyTree, Document, pose};
use crate::SimError;

/// Elements that a described robot does not use.
const LEFT_OUT: &[&str] = &["tendon", "pair", "deformable", "skin", "flex", "flexvert", "flexstrain"];

impl Document {
    /// Reads the file of a robot. Only bodies, joints and limits are used.
    ///
    /// # Errors
    ///
    /// Returns an error as [`Document::read`] does, except for content that robots do not use.
    pub(crate) fn read_robot(path: &Path) -> Result<Document, SimError> {
        Document::read(path).or_else(|_| Document::read_without(path, LEFT_OUT))
    }

    /// Returns the error that refuses the joint of a body, with its line.
    pub(crate) fn refuse_joint(&self, body: usize, what: &str) -> SimError {
        match self.checked.bodies[body].joints.first() {
            Some(joint) => self.source.refuse_at(*joint, what),
            None => self.refuse_body(body, what),
        }
    }

    /// Adds a note on a difference between the file and its use.
    pub(crate) fn note(&mut self, what: &str) {
        self.checked.approximated.push(format!("`{}`: {what}", self.file));
    }

    /// Keeps one top-level body and the bodies that it carries. Removes all other bodies, and all geoms and
    /// sites of the world.
    pub(crate) fn keep_tree(&mut self, root: usize) {
        let mut number = vec![None; self.model.bodies.len()];
        let (mut bodies, mut places, mut is_part) = (Vec::new(), Vec::new(), Vec::new());
        for (id, mut entry) in std::mem::take(&mut self.model.bodies).into_iter().enumerate() {
            let on_kept = entry.parent.is_some_and(|parent| parent != 0 && number[parent].is_some());
            if id != 0 && id != root && !on_kept {
                continue;
            }
            if id == 0 {
                entry.body.geoms.clear();
                entry.body.sites.clear();
            }
            number[id] = Some(bodies.len());
            entry.parent = entry.parent.and_then(|parent| number[parent]);
            bodies.push(entry);
            places.push(std::mem::take(&mut self.checked.bodies[id]));
            is_part.push(self.split.is_part[id]);
        }
        self.model.bodies = bodies;
        self.checked.bodies = places;
        self.split.is_part = is_part;
        let mut excludes = std::mem::take(&mut self.model.contact.excludes);
        let has = |name: &str| self.model.body_id_by_name(name).is_some();
        excludes.retain(|pair| has(&pair.body1) && has(&pair.body2));
        self.model.contact.excludes = excludes;
    }

    /// Returns the only tree of a document.
    pub(crate) fn robot_tree(&self) -> Result<BodyTree, SimError> {
        let tree = self.trees()?.into_iter().nth(1);
        tree.ok_or_else(|| self.unsupported("it has no body"))
    }

    /// Lets the simple shapes of a body and of the bodies fixed to it collide if none of its geoms does.
    /// Files with pairs of geoms have such bodies.
    pub(crate) fn let_shapes_collide(&mut self, body: usize) {
        let is_on = |id: usize| {
            let above = std::iter::successors(Some(id), |id| self.model.bodies[*id].parent);
            let mut between = above.take_while(|id| *id != body);
            between.all(|id| id != 0 && self.model.bodies[id].body.joints.is_empty())
        };
        let bodies: Vec<usize> = (body..self.model.bodies.len()).filter(|id| is_on(*id)).collect();
        let collides = |geom: &Geom| geom.contype != 0 || geom.conaffinity != 0;
        if bodies.iter().any(|id| self.model.bodies[*id].body.geoms.iter().any(collides)) {
            return;
        }
        let mut changed = false;
        for id in bodies {
            let geoms = self.model.bodies[id].body.geoms.iter_mut();
            for geom in geoms.filter(|geom| geom.type_ != GeomType::Mesh) {
                (geom.contype, geom.conaffinity) = (1, 1);
                changed = true;
            }
        }
        if changed {
            let name = self.model.bodies[body].body.name.clone().unwrap_or_default();
            self.note(&format!("no geom of `{name}` collides: its shapes that are no meshes do"));
        }
    }

    /// Gives the first body a free joint.
    pub(crate) fn free_root(&mut self) {
        let joint = Joint { type_: JointType::Free, ..Joint::default() };
        self.model.bodies[1].body.joints.push(joint);
        let byte = self.checked.bodies[1].body;
        self.checked.bodies[1].joints.push(byte);
    }

    /// Replaces the frame of a body by another one, whose pose in the old frame is `body_from_new`. All parts
    /// keep their places.
    pub(crate) fn reframe(&mut self, body: usize, body_from_new: DPose3) {
        let new_from_body = body_from_new.inverse();
        let on_it = self.model.bodies.iter_mut().filter(|entry| entry.parent == Some(body));
        on_it.for_each(|entry| entry.body.pose = new_from_body * entry.body.pose);
        let content = &mut self.model.bodies[body].body;
        content.pose *= body_from_new;
        if let Some(inertial) = &mut content.inertial {
            inertial.pose = new_from_body * inertial.pose;
        }
        for joint in &mut content.joints {
            joint.pos = (new_from_body * DVec3::from_array(joint.pos)).to_array();
            joint.axis = (new_from_body.rotation * DVec3::from_array(joint.axis)).to_array();
        }
        for geom in &mut content.geoms {
            if let Some(ends_m) = geom.fromto.take() {
                set_pose(geom, ends_m);
            }
            geom.pose = new_from_body * geom.pose;
        }
        content.sites.iter_mut().for_each(|site| site.pose = new_from_body * site.pose);
        let name = content.name.clone();
        for camera in self.cameras.iter_mut().filter(|camera| name.is_some() && camera.body == name) {
            camera.body_from_camera = pose(&new_from_body) * camera.body_from_camera;
        }
    }
}

/// Sets pose and size of a geom that its file defines by two end points. In another frame, the same ends
/// would turn a box about the line between them.
fn set_pose(geom: &mut Geom, ends_m: [f64; 6]) {
    let (body_from_geom, half_length_m) = between(ends_m);
    let Pose { rotation, translation, .. } = body_from_geom;
    geom.pose *= DPose3::from_parts(translation.as_dvec3(), rotation.as_dquat());
    let (radius_m, half_length_m) = (geom.size[0], f64::from(half_length_m));
    geom.size = match geom.type_ {
        GeomType::Box | GeomType::Ellipsoid => [radius_m, radius_m, half_length_m],
        _ => [radius_m, half_length_m, 0.0],
    };
}
