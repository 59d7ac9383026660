//! Light stress: the sun is elsewhere, stronger or weaker, and warmer or colder, and so is the sky.

use tandem_sim::mjcf::LightKind;
use tandem_sim::render::{Light, Scenery};
use tandem_sim::{Rotation, Vector};

use super::{StressAxis, StressLevel, random};

/// Relative change of the strength of sun and sky.
const STRENGTH: [f32; 3] = [0.25, 0.45, 0.65];
/// Relative shift between red and blue.
const WARMTH: [f32; 3] = [0.08, 0.16, 0.28];
/// Rotation of the sun about the vertical; `LOWER_DEG` is the loss of elevation.
const TURN_DEG: [f32; 3] = [40.0, 80.0, 140.0];
const LOWER_DEG: [f32; 3] = [6.0, 14.0, 26.0];

/// Changes the light of a scenery: sun and sky, or the lights of the scene's file.
pub fn relight(scenery: &mut Scenery, level: StressLevel, seed: u32) {
    let plain = scenery.light;
    scenery.light = light(level, seed);
    let heading_rad = |light: &Light| light.sun_direction.y.atan2(light.sun_direction.x);
    let turn = Rotation::from_rotation_z(heading_rad(&scenery.light) - heading_rad(&plain));
    if let Some(lamps) = &mut scenery.lamps {
        lamps.tint(scenery.light.sun_rgb / plain.sun_rgb);
        for lamp in &mut lamps.lamps {
            if lamp.light.kind == LightKind::Directional {
                lamp.light.direction = turn * lamp.light.direction;
            }
        }
    }
}

fn light(level: StressLevel, seed: u32) -> Light {
    let plain = Light::default();
    let mut random = random(StressAxis::Light, seed, 0);
    let mut sign = || if random.uniform([0.0, 1.0]) < 0.5 { -1.0 } else { 1.0 };
    let [stronger, warmer, turned] = [sign(), sign(), sign()];
    let strength = 1.0 + stronger * level.of(STRENGTH);
    let warmth = warmer * level.of(WARMTH);
    let tint = Vector::new(1.0 + warmth, 1.0, 1.0 - warmth) * strength;
    let turn_rad = turned * level.of(TURN_DEG).to_radians();
    let height_rad = plain.sun_direction.z.asin() - level.of(LOWER_DEG).to_radians();
    let heading_rad = plain.sun_direction.y.atan2(plain.sun_direction.x) + turn_rad;
    let level_share = height_rad.cos();
    let (sine, cosine) = heading_rad.sin_cos();
    Light {
        sun_rgb: plain.sun_rgb * tint,
        sun_direction: Vector::new(cosine * level_share, sine * level_share, height_rad.sin()),
        below_rgb: plain.below_rgb * tint,
        above_rgb: plain.above_rgb * tint,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_goes_ever_farther_from_what_it_is() {
        let plain = Light::default();
        for seed in 0..20 {
            let lights = StressLevel::ALL.map(|level| light(level, seed));
            let turned = lights.map(|light| light.sun_direction.angle_between(plain.sun_direction));
            let brightness =
                lights.map(|light| (light.sun_rgb.element_sum() / plain.sun_rgb.element_sum() - 1.0).abs());
            for differences in [turned, brightness] {
                assert!(differences.is_sorted_by(|a, b| a < b) && differences[0] > 0.05, "{differences:?}");
            }
            assert!(lights.iter().all(
                |light| (light.sun_direction.length() - 1.0).abs() < 1e-4 && light.sun_direction.z > 0.3
            ));
        }
    }
}
