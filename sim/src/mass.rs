//! Mass properties of bodies from inertia matrices, densities and sums.
//!
//! Parry's eigenvectors of an inertia matrix are wrong if its entries differ by less than about 1e-5: the
//! long axis of a pencil would get the inertia of another axis. Masses are therefore multiplied by a power of
//! two, which adds no rounding error, until their inertia is about 1000 kg m^2.

use rapier3d::math::{Matrix, Vector};
use rapier3d::prelude::MassProperties;

/// Exponent of two of the inertia (kg m^2) at which eigenvectors are computed, and its largest change.
const INERTIA_EXPONENT: f32 = 10.0;
const MAX_EXPONENT: f32 = 60.0;

/// Returns the mass properties of a mass with an inertia about its centre, which is the origin.
pub fn with_inertia(mass_kg: f32, inertia_kg_m2: Matrix) -> MassProperties {
    let factor = factor_for(inertia_kg_m2.diagonal().element_sum());
    let scaled_inertia = inertia_kg_m2 * factor;
    scaled(
        MassProperties::with_inertia_matrix(Vector::ZERO, mass_kg * factor, scaled_inertia),
        factor.recip(),
    )
}

/// Returns the mass properties of two masses together.
pub fn sum(a: MassProperties, b: MassProperties) -> MassProperties {
    let away_m = a.local_com - b.local_com;
    let of_both = a.principal_inertia().max_element() + b.principal_inertia().max_element();
    let factor = factor_for(of_both + (a.mass() + b.mass()) * away_m.length_squared());
    scaled(scaled(a, factor) + scaled(b, factor), factor.recip())
}

/// Returns mass properties at a density of 1 from those at any density.
pub fn at_unit_density(mass_of_density: impl Fn(f32) -> MassProperties) -> MassProperties {
    let factor = factor_for(mass_of_density(1.0).principal_inertia().max_element());
    scaled(mass_of_density(factor), factor.recip())
}

/// Returns the power of two at which eigenvectors of an inertia are accurate.
fn factor_for(inertia_kg_m2: f32) -> f32 {
    if !inertia_kg_m2.is_normal() {
        return 1.0;
    }
    let exponent = INERTIA_EXPONENT - inertia_kg_m2.abs().log2().floor();
    exponent.clamp(-MAX_EXPONENT, MAX_EXPONENT).exp2()
}

/// Multiplies mass and inertia.
fn scaled(mass: MassProperties, factor: f32) -> MassProperties {
    MassProperties {
        inv_mass: mass.inv_mass / factor,
        inv_principal_inertia: mass.inv_principal_inertia / factor,
        ..mass
    }
}

#[cfg(test)]
mod tests {
    use rapier3d::math::Pose;
    use rapier3d::parry::shape::SharedShape;

    use super::*;

    /// Returns the largest deviation from a diagonal matrix, as a share of its largest entry.
    fn deviation(mass: MassProperties, expected: [f32; 3]) -> f32 {
        let difference = mass.reconstruct_inertia_matrix() - Matrix::from_diagonal(Vector::from(expected));
        let largest = difference.to_cols_array().into_iter().map(f32::abs).fold(0.0, f32::max);
        largest / expected.into_iter().fold(0.0, f32::max)
    }

    #[test]
    fn light_and_heavy_bodies_keep_the_axes_of_their_inertia() {
        for size_kg_m2 in [1e-12, 1e-10, 1e-7, 1e-4, 1.0, 1e4, 1e7] {
            for shape in [[1.0, 0.001, 0.9], [0.3, 1.0, 0.8], [0.9, 1.0, 0.2], [1.0; 3]] {
                let expected = shape.map(|entry| entry * size_kg_m2);
                let mass = with_inertia(0.1, Matrix::from_diagonal(Vector::from(expected)));
                assert!(deviation(mass, expected) < 1e-5, "{expected:?}: {mass:?}");
                assert_eq!(mass.mass(), 0.1);
            }
        }
    }

    #[test]
    fn pencils_have_the_inertia_of_pencils() {
        let (half_m, density_kg_m3) = (Vector::new(0.002, 0.1, 0.002), 700.0);
        let mass_kg = 8.0 * half_m.element_product() * density_kg_m3;
        let about = |a_m: f32, b_m: f32| mass_kg / 3.0 * (a_m * a_m + b_m * b_m);
        let expected = [about(half_m.y, half_m.z), about(half_m.x, half_m.z), about(half_m.x, half_m.y)];

        let corner =
            |i: u32| half_m * Vector::from([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 }));
        let corners: Vec<Vector> = (0..8).map(corner).collect();
        let hull = SharedShape::convex_hull(&corners).expect("a hull");
        let mut of_hull = at_unit_density(|density| hull.mass_properties(density));
        of_hull.set_mass(mass_kg, true);
        // Parry integrates over a hull in single precision.
        assert!(deviation(of_hull, expected) < 1e-3, "{of_hull:?}");

        let half = SharedShape::cuboid(half_m.x, 0.5 * half_m.y, half_m.z).mass_properties(density_kg_m3);
        let placed = |y_m: f32| half.transform_by(&Pose::from_translation(Vector::new(0.0, y_m, 0.0)));
        let of_halves = sum(placed(0.5 * half_m.y), placed(-0.5 * half_m.y));
        assert!(deviation(of_halves, expected) < 1e-5, "{of_halves:?}");
    }
}
