//! Automatic exposure: an image is as bright, on the whole, as one by the rasterisers.

use rapier3d::math::Vector;

use super::develop::developed_rgb;
use super::scene::LAYERS;
use super::view::SeenSurface;
use crate::render::Light;
use crate::render::shading::LAMP;

/// Share of the surfaces towards the rasterisers' sun that it reaches.
const SUNLIT_SHARE: f32 = 0.92;
/// Number of corrections; each takes the compression of bright tones into account.
const CORRECTIONS: usize = 4;

/// Returns the factor from light to linear values of an image.
pub fn exposure_factor(
    light: &Light,
    eye_m: Vector,
    guides: &[SeenSurface],
    light_rgb: &[[Vector; LAYERS]],
) -> f32 {
    let lit = || guides.iter().zip(light_rgb).filter(|(seen, _)| seen.id != 0);
    let sum = |colours: &mut dyn Iterator<Item = Vector>| -> f64 {
        colours.map(|rgb| f64::from(rgb.element_sum())).sum()
    };
    let wanted = sum(&mut lit().map(|(seen, _)| rasterised_rgb(light, eye_m, seen)));
    let mut factor = 1.0;
    for _ in 0..CORRECTIONS {
        let drawn = sum(&mut lit().map(|(seen, layers_rgb)| developed_rgb(seen.albedo, *layers_rgb, factor)));
        // In the dark, no exposure helps.
        if drawn > 0.0 {
            factor *= (wanted / drawn) as f32;
        }
    }
    factor
}

/// Returns the linear colour of a surface in an image of a rasteriser, with as much shadow as usual.
fn rasterised_rgb(
    light: &Light,
    eye_m: Vector,
    SeenSurface { point_m, normal, albedo, .. }: &SeenSurface,
) -> Vector {
    let ambient_rgb = light.below_rgb + (light.above_rgb - light.below_rgb) * (normal.z * 0.5 + 0.5);
    let towards_eye = (eye_m - point_m).normalize_or_zero().dot(*normal).abs();
    let sun_rgb = light.sun_rgb * (normal.dot(light.sun_direction).max(0.0) * SUNLIT_SHARE);
    (albedo * (ambient_rgb + Vector::splat(LAMP * towards_eye) + sun_rgb)).min(Vector::ONE)
}
