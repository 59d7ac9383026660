//! Source of the shaders: the constants that renderers share, then the files of `shaders/`.

use rapier3d::math::Vector;

use crate::mjcf::{MAX_LIGHTS, MIN_ROUGHNESS, SHININESS, USUAL_EXPONENT};
use crate::render::Light;
use crate::render::cpu::contact::SINK_M;
use crate::render::scene::camera::NEAR_M;
use crate::render::scene::prepared::NOTHING;
use crate::render::shading::baked::{HALF_SHADOW_M, SURE_SLOPE};
use crate::render::shading::image::{BLENDED_SHARE, MIN_UPRIGHT_SHARE};
use crate::render::shading::lamps::{LAMP_BIAS_SHARE, LAMP_NORMAL_TEXELS};
use crate::render::shading::pattern::{
    BANDS_PER_M, CHECKER_PER_M, LINES_PER_M, STRAY, TEXT_GAP, TEXT_PER_M, THREADS_PER_M, WORD_GAP,
    WORD_STRAY, WORDS_PER_M,
};
use crate::render::shading::{
    BIAS_M, CONTACT, CONTACT_TEXELS, FADE_TEXELS, HIGHLIGHT, LAMP, MIN_SEEN_ALPHA, OUTLINE,
    OUTLINE_DEPTH_STEP, SKY, SRGB_STEPS, SUN_DISTANCE_M, TEXELS,
};

/// Shader sources after the constants.
const SHADERS: [&str; 5] = [
    include_str!("shaders/picture.wgsl"),
    include_str!("shaders/shadows.wgsl"),
    include_str!("shaders/surfaces.wgsl"),
    include_str!("shaders/lamps.wgsl"),
    include_str!("shaders/baked.wgsl"),
];

pub(super) fn text() -> String {
    let numbers = [
        ("NEAR_M", NEAR_M),
        ("BIAS_M", BIAS_M),
        ("SUN_DISTANCE_M", SUN_DISTANCE_M),
        ("TEXELS", TEXELS as f32),
        ("LAMP", LAMP),
        ("CONTACT", CONTACT),
        ("HIGHLIGHT", HIGHLIGHT),
        ("CHECKER_PER_M", CHECKER_PER_M),
        ("BANDS_PER_M", BANDS_PER_M),
        ("LINES_PER_M", LINES_PER_M),
        ("STRAY", STRAY),
        ("THREADS_PER_M", THREADS_PER_M),
        ("TEXT_PER_M", TEXT_PER_M),
        ("TEXT_GAP", TEXT_GAP),
        ("WORDS_PER_M", WORDS_PER_M),
        ("WORD_GAP", WORD_GAP),
        ("WORD_STRAY", WORD_STRAY),
        ("FADE_TEXELS", FADE_TEXELS),
        ("OUTLINE", OUTLINE),
        ("OUTLINE_DEPTH_STEP", OUTLINE_DEPTH_STEP),
        ("SRGB_STEPS", SRGB_STEPS as f32),
        ("BLENDED_SHARE", BLENDED_SHARE),
        ("MIN_SEEN_ALPHA", MIN_SEEN_ALPHA),
        ("SHININESS", SHININESS),
        ("MIN_ROUGHNESS", MIN_ROUGHNESS),
        ("USUAL_EXPONENT", USUAL_EXPONENT),
        ("MIN_UPRIGHT_SHARE", MIN_UPRIGHT_SHARE),
        ("LAMP_NORMAL_TEXELS", LAMP_NORMAL_TEXELS),
        ("LAMP_BIAS_SHARE", LAMP_BIAS_SHARE),
        ("SURE_SLOPE", SURE_SLOPE),
        ("HALF_SHADOW_M", HALF_SHADOW_M),
    ];
    let vector = |(name, Vector { x, y, z }): (&str, Vector)| {
        format!("const {name} = vec3f({x:?}f, {y:?}f, {z:?}f);\n")
    };
    let sky = [("SKY", SKY), ("USUAL_SUN", Light::default().sun_rgb)].map(vector).concat();
    let number = |(name, value): (&str, f32)| format!("const {name} = {value:?}f;\n");
    let bits = format!("const NOTHING = {NOTHING}u;\nconst INFINITY_BITS = {}u;\n", f32::INFINITY.to_bits());
    let texels = format!("const CONTACT_TEXELS = {CONTACT_TEXELS}u;\nconst SINK_M = {SINK_M:?}f;\n");
    let lights = format!("const MAX_LIGHTS = {MAX_LIGHTS}u;\n");
    let constants = numbers.map(number).into_iter().chain([sky, bits, texels, lights]);
    constants.chain(SHADERS.map(String::from)).collect()
}
