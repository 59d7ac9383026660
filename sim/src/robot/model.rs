//! A robot as its MJCF file describes it: links, joints with gains and limits, sites, cameras, self-collision pairs.

use std::collections::{BTreeSet, HashMap};

use mjcf_rs::body::JointType;
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::prelude::MassProperties;

use crate::mjcf::{Document, Geom, MjcfCamera, mass_properties, pose, vector};
use crate::{Side, Sides, SimError};

/// One rigid link. Bodies without a joint are merged into their parent's link.
#[derive(Clone, Debug)]
pub struct Link {
    pub name: String,
    pub parent: Option<usize>,
    /// Joint origin in the parent link's frame, at joint coordinate 0.
    pub parent_from_link: Pose,
    /// Index into [`RobotModel::joints`]; `None` for the pelvis.
    pub joint: Option<usize>,
    pub mass: MassProperties,
    pub geoms: Vec<Geom>,
}

/// One actuated hinge, with the PD gains and limits of its position actuator.
#[derive(Clone, Debug)]
pub struct JointModel {
    pub name: String,
    pub link: usize,
    /// In the link's frame.
    pub axis: Vector,
    pub lower_rad: f32,
    pub upper_rad: f32,
    pub armature_kg_m2: f32,
    pub friction_n_m: f32,
    pub kp_n_m_rad: f32,
    pub kd_n_m_s_rad: f32,
    pub effort_n_m: f32,
    /// Coordinate in the file's first keyframe.
    pub rest_rad: f32,
}

/// A frame fixed to a link.
#[derive(Clone, Debug)]
pub struct SiteModel {
    pub name: String,
    pub link: usize,
    pub link_from_site: Pose,
}

/// A robot that can be put into a world any number of times.
#[derive(Clone, Debug)]
pub struct RobotModel {
    /// Parents before children; 0 is the pelvis.
    pub links: Vec<Link>,
    /// Published order: the file's actuators.
    pub joints: Vec<JointModel>,
    pub sites: Vec<SiteModel>,
    pub egocentric: MjcfCamera,
    pub egocentric_link: usize,
    pub mass_kg: f32,
    /// Link pairs that never touch, smaller index first.
    excluded: BTreeSet<(usize, usize)>,
    pub hands: Sides<HandLinks>,
}

/// Links of one hand, for contact queries.
#[derive(Clone, Debug, Default)]
pub struct HandLinks {
    /// Link that carries palm and wrist.
    pub wrist: usize,
    pub thumb: Vec<usize>,
    pub fingers: Vec<usize>,
}

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
        let mut model = RobotModel {
            links: Vec::new(),
            joints: read_joints(&document)?,
            sites: Vec::new(),
            egocentric: find_camera(&document)?,
            egocentric_link: 0,
            mass_kg: 0.0,
            excluded: BTreeSet::new(),
            hands: Sides::default(),
        };
        let placed = model.read_links(&document)?;
        model.mass_kg = model.links.iter().map(|link| link.mass.mass()).sum();
        model.egocentric_link = match &model.egocentric.body {
            Some(body) => {
                document.model.body_id_by_name(body).and_then(|id| placed.get(&id)).map_or(0, |p| p.link)
            }
            None => 0,
        };
        model.exclude_contacts(&document, &placed);
        for side in Side::BOTH {
            model.hands[side] = model.find_hand(&document, side)?;
        }
        for site in ["left_foot", "right_foot"] {
            model
                .site(site)
                .ok_or_else(|| document.unsupported(format!("needs a site `{site}` at the sole's centre")))?;
        }
        Ok(model)
    }

    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    pub fn site(&self, name: &str) -> Option<&SiteModel> {
        self.sites.iter().find(|site| site.name == name)
    }

    pub(crate) fn may_touch(&self, a: usize, b: usize) -> bool {
        !self.excluded.contains(&(a.min(b), a.max(b)))
    }

    /// World poses of all links for a pelvis pose and joint coordinates in published order.
    pub fn forward_kinematics(&self, pelvis: Pose, q_rad: &[f32]) -> Vec<Pose> {
        let mut world_from_link: Vec<Pose> = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let pose = match (link.parent, link.joint) {
                (Some(parent), Some(joint)) => {
                    let turn = Rotation::from_axis_angle(self.joints[joint].axis, q_rad[joint]);
                    world_from_link[parent] * link.parent_from_link * Pose::from_rotation(turn)
                }
                _ => pelvis,
            };
            world_from_link.push(pose);
        }
        world_from_link
    }

    pub(crate) fn rest_rad(&self) -> Vec<f32> {
        self.joints.iter().map(|joint| joint.rest_rad).collect()
    }

    fn read_links(&mut self, document: &Document) -> Result<HashMap<usize, Placed>, SimError> {
        let mut placed: HashMap<usize, Placed> = HashMap::new();
        let mut rest = first_keyframe(document)?.into_iter();
        for (id, entry) in document.model.bodies_iter() {
            let body = &entry.body;
            let name = body.name.clone().unwrap_or_default();
            let parent = entry.parent.and_then(|parent| placed.get(&parent).copied());
            let at = match (parent, body.joints.as_slice()) {
                (None, [joint]) if joint.type_ == JointType::Free && self.links.is_empty() => {
                    rest.by_ref().take(7).for_each(drop);
                    self.links.push(new_link(&name, None, pose(&body.pose), None));
                    Placed { link: 0, link_from_body: Pose::IDENTITY }
                }
                (Some(parent), [joint]) if joint.type_ == JointType::Hinge && joint.pos == [0.0; 3] => {
                    let index = self.joints.iter().position(|j| Some(&j.name) == joint.name.as_ref());
                    let index = index.ok_or_else(|| {
                        document.unsupported(format!(
                            "joint {:?} of `{name}` has no <position> actuator",
                            joint.name
                        ))
                    })?;
                    let link = self.links.len();
                    self.joints[index].link = link;
                    self.joints[index].rest_rad = rest.next().unwrap_or(0.0) as f32;
                    let parent_from_link = parent.link_from_body * pose(&body.pose);
                    self.links.push(new_link(&name, Some(parent.link), parent_from_link, Some(index)));
                    Placed { link, link_from_body: Pose::IDENTITY }
                }
                (Some(parent), []) => {
                    Placed { link: parent.link, link_from_body: parent.link_from_body * pose(&body.pose) }
                }
                _ => {
                    let what = format!(
                        "body `{name}`: a robot is one free root body and hinges at their body's origin"
                    );
                    return Err(document.unsupported(what));
                }
            };
            placed.insert(id, at);
            let link = &mut self.links[at.link];
            if let Some(inertial) = &body.inertial {
                link.mass += mass_properties(inertial).transform_by(&at.link_from_body);
            }
            for mut geom in document.geoms(id)? {
                geom.body_from_geom = at.link_from_body * geom.body_from_geom;
                link.geoms.push(geom);
            }
            for site in &body.sites {
                self.sites.push(SiteModel {
                    name: site.name.clone().unwrap_or_default(),
                    link: at.link,
                    link_from_site: at.link_from_body * pose(&site.pose),
                });
            }
        }
        Ok(placed)
    }

    fn exclude_contacts(&mut self, document: &Document, placed: &HashMap<usize, Placed>) {
        let link_of =
            |name: &str| document.model.body_id_by_name(name).and_then(|id| placed.get(&id)).map(|p| p.link);
        for pair in &document.model.contact.excludes {
            if let (Some(a), Some(b)) = (link_of(&pair.body1), link_of(&pair.body2)) {
                self.excluded.insert((a.min(b), a.max(b)));
            }
        }
        for (child, link) in self.links.iter().enumerate() {
            if let Some(parent) = link.parent {
                self.excluded.insert((parent, child));
            }
        }
    }

    fn find_hand(&self, document: &Document, side: Side) -> Result<HandLinks, SimError> {
        let site = format!("{}_wrist", side.name());
        let wrist =
            self.site(&site).ok_or_else(|| document.unsupported(format!("needs a site `{site}`")))?.link;
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
        Ok(hand)
    }
}

fn new_link(name: &str, parent: Option<usize>, parent_from_link: Pose, joint: Option<usize>) -> Link {
    let mass = MassProperties::default();
    Link { name: name.into(), parent, parent_from_link, joint, mass, geoms: Vec::new() }
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
