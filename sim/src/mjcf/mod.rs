//! Reads MJCF through `mjcf-rs` and adds what that parser leaves out: cameras, and everything else as we use it.

mod actuator;
mod camera;
mod equality;
mod geometry;
mod joint;
mod key;
mod mass;
mod site;
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
pub use site::Site;
pub use tree::{BodyLink, BodyTree, PlacedBody};

use std::path::Path;

use rapier3d::math::{Pose, Rotation, Vector};

use crate::SimError;

/// A parsed file: bodies with defaults baked in, and its cameras.
pub struct Document {
    pub file: String,
    pub model: mjcf_rs::Model,
    pub cameras: Vec<MjcfCamera>,
}

impl Document {
    /// Parses MJCF text; `file` is what error messages call it. Includes and mesh files are not followed.
    pub fn parse(file: &str, xml: &str) -> Result<Document, SimError> {
        Document::parse_in(file, xml, Path::new("."))
    }

    /// Reads a file. Other MJCF files that it includes are read from where they lie beside it, without their cameras.
    pub fn read(path: &Path) -> Result<Document, SimError> {
        let file = path.display().to_string();
        let xml =
            std::fs::read_to_string(path).map_err(|source| SimError::Read { path: file.clone(), source })?;
        Document::parse_in(&file, &xml, path.parent().unwrap_or(Path::new(".")))
    }

    fn parse_in(file: &str, xml: &str, folder: &Path) -> Result<Document, SimError> {
        let model = mjcf_rs::Model::from_str(xml, folder)
            .map_err(|source| SimError::Mjcf { file: file.into(), source })?;
        let cameras = camera::parse(file, xml)?;
        Ok(Document { file: file.into(), model, cameras })
    }

    pub(crate) fn unsupported(&self, what: impl Into<String>) -> SimError {
        SimError::Unsupported { file: self.file.clone(), what: what.into() }
    }

    /// Geoms of a body, in that body's frame.
    pub(crate) fn geoms(&self, body: usize) -> Result<Vec<Geom>, SimError> {
        self.model.bodies[body].body.geoms.iter().map(|geom| Geom::read(self, geom)).collect()
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
