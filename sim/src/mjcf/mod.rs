//! Reads MJCF through `mjcf-rs` and adds what that parser leaves out: cameras, and geoms and sites as we use them.

mod camera;
mod geometry;
mod site;

pub use camera::MjcfCamera;
pub use geometry::{Geom, Primitive};
pub use site::Site;

use mjcf_rs::body::{InertiaSpec, Inertial};
use rapier3d::math::{Matrix, Pose, Rotation, Vector};
use rapier3d::prelude::MassProperties;

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
        let model = mjcf_rs::Model::from_str(xml, ".")
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

/// Mass properties of an `<inertial>`, in the body's frame.
pub(crate) fn mass_properties(inertial: &Inertial) -> MassProperties {
    let inertia = match inertial.inertia {
        InertiaSpec::Diagonal(d) => Matrix::from_diagonal(vector(d)),
        InertiaSpec::Full([xx, yy, zz, xy, xz, yz]) => {
            Matrix::from_cols(vector([xx, xy, xz]), vector([xy, yy, yz]), vector([xz, yz, zz]))
        }
    };
    MassProperties::with_inertia_matrix(Vector::ZERO, inertial.mass as f32, inertia)
        .transform_by(&pose(&inertial.pose))
}
