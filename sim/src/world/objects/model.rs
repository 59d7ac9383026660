//! What an object's file says of it, whichever world it is put into.

use crate::mjcf::{BodyLink, BodyTree, Document, Geom, LinkJoint, Site};
use crate::{SimError, assets};

/// A rigid body of a file as tasks and pictures see it, in its own frame.
#[derive(Clone, Debug)]
pub struct ObjectModel {
    /// As the file calls it.
    pub name: String,
    pub geoms: Vec<Geom>,
    pub sites: Vec<Site>,
}

impl ObjectModel {
    /// Reads the top-level body of an embedded object file, without a world: a scorer needs the sites alone.
    pub fn load(file: &str) -> Result<ObjectModel, SimError> {
        let (_, tree) = ObjectModel::read(file)?;
        Ok(ObjectModel::of(&tree.links[0]))
    }

    pub fn site(&self, name: &str) -> Option<&Site> {
        self.sites.iter().find(|site| site.name == name)
    }

    /// An embedded object file, and the one body that lies directly in its world with all that is on it.
    pub(super) fn read(file: &str) -> Result<(Document, BodyTree), SimError> {
        let document = Document::parse(file, assets::object(file)?)?;
        // The first is the file's own world, with nothing in it.
        let mut trees = document.trees()?.into_iter().skip(1);
        let (Some(tree), None) = (trees.next(), trees.next()) else {
            return Err(document.unsupported("an object file has one top-level body"));
        };
        let root = &tree.links[0];
        let falls = matches!(root.joint, LinkJoint::Free { .. });
        if falls && !root.geoms.iter().any(|geom| geom.collides && geom.collider().is_some()) {
            let what = format!("free body `{}` has no geom that collides", root.name);
            return Err(document.unsupported(what));
        }
        Ok((document, tree))
    }

    pub(super) fn of(link: &BodyLink) -> ObjectModel {
        ObjectModel { name: link.name.clone(), geoms: link.geoms.clone(), sites: link.sites.clone() }
    }
}
