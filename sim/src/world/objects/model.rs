//! What an object's file says of it, whichever world it is put into.

use mjcf_rs::body::JointType;
use rapier3d::math::Pose;
use rapier3d::prelude::MassProperties;

use crate::mjcf::{Document, Geom, Site, mass_properties, pose};
use crate::{SimError, assets};

/// A top-level body with all that belongs to its jointless descendants, in its own frame.
#[derive(Clone, Debug)]
pub struct ObjectModel {
    /// As the file calls it.
    pub name: String,
    pub geoms: Vec<Geom>,
    pub sites: Vec<Site>,
    /// It has a free joint; else it stays where it is put.
    pub free: bool,
    /// The file's `<inertial>` elements; where there are none, geoms have mass.
    pub(super) mass: MassProperties,
    pub(super) has_inertial: bool,
    pub(super) world_from_body: Pose,
}

impl ObjectModel {
    /// Reads an embedded object file, without a world: a scorer needs the sites alone.
    pub fn load(file: &str) -> Result<ObjectModel, SimError> {
        let document = Document::parse(file, assets::object(file)?)?;
        // The first is the file's own world, with nothing in it.
        let mut models = top_level(&document)?.into_iter().skip(1);
        match (models.next(), models.next()) {
            (Some(model), None) => Ok(model),
            _ => Err(document.unsupported("an object file has one top-level body; its parts have no joints")),
        }
    }

    pub fn site(&self, name: &str) -> Option<&Site> {
        self.sites.iter().find(|site| site.name == name)
    }

    fn new(entry: &mjcf_rs::body::Body, free: bool) -> ObjectModel {
        ObjectModel {
            name: entry.name.clone().unwrap_or_default(),
            geoms: Vec::new(),
            sites: Vec::new(),
            free,
            mass: MassProperties::default(),
            has_inertial: false,
            world_from_body: pose(&entry.pose),
        }
    }

    /// Takes in a body of the file that lies in this one.
    fn add(&mut self, document: &Document, id: usize, top_from_body: Pose) -> Result<(), SimError> {
        if let Some(inertial) = &document.model.bodies[id].body.inertial {
            self.mass += mass_properties(inertial).transform_by(&top_from_body);
            self.has_inertial = true;
        }
        for mut geom in document.geoms(id)? {
            geom.body_from_geom = top_from_body * geom.body_from_geom;
            self.geoms.push(geom);
        }
        for mut site in document.sites(id) {
            site.body_from_site = top_from_body * site.body_from_site;
            self.sites.push(site);
        }
        Ok(())
    }

    fn collides(&self) -> bool {
        self.geoms.iter().any(|geom| geom.collides && geom.collider().is_some())
    }
}

/// The world of a file, then every body that lies directly in it.
pub(super) fn top_level(document: &Document) -> Result<Vec<ObjectModel>, SimError> {
    let mut models: Vec<ObjectModel> = Vec::new();
    // Index into `models` and pose in it, per body of the file.
    let mut owner: Vec<(usize, Pose)> = Vec::new();
    for (id, entry) in document.model.bodies.iter().enumerate() {
        let free = match entry.body.joints.as_slice() {
            [] => false,
            [joint] if joint.type_ == JointType::Free => true,
            _ => return Err(document.unsupported("joints in scenes and objects: only a free joint is read")),
        };
        let (index, top_from_body) = match entry.parent.filter(|parent| *parent != 0) {
            Some(_) if free => return Err(document.unsupported("a free joint below another body")),
            Some(parent) => (owner[parent].0, owner[parent].1 * pose(&entry.body.pose)),
            None => {
                models.push(ObjectModel::new(&entry.body, free));
                (models.len() - 1, Pose::IDENTITY)
            }
        };
        owner.push((index, top_from_body));
        models[index].add(document, id, top_from_body)?;
    }
    match models.iter().find(|model| model.free && !model.collides()) {
        Some(model) => {
            Err(document.unsupported(format!("free body `{}` has no geom that collides", model.name)))
        }
        None => Ok(models),
    }
}
