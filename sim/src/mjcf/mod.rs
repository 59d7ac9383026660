//! Reads MJCF through `mjcf-rs` and adds what that parser leaves out: cameras, and everything else as we use it.

mod actuator;
mod camera;
mod equality;
mod geometry;
mod joint;
mod key;
mod mass;
mod mesh;
mod site;
mod texture;
mod tree;
#[cfg(test)]
mod tree_tests;

pub use actuator::{Actuator, ActuatorKind};
pub use camera::MjcfCamera;
pub use equality::{Equality, EqualityKind};
pub use geometry::{Geom, Primitive};
pub use joint::{AxisJoint, LinkJoint};
pub use key::Key;
pub(crate) use mass::mass_properties;
pub use mesh::Mesh;
pub use site::Site;
pub use tree::{BodyLink, BodyTree, PlacedBody};

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rapier3d::math::{Pose, Rotation, Vector};
use xxhash_rust::xxh3::xxh3_64;

use crate::SimError;

/// A parsed file: bodies with defaults baked in, and its cameras.
#[derive(Debug)]
pub struct Document {
    pub file: String,
    pub model: mjcf_rs::Model,
    pub cameras: Vec<MjcfCamera>,
    /// Where files lie that it names.
    folder: PathBuf,
    /// Of the files that its assets name, by asset.
    meshes: BTreeMap<String, Arc<Mesh>>,
    texture_rgb: BTreeMap<String, [f32; 3]>,
}

impl Document {
    /// Parses MJCF text; `file` is what error messages call it. Files that it names are looked for in the working folder.
    pub fn parse(file: &str, xml: &str) -> Result<Document, SimError> {
        Document::parse_in(file, xml, Path::new("."))
    }

    /// Reads a file. What it includes, its meshes and its pictures are read from where they lie beside it; cameras of included files are
    /// not.
    pub fn read(path: &Path) -> Result<Document, SimError> {
        let file = path.display().to_string();
        let xml =
            std::fs::read_to_string(path).map_err(|source| SimError::Read { path: file.clone(), source })?;
        Document::parse_in(&file, &xml, path.parent().unwrap_or(Path::new(".")))
    }

    fn parse_in(file: &str, xml: &str, folder: &Path) -> Result<Document, SimError> {
        let model = mjcf_rs::Model::from_str(xml, folder)
            .map_err(|source| SimError::Mjcf { file: file.into(), source })?;
        let mut document = Document {
            file: file.into(),
            model,
            cameras: camera::parse(file, xml)?,
            folder: folder.into(),
            meshes: BTreeMap::new(),
            texture_rgb: BTreeMap::new(),
        };
        document.meshes = document.read_meshes()?;
        document.texture_rgb = document.read_textures()?;
        Ok(document)
    }

    /// Tells files of different content apart, with all that they include and name; comments do not count.
    pub fn fingerprint(&self) -> u64 {
        let content = format!("{:?} {:?} {:?} {:?}", self.model, self.cameras, self.meshes, self.texture_rgb);
        xxh3_64(content.as_bytes())
    }

    pub(crate) fn unsupported(&self, what: impl Into<String>) -> SimError {
        SimError::Unsupported { file: self.file.clone(), what: what.into() }
    }

    /// Geoms of a body, in that body's frame.
    pub(crate) fn geoms(&self, body: usize) -> Result<Vec<Geom>, SimError> {
        self.model.bodies[body].body.geoms.iter().map(|geom| Geom::read(self, geom)).collect()
    }

    /// Sites of what never moves, in the frame of the file.
    pub fn room_sites(&self) -> Result<Vec<Site>, SimError> {
        let trees = self.trees()?;
        let links = trees.iter().filter(|tree| tree.is_fixed()).flat_map(|tree| &tree.links);
        let placed = |link: &BodyLink| {
            let file_from_link = pose(&link.parent_from_link);
            let site = move |site: &Site| Site {
                body_from_site: file_from_link * site.body_from_site,
                ..site.clone()
            };
            link.sites.iter().map(site).collect::<Vec<_>>()
        };
        Ok(links.flat_map(placed).collect())
    }

    /// Sites of a body, in that body's frame.
    pub(crate) fn sites(&self, body: usize) -> impl Iterator<Item = Site> {
        self.model.bodies[body].body.sites.iter().map(Site::read)
    }
}

/// MJCF pose (f64) as a Rapier pose (f32).
pub(crate) fn pose(p: &mjcf_rs::Pose) -> Pose {
    let (t, r) = (p.translation, p.rotation);
    Pose::from_parts(
        Vector::new(t.x as f32, t.y as f32, t.z as f32),
        Rotation::from_xyzw(r.x as f32, r.y as f32, r.z as f32, r.w as f32).normalize(),
    )
}

pub(crate) fn vector([x, y, z]: [f64; 3]) -> Vector {
    Vector::new(x as f32, y as f32, z as f32)
}
