//! Lighting of surfaces by the lights of a file. Source: MuJoCo's `render_gl3.c`, version 3.3, and OpenGL
//! 2.1, section 2.14.1. Like MuJoCo, it multiplies and adds light and colours as file values (sRGB).

use rapier3d::math::{Pose, Vector};

use super::TEXELS;
use super::lanes::Affine;
use super::power::{file_value, linear_value, power};
use crate::mjcf::{FileLight, Gloss, Headlight, LightKind, SHININESS};

/// Maximum angle from a lamp's direction at which it casts shadows.
const MAX_SHADOW_RAD: f32 = 75.0 * std::f32::consts::PI / 180.0;
/// Offsets of the lookup point against self-shadowing: along the normal, in texels of the lamp's map at the
/// point's distance; and towards the lamp, as a share of that distance.
pub const LAMP_NORMAL_TEXELS: f32 = 2.5;
pub const LAMP_BIAS_SHARE: f32 = 0.002;

/// Point of a lit surface.
pub struct LitSurface {
    /// Linear colour.
    pub albedo: Vector,
    /// Linear colour of the image alone, which multiplies all light; 1 without an image.
    pub texture_rgb: Vector,
    /// Linear colour of light from a layer of emission, in addition to the emission of its gloss.
    pub emitted_rgb: Vector,
    pub gloss: Gloss,
    pub point_m: Vector,
    /// Unit vectors: outwards, to the eye, and from the camera's target to the camera.
    pub normal: Vector,
    pub eye_direction: Vector,
    pub back_direction: Vector,
}

/// Returns the direction from a point to a light, its distance (0 for directional lights), and the share of
/// its light that reaches the point without shadows.
#[inline(always)]
pub fn arriving(light: &FileLight, point_m: Vector) -> (Vector, f32, f32) {
    if light.kind == LightKind::Directional {
        return (-light.direction, 0.0, 1.0);
    }
    let towards_m = light.position_m - point_m;
    let distance_m = towards_m.length().max(1e-6);
    let towards = towards_m / distance_m;
    let [constant, linear, square] = light.attenuation_values;
    let fall = 1.0 / (constant + linear * distance_m + square * distance_m * distance_m).max(1e-6);
    if light.kind == LightKind::Point {
        return (towards, distance_m, fall);
    }
    let along = -towards.dot(light.direction);
    let cone = if along < light.cutoff_rad.cos() { 0.0 } else { power(along.max(0.0), light.exponent_value) };
    (towards, distance_m, fall * cone)
}

/// Returns the linear colour of a surface under lights in the world frame. `sunlit` gives the share of each
/// light, by its index, that shadows leave.
pub fn shown_rgb(
    headlight: &Headlight,
    lights: &[FileLight],
    surface: &LitSurface,
    sunlit: impl Fn(usize) -> f32,
) -> Vector {
    let Headlight { ambient_rgb, diffuse_rgb, specular_rgb } = *headlight;
    let shine = |towards: Vector| {
        let half_way = (towards + surface.eye_direction).normalize_or_zero();
        let exponent = surface.gloss.shininess_factor * SHININESS;
        surface.gloss.specular_factor * power(surface.normal.dot(half_way).max(0.0), exponent)
    };
    let facing = surface.normal.dot(surface.back_direction).max(0.0);
    let file_values = |rgb: Vector| Vector::new(file_value(rgb.x), file_value(rgb.y), file_value(rgb.z));
    let (own, most) = (file_values(surface.albedo), file_values(surface.texture_rgb));
    let tint = most + (own - most) * surface.gloss.metallic_factor;
    let limited = |lit: Vector, glossy: Vector| (own * lit + glossy * tint).min(most);
    let ambient_share = surface.gloss.ambient_factor;
    let mut lit =
        Vector::splat(surface.gloss.emission_factor) + ambient_rgb * ambient_share + diffuse_rgb * facing;
    let mut glossy = if facing > 0.0 { specular_rgb * shine(surface.back_direction) } else { Vector::ZERO };
    let mut shown = Vector::ZERO;
    for (number, light) in lights.iter().enumerate() {
        let (towards, _, share) = arriving(light, surface.point_m);
        let share = if share > 0.0 { share * sunlit(number) } else { 0.0 };
        let facing = surface.normal.dot(towards);
        let mut own_lit = light.ambient_rgb * (share * ambient_share);
        let mut own_glossy = Vector::ZERO;
        if facing > 0.0 && share > 0.0 {
            own_lit += light.diffuse_rgb * (share * facing);
            own_glossy = light.specular_rgb * (share * shine(towards));
        }
        // MuJoCo limits the light of each lamp with shadows separately.
        if light.casts_shadow {
            shown += limited(own_lit, own_glossy);
        } else {
            (lit, glossy) = (lit + own_lit, glossy + own_glossy);
        }
    }
    let emitted = file_values(surface.emitted_rgb);
    linear_light((shown + limited(lit, glossy) + emitted).min(Vector::ONE))
}

/// Converts file values (sRGB) to linear light.
pub fn linear_light(rgb: Vector) -> Vector {
    Vector::new(linear_value(rgb.x), linear_value(rgb.y), linear_value(rgb.z))
}

/// Returns the direction to the sun, tilted if it is straight up or down. Shadow maps cannot use a vertical
/// direction.
pub fn tilted(sun_direction: Vector) -> Vector {
    const LEAST: f32 = 1e-3;
    let is_upright = sun_direction.x.abs() < LEAST && sun_direction.y.abs() < LEAST;
    if is_upright { Vector::new(LEAST, 0.0, sun_direction.z).normalize() } else { sun_direction }
}

/// Returns the pose and the field of view of a camera that sees the surfaces lit by a spot or a point light.
pub fn lamp_view(light: &FileLight) -> (Pose, f32) {
    let up = if light.direction.z.abs() > 0.99 { Vector::X } else { Vector::Z };
    let target_m = light.position_m + light.direction;
    let world_from_camera = Pose::look_at_rh(light.position_m, target_m, up).inverse();
    let half_rad = match light.kind {
        LightKind::Spot => light.cutoff_rad.clamp(0.01, MAX_SHADOW_RAD),
        LightKind::Directional | LightKind::Point => MAX_SHADOW_RAD,
    };
    (world_from_camera, 2.0 * half_rad)
}

/// Returns the map from points of the world to a lamp's shadow map: column and row, each times the depth, and
/// depth.
pub fn lamp_map(light: &FileLight) -> Affine {
    let (world_from_camera, field_rad) = lamp_view(light);
    let half = 0.5 * TEXELS as f32;
    let focal = half / (0.5 * field_rad).tan();
    let Affine([x, y, z]) = Affine::of(world_from_camera.inverse());
    let depth = (-z.0, -z.1);
    let row = |(axis, constant): (Vector, f32), factor: f32| {
        (axis * factor + depth.0 * half, constant * factor + depth.1 * half)
    };
    Affine([row(x, focal), row(y, -focal), depth])
}
