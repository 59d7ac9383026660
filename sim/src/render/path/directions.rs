//! Random directions about a normal. They use no trigonometry of the system's library, which may round
//! differently from one processor to another.

use std::f32::consts::FRAC_PI_2;

use rapier3d::math::Vector;

/// Samples a direction about a normal. The density is proportional to the cosine to the normal.
pub fn cosine_about(normal: Vector, [u, v]: [f32; 2]) -> Vector {
    let (radius, [cosine, sine]) = (u.sqrt(), circle(v));
    let [right, ahead] = across(normal);
    (right * (radius * cosine) + ahead * (radius * sine) + normal * (1.0 - u).sqrt()).normalize()
}

/// Samples the normal of a facet. The density is the GGX distribution times the cosine to the normal.
/// Source: Walter et al. 2007, equation 35.
pub fn facet_about(normal: Vector, width_2_ratio: f32, [u, v]: [f32; 2]) -> Vector {
    let cosine_2 = (1.0 - u) / (1.0 + (width_2_ratio - 1.0) * u);
    let (radius, [cosine, sine]) = ((1.0 - cosine_2).max(0.0).sqrt(), circle(v));
    let [right, ahead] = across(normal);
    (right * (radius * cosine) + ahead * (radius * sine) + normal * cosine_2.sqrt()).normalize()
}

/// Returns two axes perpendicular to a normal and to each other.
/// Source: Duff et al. 2017, Building an orthonormal basis, revisited.
pub fn across(normal: Vector) -> [Vector; 2] {
    let sign = 1f32.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    [
        Vector::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
        Vector::new(b, sign + normal.y * normal.y * a, -normal.y),
    ]
}

/// Returns the point of the unit circle at a share of a turn, counted from an unspecified angle.
pub fn circle(turn_share: f32) -> [f32; 2] {
    let quarters = turn_share * 4.0;
    let quarter = (quarters as u32).min(3);
    let angle_rad = (quarters - quarter as f32 - 0.5) * FRAC_PI_2;
    let square = angle_rad * angle_rad;
    let sine = angle_rad * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square / 5040.0)));
    let cosine = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0 - square / 40320.0)));
    match quarter {
        0 => [cosine, sine],
        1 => [-sine, cosine],
        2 => [-cosine, -sine],
        _ => [sine, -cosine],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the centres of a grid's cells in the unit square.
    fn grid() -> impl Iterator<Item = [f32; 2]> {
        (0..64).flat_map(|u| (0..64).map(move |v| [(u as f32 + 0.5) / 64.0, (v as f32 + 0.5) / 64.0]))
    }

    #[test]
    fn the_circle_is_one() {
        for number in 0..1000 {
            let share = number as f32 / 1000.0;
            let angle_rad = (share - 0.125) * std::f32::consts::TAU;
            let [cosine, sine] = circle(share);
            assert!(
                (cosine - angle_rad.cos()).abs() < 2e-6 && (sine - angle_rad.sin()).abs() < 2e-6,
                "{share}"
            );
        }
    }

    #[test]
    fn directions_have_the_means_of_their_densities() {
        for normal in [Vector::Z, Vector::NEG_Z, Vector::new(0.6, 0.0, 0.8), Vector::new(0.36, -0.48, -0.8)] {
            let mean = |each: &dyn Fn([f32; 2]) -> f32| grid().map(each).sum::<f32>() / (64.0 * 64.0);
            // The mean cosine of the density cos / pi is 2/3.
            let cosine = mean(&|pair| cosine_about(normal, pair).dot(normal));
            assert!((cosine - 2.0 / 3.0).abs() < 2e-3, "{cosine}");
            let sideways = grid().map(|pair| cosine_about(normal, pair)).sum::<Vector>() / (64.0 * 64.0);
            assert!((sideways - normal * cosine).length() < 1e-3);
            // With a width of 1, the distribution is that of the cosine.
            let facet = mean(&|pair| facet_about(normal, 1.0, pair).dot(normal));
            assert!((facet - 2.0 / 3.0).abs() < 2e-3, "{facet}");
        }
    }
}
