//! Definitions that renderers share: the light, the shadow map, outlines, patterns, and arithmetic on several
//! points at once. All colours are linear.

pub mod baked;
pub mod image;
pub mod lamps;
pub mod lanes;
pub mod pattern;
pub mod power;
pub mod srgb;

use rapier3d::math::Vector;

use lanes::Affine;

use crate::srgb::linear_light;

/// Maximum number of blended surfaces behind one another. Further ones are not drawn.
pub const VEILS: usize = 4;
/// Alpha from which surfaces are solid, as in MuJoCo.
pub const SOLID_ALPHA: f32 = 0.995;
/// Alpha up to which surfaces cast no shadow: they let half of the light through.
pub const MAX_CLEAR_ALPHA: f32 = 0.5;
/// Minimum alpha of texels that count as surface in depth and ids.
pub const MIN_SEEN_ALPHA: f32 = 0.5;

/// Samples per pixel along each axis; a power of two, so that dividing by it is exact.
pub const SAMPLES: usize = 2;

/// Light of a scenery, as linear colours: a sun with shadows, and a sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    pub sun_rgb: Vector,
    /// Direction to the sun, a unit vector that does not point straight up.
    pub sun_direction: Vector,
    /// Light of the sky on surfaces that face down.
    pub below_rgb: Vector,
    /// Light of the sky on surfaces that face up.
    pub above_rgb: Vector,
}

impl Default for Light {
    fn default() -> Light {
        Light {
            sun_rgb: Vector::new(0.80, 0.77, 0.72),
            // The sun is high, so that hands over a counter cast their shadows onto the counter.
            sun_direction: Vector::new(-0.306_186_2, 0.353_553_4, 0.883_883_5),
            below_rgb: Vector::new(0.20, 0.19, 0.18),
            above_rgb: Vector::new(0.40, 0.42, 0.45),
        }
    }
}

/// Strength of a faint headlight at the camera.
pub const LAMP: f32 = 0.15;
/// Peak strength of the sun's specular highlight. The exponent of the cosine is 40.
pub const HIGHLIGHT: f32 = 0.15;
/// Background colour.
pub const SKY: Vector = Vector::new(0.45, 0.55, 0.70);

/// Strength of the darkening by an outline between two bodies.
pub const OUTLINE: f32 = 0.45;
/// Minimum relative depth difference for an outline between two bodies: there is none where they touch.
pub const OUTLINE_DEPTH_STEP: f32 = 0.02;

/// Texels along each side of the shadow map: 2.4 mm at a focus of 1.25 m, so that fingers cast shadows.
pub const TEXELS: usize = 1024;
/// Nearness at the focus. Nearness in the shadow map is measured along the direction to the sun, and grows
/// towards the sun.
pub const SUN_DISTANCE_M: f32 = 8.0;
/// Offsets of the lookup point along the surface normal and towards the sun, which prevent self-shadowing.
pub const NORMAL_OFFSET_M: f32 = 0.006;
pub const BIAS_M: f32 = 0.004;

/// Distance from the map's border over which shadows fade out, so that no shadow ends abruptly.
pub const FADE_TEXELS: f32 = 120.0;

/// Texels along each side of the contact map: 1 cm at a focus of 1.25 m.
pub const CONTACT_TEXELS: usize = 256;
/// Strength of contact shadows.
pub const CONTACT: f32 = 0.5;

/// Steps of the table from linear light to sRGB bytes.
pub const SRGB_STEPS: usize = 4096;

/// Returns the offset of the lookup point for a shadow map of this radius: wide maps have large texels.
pub fn normal_offset_m(radius_m: f32) -> f32 {
    const USUAL_RADIUS_M: f32 = 1.25;
    NORMAL_OFFSET_M * (radius_m / USUAL_RADIUS_M).max(1.0)
}

/// Returns the map from points of the world to the shadow map around a focus, for a sun in the direction
/// `sun_direction`: column and row, counted from its corner, and nearness.
pub fn sun_map(sun_direction: Vector, focus_m: Vector, radius_m: f32) -> Affine {
    let half = 0.5 * TEXELS as f32;
    let right = Vector::Z.cross(sun_direction).normalize() * (half / radius_m);
    let down = sun_direction.cross(right) * -1.0;
    let about_focus = |axis: Vector, at_focus: f32| (axis, at_focus - axis.dot(focus_m));
    Affine([about_focus(right, half), about_focus(down, half), about_focus(sun_direction, SUN_DISTANCE_M)])
}

/// Returns the share of light from behind that a surface of this alpha blocks. Blended surfaces count twice,
/// since MuJoCo draws them twice.
#[inline(always)]
pub fn opacity(alpha: f32) -> f32 {
    let clear = 1.0 - alpha;
    1.0 - clear * clear
}

/// Converts sRGB, as used in files, to linear light.
pub fn linear(rgb: [f32; 3]) -> Vector {
    Vector::from(rgb.map(linear_light))
}
