//! Bodies of a file as trees: links, the joints between them, their masses, geoms and sites. Plain data; nothing moves.

use rapier3d::glamx::DPose3;
use rapier3d::math::Pose;
use rapier3d::prelude::MassProperties;

use super::joint::{self, LinkJoint};
use super::{Document, Geom, Site, mass, pose};
use crate::SimError;

/// A top-level body with everything on it.
#[derive(Clone, Debug)]
pub struct BodyTree {
    /// Parents before children.
    pub links: Vec<BodyLink>,
}

/// A rigid part of a tree: a body with its joint, and the bodies without a joint that sit on it.
#[derive(Clone, Debug)]
pub struct BodyLink {
    /// Of the body that has the joint; the world's is "world".
    pub name: String,
    /// Index into [`BodyTree::links`]; `None` is the world.
    pub parent: Option<usize>,
    /// With the joint at 0.
    pub parent_from_link: DPose3,
    pub joint: LinkJoint,
    /// Link frame.
    pub mass: MassProperties,
    pub geoms: Vec<Geom>,
    pub sites: Vec<Site>,
    /// Bodies of the file that are part of this link, itself first.
    pub bodies: Vec<PlacedBody>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct PlacedBody {
    pub name: String,
    pub link_from_body: DPose3,
}

impl BodyTree {
    /// Nothing in it moves.
    pub fn is_fixed(&self) -> bool {
        self.links.iter().all(|link| link.joint == LinkJoint::Fixed)
    }
}

/// Where a body of the file ended up.
#[derive(Clone, Copy)]
struct Place {
    tree: usize,
    link: usize,
    link_from_body: DPose3,
}

impl Document {
    /// The world itself as a fixed tree, then every top-level body. The coordinates of all links in this order are
    /// MuJoCo's `qpos`.
    pub fn trees(&self) -> Result<Vec<BodyTree>, SimError> {
        let mut trees: Vec<BodyTree> = Vec::new();
        let mut places: Vec<Place> = Vec::new();
        for (id, entry) in self.model.bodies.iter().enumerate() {
            let joint = joint::read(self, id)?;
            let parent = entry.parent.filter(|parent| *parent != 0).map(|parent| places[parent]);
            let parent_from_body = entry.body.pose;
            let place = match parent {
                Some(parent) if joint == LinkJoint::Fixed => {
                    Place { link_from_body: parent.link_from_body * parent_from_body, ..parent }
                }
                Some(parent) => {
                    let links = &mut trees[parent.tree].links;
                    links.push(new_link(Some(parent.link), parent.link_from_body * parent_from_body, joint));
                    Place { link: links.len() - 1, link_from_body: DPose3::IDENTITY, ..parent }
                }
                None => {
                    trees.push(BodyTree { links: vec![new_link(None, parent_from_body, joint)] });
                    Place { tree: trees.len() - 1, link: 0, link_from_body: DPose3::IDENTITY }
                }
            };
            places.push(place);
            self.add_body(id, &mut trees[place.tree].links[place.link], place.link_from_body)?;
        }
        for link in trees.iter_mut().flat_map(|tree| &mut tree.links) {
            link.name = link.bodies[0].name.clone();
        }
        Ok(trees)
    }

    fn add_body(&self, id: usize, link: &mut BodyLink, link_from_body: DPose3) -> Result<(), SimError> {
        let body = &self.model.bodies[id].body;
        let name = if id == 0 { Some("world") } else { body.name.as_deref() };
        link.bodies.push(PlacedBody { name: name.unwrap_or_default().into(), link_from_body });
        let on_link: Pose = pose(&link_from_body);
        let geoms = self.geoms(id)?;
        let mass = match &body.inertial {
            Some(inertial) => mass::mass_properties(inertial),
            None => geoms.iter().map(mass::of_geom).fold(MassProperties::default(), |sum, part| sum + part),
        };
        link.mass += mass.transform_by(&on_link);
        link.geoms.extend(
            geoms.into_iter().map(|geom| Geom { body_from_geom: on_link * geom.body_from_geom, ..geom }),
        );
        link.sites.extend(
            self.sites(id).map(|site| Site { body_from_site: on_link * site.body_from_site, ..site }),
        );
        Ok(())
    }
}

fn new_link(parent: Option<usize>, parent_from_link: DPose3, joint: LinkJoint) -> BodyLink {
    BodyLink {
        name: String::new(),
        parent,
        parent_from_link,
        joint,
        mass: MassProperties::default(),
        geoms: Vec::new(),
        sites: Vec::new(),
        bodies: Vec::new(),
    }
}
