//! The model of an object from its file, independent of the world that it is put into.

use std::sync::Arc;

use rapier3d::math::{Pose, Vector};

use super::opening::{Opening, farthest};
use crate::mechanism::{Solid, rounded};
use crate::mjcf::{BodyLink, BodyTree, Document, Geom, LinkJoint, SceneBody, Site};
use crate::{SimError, assets};

/// Source of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectFile {
    /// A file embedded in the binary, by its name in `assets/objects`.
    Embedded(String),
    /// MJCF that refers to no other files, and its name in messages.
    Text { name: String, mjcf: String },
    /// A parsed file, including the files that it refers to.
    Read(Arc<Document>),
    /// A body of the scene, by its name there; see [`Document::scene_bodies`].
    OfScene { scene: Arc<Document>, body: String },
}

impl From<&str> for ObjectFile {
    fn from(name: &str) -> ObjectFile {
        ObjectFile::Embedded(name.into())
    }
}

/// A rigid body of a file for tasks and images, in its own frame.
#[derive(Clone, Debug)]
pub struct ObjectModel {
    /// Name of the body in its file.
    pub name: String,
    pub geoms: Vec<Geom>,
    pub sites: Vec<Site>,
    /// Mass of this body alone, without its moving parts.
    pub mass_kg: f32,
    /// Joint between the body and its carrier; `None` unless it is a hinge or a slide.
    pub opening: Option<Opening>,
    solid: Solid,
}

/// A rigid part of an object, in the file's pose with every joint at 0.
#[derive(Clone, Debug)]
pub struct ObjectPart {
    /// Name of the part in a world.
    pub name: String,
    /// Pose in the object's frame, which is that of its first part.
    pub object_from_part: Pose,
    /// Pose in the object's frame with its own joint at the end of its range that is farther from 0; `None`
    /// for a part whose joint has no range.
    pub object_from_moved_part: Option<Pose>,
    /// Name in a world of the part that carries this one; `None` if the world does.
    pub carrier: Option<String>,
    pub model: ObjectModel,
}

impl ObjectPart {
    fn of_scene(scene: &Document, body: &str, name: &str) -> Result<ObjectPart, SimError> {
        let SceneBody { link, carrier, .. } = scene.scene_body(body)?;
        let mut model = ObjectModel::of(&link);
        // A motion relative to a body without a name could not be described.
        if carrier.as_ref().is_some_and(|carrier| scene.scene_body(carrier).is_err()) {
            model.opening = None;
        }
        Ok(ObjectPart {
            name: name.into(),
            object_from_part: Pose::IDENTITY,
            object_from_moved_part: farthest(&link.joint),
            carrier,
            model,
        })
    }
}

impl ObjectModel {
    /// Reads the parts that a file has in a world under `name`, without building a world (for scorers).
    /// The object itself is first, then come the parts that move on it.
    ///
    /// # Errors
    ///
    /// Returns an error if the file is not an object's.
    pub fn parts(file: &ObjectFile, name: &str) -> Result<Vec<ObjectPart>, SimError> {
        if let ObjectFile::OfScene { scene, body } = file {
            return Ok(vec![ObjectPart::of_scene(scene, body, name)?]);
        }
        let (_, tree) = ObjectModel::read(file)?;
        let mut parts: Vec<ObjectPart> = Vec::with_capacity(tree.links.len());
        for link in &tree.links {
            let on_parent = |parent: usize| parts[parent].object_from_part * rounded(&link.parent_from_link);
            let object_from_part = link.parent.map_or(Pose::IDENTITY, on_parent);
            parts.push(ObjectPart {
                name: part_name(name, link),
                object_from_part,
                object_from_moved_part: farthest(&link.joint).map(|moved| object_from_part * moved),
                carrier: link.parent.map(|carrier| parts[carrier].name.clone()),
                // The placement of the file is unknown here.
                model: match link.parent {
                    Some(_) => ObjectModel::of(link),
                    None => ObjectModel { opening: None, ..ObjectModel::of(link) },
                },
            });
        }
        Ok(parts)
    }

    pub fn site(&self, name: &str) -> Option<&Site> {
        self.sites.iter().find(|site| site.name == name)
    }

    /// Returns the maximum coordinate of the colliding shapes along a unit vector, both in the world frame.
    pub fn reach_m(&self, world_from_object: &Pose, direction: Vector) -> f32 {
        self.solid.reach_m(world_from_object, direction)
    }

    /// Returns the height above the floor of the lowest point of the colliding shapes.
    pub fn lowest_m(&self, world_from_object: &Pose) -> f32 {
        -self.reach_m(world_from_object, Vector::NEG_Z)
    }

    /// Returns true if a point (object's frame) is in the open, but between walls and over a floor: every ray
    /// from it that is level in the object's own frame, or goes down, hits the object.
    pub fn encloses(&self, point_m: Vector) -> bool {
        self.solid.encloses(point_m)
    }

    /// Reads an object's file. Returns the document and its one top-level body, including the bodies that it
    /// carries.
    pub(super) fn read(file: &ObjectFile) -> Result<(Document, BodyTree), SimError> {
        let document = match file {
            ObjectFile::Embedded(name) => Document::parse(name, assets::object(name)?)?,
            ObjectFile::Text { name, mjcf } => Document::parse_alone(name, mjcf)?,
            ObjectFile::Read(document) | ObjectFile::OfScene { scene: document, .. } => {
                Document::clone(document)
            }
        };
        let mut trees = document.trees()?.into_iter();
        // The first tree is the file's own world.
        let world = trees.next().into_iter().flat_map(|world| world.links);
        let (Some(tree), None) = (trees.next(), trees.next()) else {
            return Err(document.unsupported("an object file has one top-level body"));
        };
        let beside = world.into_iter().any(|link| !link.geoms.is_empty() || !link.sites.is_empty());
        if beside || !document.cameras.is_empty() {
            return Err(document.unsupported("an object file has geoms and sites on its body, and no camera"));
        }
        if !document.actuators()?.is_empty() || !document.keys()?.is_empty() {
            return Err(document.unsupported("an object file has neither actuators nor keys; scenes have"));
        }
        let root = &tree.links[0];
        let falls = matches!(root.joint, LinkJoint::Free { .. });
        if falls && !root.geoms.iter().any(|geom| geom.collides && geom.collider().is_some()) {
            let what = format!("free body `{}` has no geom that collides", root.name);
            return Err(document.unsupported(what));
        }
        Ok((document, tree))
    }

    pub(super) fn of(link: &BodyLink) -> ObjectModel {
        ObjectModel {
            name: link.name.clone(),
            geoms: link.geoms.clone(),
            sites: link.sites.clone(),
            mass_kg: link.mass.mass(),
            opening: Opening::of(link),
            solid: Solid::of(&link.geoms),
        }
    }
}

/// Returns the name of a part: the object's name, followed by the part's own name unless it is the first
/// part.
pub(super) fn part_name(object: &str, link: &BodyLink) -> String {
    match link.parent {
        None => object.into(),
        Some(_) => format!("{object} {}", link.name),
    }
}
