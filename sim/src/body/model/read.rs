//! Reads a robot's MJCF file.

use std::collections::{BTreeSet, HashMap};

use mjcf_rs::body::{Body, Joint, JointType};
use rapier3d::math::Pose;
use rapier3d::prelude::MassProperties;

use super::{HandLinks, JointModel, LinkModel, RobotModel, SiteModel};
use crate::mjcf::{Document, MjcfCamera, mass_properties, pose, vector};
use crate::{Side, Sides, SimError};

/// Where a body of the file ended up.
#[derive(Clone, Copy)]
struct Placed {
    link: usize,
    link_from_body: Pose,
}

impl RobotModel {
    /// Reads a robot file: one free root body, hinges with position actuators, sites `left_wrist`, `right_wrist`,
    /// `left_foot`, `right_foot`, a camera `egocentric` and a first keyframe to stand in.
    pub fn parse(file: &str, xml: &str) -> Result<RobotModel, SimError> {
        let document = Document::parse(file, xml)?;
        let tree = Tree::read(&document)?;
        let egocentric = find_camera(&document)?;
        let egocentric_link = egocentric.body.as_ref().and_then(|body| tree.link_of(body)).unwrap_or(0);
        let wrists = tree.sites("wrist", "where tasks put the hand")?;
        Ok(RobotModel {
            mass_kg: tree.links.iter().map(|link| link.mass.mass()).sum(),
            egocentric,
            egocentric_link,
            wrists,
            soles: tree.sites("foot", "at the sole's centre")?,
            excluded: tree.excluded(),
            hands: Sides::from_fn(|side| tree.hand(side, wrists[side].link)),
            links: tree.links,
            joints: tree.joints,
        })
    }
}

/// What has been read of a file's bodies.
struct Tree<'a> {
    document: &'a Document,
    links: Vec<LinkModel>,
    joints: Vec<JointModel>,
    sites: HashMap<String, SiteModel>,
    /// By the body's number in the file.
    placed: HashMap<usize, Placed>,
}

impl<'a> Tree<'a> {
    fn read(document: &'a Document) -> Result<Tree<'a>, SimError> {
        let mut tree = Tree {
            document,
            links: Vec::new(),
            joints: read_joints(document)?,
            sites: HashMap::new(),
            placed: HashMap::new(),
        };
        let mut rest = first_keyframe(document)?.into_iter();
        for (id, entry) in document.model.bodies_iter() {
            let parent = entry.parent.and_then(|parent| tree.placed.get(&parent).copied());
            let at = tree.place(&entry.body, parent, &mut rest)?;
            tree.placed.insert(id, at);
            tree.fill(id, &entry.body, at)?;
        }
        Ok(tree)
    }

    /// Makes a body a link of its own, or a part of its parent's. `rest` are the keyframe's coordinates from this body on.
    fn place(
        &mut self,
        body: &Body,
        parent: Option<Placed>,
        rest: &mut impl Iterator<Item = f64>,
    ) -> Result<Placed, SimError> {
        let name = body.name.clone().unwrap_or_default();
        match (parent, body.joints.as_slice()) {
            (None, [joint]) if joint.type_ == JointType::Free && self.links.is_empty() => {
                rest.take(7).for_each(drop);
                self.links.push(new_link(&name, None, pose(&body.pose), None));
                Ok(Placed { link: 0, link_from_body: Pose::IDENTITY })
            }
            (Some(parent), [joint]) if joint.type_ == JointType::Hinge && joint.pos == [0.0; 3] => {
                let index = self.actuated(&name, joint)?;
                let link = self.links.len();
                self.joints[index].link = link;
                self.joints[index].rest_rad = rest.next().unwrap_or(0.0) as f32;
                let parent_from_link = parent.link_from_body * pose(&body.pose);
                self.links.push(new_link(&name, Some(parent.link), parent_from_link, Some(index)));
                Ok(Placed { link, link_from_body: Pose::IDENTITY })
            }
            (Some(parent), []) => {
                Ok(Placed { link: parent.link, link_from_body: parent.link_from_body * pose(&body.pose) })
            }
            _ => Err(self.document.unsupported(format!(
                "body `{name}`: a robot is one free root body and hinges at their body's origin"
            ))),
        }
    }

    /// Index of the actuator of a body's joint.
    fn actuated(&self, body: &str, joint: &Joint) -> Result<usize, SimError> {
        self.joints.iter().position(|actuated| Some(&actuated.name) == joint.name.as_ref()).ok_or_else(|| {
            self.document
                .unsupported(format!("joint {:?} of `{body}` has no <position> actuator", joint.name))
        })
    }

    /// Adds a body's mass, geoms and sites to its link.
    fn fill(&mut self, id: usize, body: &Body, at: Placed) -> Result<(), SimError> {
        let link = &mut self.links[at.link];
        if let Some(inertial) = &body.inertial {
            link.mass += mass_properties(inertial).transform_by(&at.link_from_body);
        }
        for mut geom in self.document.geoms(id)? {
            geom.body_from_geom = at.link_from_body * geom.body_from_geom;
            link.geoms.push(geom);
        }
        for site in &body.sites {
            let link_from_site = at.link_from_body * pose(&site.pose);
            let name = site.name.clone().unwrap_or_default();
            self.sites.entry(name).or_insert(SiteModel { link: at.link, link_from_site });
        }
        Ok(())
    }

    fn link_of(&self, body: &str) -> Option<usize> {
        let id = self.document.model.body_id_by_name(body)?;
        self.placed.get(&id).map(|placed| placed.link)
    }

    /// The sites `left_NAME` and `right_NAME`.
    fn sites(&self, name: &str, meaning: &str) -> Result<Sides<SiteModel>, SimError> {
        let site = |side: Side| {
            let name = format!("{}_{name}", side.name());
            self.sites
                .get(&name)
                .copied()
                .ok_or_else(|| self.document.unsupported(format!("needs a site `{name}` {meaning}")))
        };
        Ok(Sides { left: site(Side::Left)?, right: site(Side::Right)? })
    }

    /// Link pairs that never touch: those that the file names, and neighbours.
    fn excluded(&self) -> BTreeSet<(usize, usize)> {
        let named = self.document.model.contact.excludes.iter().filter_map(|pair| {
            let (a, b) = (self.link_of(&pair.body1)?, self.link_of(&pair.body2)?);
            Some((a.min(b), a.max(b)))
        });
        let neighbours = self
            .links
            .iter()
            .enumerate()
            .filter_map(|(child, link)| link.parent.map(|parent| (parent, child)));
        named.chain(neighbours).collect()
    }

    fn hand(&self, side: Side, wrist: usize) -> HandLinks {
        let mut hand = HandLinks { wrist, ..HandLinks::default() };
        for (index, link) in
            self.links.iter().enumerate().filter(|(_, link)| link.name.starts_with(side.name()))
        {
            if link.name.contains("hand_thumb") {
                hand.thumb.push(index);
            } else if link.name.contains("hand_") {
                hand.fingers.push(index);
            }
        }
        hand
    }
}

fn new_link(name: &str, parent: Option<usize>, parent_from_link: Pose, joint: Option<usize>) -> LinkModel {
    let mass = MassProperties::default();
    LinkModel { name: name.into(), parent, parent_from_link, joint, mass, geoms: Vec::new() }
}

fn find_camera(document: &Document) -> Result<MjcfCamera, SimError> {
    let camera = document.cameras.iter().find(|camera| camera.name == "egocentric").cloned();
    camera.ok_or_else(|| document.unsupported("needs a <camera name=\"egocentric\"> in the head"))
}

fn first_keyframe(document: &Document) -> Result<Vec<f64>, SimError> {
    let keyframe = document.model.keyframes.first();
    let keyframe = keyframe.ok_or_else(|| document.unsupported("needs a <keyframe> to stand in"))?;
    Ok(keyframe.qpos.clone())
}

/// Joints in actuator order; links are filled in later.
fn read_joints(document: &Document) -> Result<Vec<JointModel>, SimError> {
    document
        .model
        .actuators
        .iter()
        .map(|actuator| {
            let name = actuator.joint.clone().unwrap_or_default();
            let (body, index) = document
                .model
                .joint_by_name(&name)
                .ok_or_else(|| document.unsupported(format!("actuator of unknown joint `{name}`")))?;
            let joint = &document.model.bodies[body].body.joints[index];
            let missing = |what: &str| document.unsupported(format!("joint `{name}` needs {what}"));
            let [lower, upper] = joint.range.ok_or_else(|| missing("a range"))?;
            let [_, effort] = actuator.force_range.ok_or_else(|| missing("a forcerange on its actuator"))?;
            Ok(JointModel {
                link: 0,
                axis: vector(joint.axis).normalize(),
                lower_rad: lower as f32,
                upper_rad: upper as f32,
                armature_kg_m2: joint.armature as f32,
                friction_n_m: joint.frictionloss as f32,
                kp_n_m_rad: actuator.kp.ok_or_else(|| missing("a kp on its <position> actuator"))? as f32,
                kd_n_m_s_rad: actuator.kv.ok_or_else(|| missing("a kv on its <position> actuator"))? as f32,
                effort_n_m: effort as f32,
                rest_rad: 0.0,
                name,
            })
        })
        .collect()
}
