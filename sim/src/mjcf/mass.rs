//! Masses of bodies: as `<inertial>` states them, or from the geoms.

use mjcf_rs::body::{InertiaSpec, Inertial};
use rapier3d::math::{Matrix, Vector};
use rapier3d::prelude::MassProperties;

use super::{Geom, Primitive, pose, vector};

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

/// Mass properties of a geom filled evenly, in its body's frame. As in MuJoCo, a geom weighs something whether or not it
/// collides, unless its mass is 0; a plane weighs nothing.
pub(super) fn of_geom(geom: &Geom) -> MassProperties {
    let Some((body_from_shape, shape)) = geom.collider() else { return MassProperties::default() };
    let of_unit_density = match geom.primitive {
        Primitive::Plane { .. } => return MassProperties::default(),
        // The collision shape is a hull with flat faces.
        Primitive::Ellipsoid { radii_m } => ellipsoid(radii_m).transform_by(&geom.body_from_geom),
        Primitive::Sphere { .. }
        | Primitive::Capsule { .. }
        | Primitive::Cylinder { .. }
        | Primitive::Box { .. }
        | Primitive::Convex { .. }
        | Primitive::Mesh(_) => shape.mass_properties(1.0).transform_by(&body_from_shape),
    };
    let mass_kg = geom.mass_kg.unwrap_or(geom.density_kg_m3 * of_unit_density.mass());
    let mut mass = of_unit_density;
    mass.set_mass(mass_kg, true);
    mass
}

/// m = 4/3 pi a b c,  I_xx = m (b^2 + c^2) / 5.
fn ellipsoid(radii_m: Vector) -> MassProperties {
    let mass = 4.0 / 3.0 * std::f32::consts::PI * radii_m.x * radii_m.y * radii_m.z;
    let s = radii_m * radii_m * (mass / 5.0);
    MassProperties::new(Vector::ZERO, mass, Vector::new(s.y + s.z, s.x + s.z, s.x + s.y))
}
