//! Texture stress: the room has other colours and patterns, and objects are lighter or darker. Their hues
//! stay, since instructions name them, and robots are unchanged.

use tandem_sim::render::{Carrier, Part, Pattern, Scenery};

use super::{StressAxis, StressLevel, random};

/// Share of the way from the room's colours to new ones.
const NEW_COLOUR: [f32; 3] = [0.3, 0.6, 0.9];
/// Share of the room's materials that also have a new pattern.
const NEW_PATTERN: [f32; 3] = [0.3, 0.6, 0.9];
/// Relative change of the objects' brightness.
const OBJECT_SHADE: [f32; 3] = [0.1, 0.2, 0.3];
/// Brightness of a checker's dark squares relative to its light ones.
const CHECKER_DARK: f32 = 0.6;

pub fn repaint(scenery: &mut Scenery, level: StressLevel, seed: u32) {
    // Parts that share a colour share the new one.
    let mut paints: Vec<[f32; 3]> = Vec::new();
    for part in &mut scenery.parts {
        let paint = match paints.iter().position(|known| *known == part.rgb) {
            Some(known) => known,
            None => {
                paints.push(part.rgb);
                paints.len() - 1
            }
        };
        match part.carrier {
            Carrier::Room => repaint_room(part, paint, level, seed),
            Carrier::Object(_) => shade(part, paint, level, seed),
            Carrier::Link { .. } => {}
        }
    }
}

fn repaint_room(part: &mut Part, paint: usize, level: StressLevel, seed: u32) {
    let mut random = random(StressAxis::Texture, seed, paint);
    let other: [f32; 3] = std::array::from_fn(|_| random.uniform([0.1, 0.95]));
    let share = level.of(NEW_COLOUR);
    part.rgb = std::array::from_fn(|i| part.rgb[i] + (other[i] - part.rgb[i]) * share);
    let (chance, kind) = (random.uniform([0.0, 1.0]), random.uniform([0.0, 3.0]));
    if let Pattern::Checker(second) = &mut part.pattern {
        *second = std::array::from_fn(|i| second[i] + (other[i] * CHECKER_DARK - second[i]) * share);
    }
    if chance < level.of(NEW_PATTERN) {
        part.image = None;
        part.pattern = match kind {
            ..1.0 => Pattern::Wood,
            ..2.0 => Pattern::Fabric,
            _ => Pattern::Checker(part.rgb.map(|value| value * CHECKER_DARK)),
        };
    }
}

fn shade(part: &mut Part, paint: usize, level: StressLevel, seed: u32) {
    let mut random = random(StressAxis::Texture, seed, paint);
    let lighter = if random.uniform([0.0, 1.0]) < 0.5 { -1.0 } else { 1.0 };
    let times = 1.0 + lighter * level.of(OBJECT_SHADE);
    part.rgb = part.rgb.map(|value| (value * times).min(1.0));
}
