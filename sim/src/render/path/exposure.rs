//! Automatic exposure: the mean brightness of an image matches that of the rasterisers.

use rapier3d::math::Vector;

use super::develop::developed_rgb;
use super::scene::LAYERS;
use super::view::{PathView, SeenSurface};

/// Number of corrections; each takes the compression of bright tones into account.
const CORRECTIONS: usize = 4;

/// Returns the factor from light to linear values of an image.
pub fn exposure_factor(view: &PathView, guides: &[SeenSurface], light_rgb: &[[Vector; LAYERS]]) -> f32 {
    let lit = || guides.iter().zip(light_rgb).filter(|(seen, _)| seen.id != 0);
    let sum = |colours: &mut dyn Iterator<Item = Vector>| -> f64 {
        colours.map(|rgb| f64::from(rgb.element_sum())).sum()
    };
    let wanted = sum(&mut lit().map(|(seen, _)| view.rasterised_rgb(seen)));
    let mut factor = 1.0;
    for _ in 0..CORRECTIONS {
        let drawn = sum(&mut lit().map(|(seen, layers_rgb)| developed_rgb(seen, *layers_rgb, factor)));
        // In the dark, no exposure helps.
        if drawn > 0.0 {
            factor *= (wanted / drawn) as f32;
        }
    }
    factor
}
