//! The only reader of MJCF, for robots, scenes and objects. It assembles the text with all includes
//! (`source`), and accepts or refuses every element and attribute by one table (`check`, `support`). It
//! parses the text with `mjcf-rs`, and converts it to its own types: bodies in trees, shapes, joints
//! with their actuators, equalities, keys, and the parts that `mjcf-rs` leaves out.

mod bodies;
mod check;
mod equality;
mod files;
mod frames;
mod geometry;
mod joints;
mod key;
mod source;
mod stated;
mod support;
#[cfg(test)]
mod tests;

pub use bodies::{BodyLink, BodyTree, PlacedBody};
pub use equality::{EqualityConstraint, EqualityKind};
pub use files::Mesh;
pub use frames::{MjcfCamera, Site};
pub use geometry::{Geom, Primitive};
pub use joints::{Actuator, ActuatorKind, AxisJoint, LinkJoint};
pub use key::Key;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rapier3d::math::{Pose, Rotation, Vector};
use xxhash_rust::xxh3::xxh3_64;

use crate::SimError;
use crate::user_file::{MAX_TEXT_BYTES, read_text};
use check::Checked;
use joints::UnreadRanges;
use source::MjcfText;

/// A parsed file. All its content is in effect; otherwise it would have been refused.
#[derive(Debug)]
pub struct Document {
    pub file: String,
    pub model: mjcf_rs::Model,
    pub cameras: Vec<MjcfCamera>,
    /// Speed limits of the motors, in the order of the actuators; `None` if the file gives none.
    speed_limit_values: Option<Vec<f64>>,
    unread: UnreadRanges,
    source: MjcfText,
    checked: Checked,
    /// Folder that the file's references are relative to.
    folder: PathBuf,
    /// Content of the files that assets name, by asset.
    meshes: BTreeMap<String, Arc<Mesh>>,
    texture_rgb: BTreeMap<String, [f32; 3]>,
}

impl Document {
    /// Parses MJCF text; `file` is its name in error messages. Files that it names are searched in the
    /// working folder.
    ///
    /// # Errors
    ///
    /// Returns an error if the text is not MJCF, or has elements or attributes that are refused.
    pub fn parse(file: &str, xml: &str) -> Result<Document, SimError> {
        Document::parse_in(file, xml, Path::new("."))
    }

    /// Parses self-contained MJCF text, which may name no other file.
    ///
    /// # Errors
    ///
    /// Returns an error if the text names a file, or as for [`Document::parse`].
    pub fn parse_alone(file: &str, xml: &str) -> Result<Document, SimError> {
        source::refuse_files(file, xml)?;
        Document::parse(file, xml)
    }

    /// Reads a file. Its includes, meshes and images are found relative to it.
    ///
    /// # Errors
    ///
    /// Returns an error if a file cannot be read, or as for [`Document::parse`].
    pub fn read(path: &Path) -> Result<Document, SimError> {
        let file = path.display().to_string();
        let xml = read_text(path, MAX_TEXT_BYTES)
            .map_err(|source| SimError::Read { path: file.clone(), source })?;
        Document::parse_in(&file, &xml, path.parent().unwrap_or(Path::new(".")))
    }

    fn parse_in(file: &str, xml: &str, folder: &Path) -> Result<Document, SimError> {
        let source = MjcfText::read(file, xml, folder)?;
        let checked = check::check(&source)?;
        let model = mjcf_rs::Model::from_str(&source.text, folder)
            .map_err(|source| SimError::Mjcf { file: file.into(), source })?;
        let mut document = Document {
            file: file.into(),
            model,
            cameras: frames::cameras(&source)?,
            speed_limit_values: joints::speed_limits(&source)?,
            unread: UnreadRanges::of(&source)?,
            source,
            checked,
            folder: folder.into(),
            meshes: BTreeMap::new(),
            texture_rgb: BTreeMap::new(),
        };
        document.approximate_collisions();
        document.meshes = document.read_meshes()?;
        document.texture_rgb = document.read_textures()?;
        Ok(document)
    }

    /// Returns the elements of the file that only approximate MuJoCo, one per line with their first place.
    pub fn approximations(&self) -> &[String] {
        &self.checked.approximated
    }

    /// Reports geoms with one-sided collision masks: here they collide with all others.
    fn approximate_collisions(&mut self) {
        let bodies = self.model.bodies.iter().zip(&self.checked.bodies);
        let mut one_sided = bodies.flat_map(|(entry, bytes)| entry.body.geoms.iter().zip(&bytes.geoms));
        if let Some((_, byte)) = one_sided.find(|(geom, _)| (geom.contype == 0) != (geom.conaffinity == 0)) {
            let what = "only one of contype and conaffinity is 0: it touches all that is not 0 in both";
            let line = self.source.line(*byte);
            self.checked.approximated.push(format!("`{line}`: geom: {what}"));
        }
    }

    /// Returns a hash of the content, including all files that it includes and names; comments do not count.
    pub fn fingerprint(&self) -> u64 {
        let read = (&self.model, &self.cameras, &self.meshes, &self.texture_rgb, &self.speed_limit_values);
        let mut content = format!("{read:?}");
        if self.unread != UnreadRanges::default() {
            content += &format!("{:?}", self.unread);
        }
        xxh3_64(content.as_bytes())
    }

    pub(crate) fn unsupported(&self, what: impl Into<String>) -> SimError {
        SimError::Unsupported { file: self.file.clone(), what: what.into() }
    }

    /// Returns the error that refuses a body, with its line and the names around it.
    fn refuse_body(&self, body: usize, what: &str) -> SimError {
        self.source.refuse_at(self.checked.bodies[body].body, what)
    }

    /// Returns the geoms of a body, in that body's frame.
    fn geoms(&self, body: usize) -> Result<Vec<Geom>, SimError> {
        (0..self.model.bodies[body].body.geoms.len()).map(|index| Geom::read(self, body, index)).collect()
    }

    /// Returns the sites of fixed trees, in the frame of the file.
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

    /// Returns the sites of a body, in that body's frame.
    fn sites(&self, body: usize) -> impl Iterator<Item = Site> {
        self.model.bodies[body].body.sites.iter().map(Site::read)
    }
}

/// Converts an MJCF pose (f64) to a Rapier pose (f32).
pub(crate) fn pose(p: &mjcf_rs::Pose) -> Pose {
    let (t, r) = (p.translation, p.rotation);
    Pose::from_parts(
        Vector::new(t.x as f32, t.y as f32, t.z as f32),
        Rotation::from_xyzw(r.x as f32, r.y as f32, r.z as f32, r.w as f32).normalize(),
    )
}

fn vector([x, y, z]: [f64; 3]) -> Vector {
    Vector::new(x as f32, y as f32, z as f32)
}
