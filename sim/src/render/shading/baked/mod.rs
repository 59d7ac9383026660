//! Lookup of baked light by rasterisers.
//!
//! Flat surfaces of the room have light maps. Everything else is lit by ambient cubes, interpolated in a grid
//! of probes: curved surfaces of the room patch by patch, moving bodies part by part. Moving bodies cast
//! shadows through the rasterisers' shadow map. The share of light that these shadows remove is baked, too.

mod probes;

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

pub use probes::Probes;

/// Minimum cosine to the sun at which shadows have full strength. Shadows of grazing light are uncertain.
pub const SURE_SLOPE: f32 = 0.25;

/// Distance from a surface at which an object blocks half of a lamp's light.
pub const HALF_SHADOW_M: f32 = 0.45;

/// Light at a point: irradiance divided by pi in linear red, green and blue, and the share of it that comes
/// from the lamps. Moving bodies can shadow only this share.
pub type LightTexel = [f32; 4];

/// Ambient cube: light on surfaces that face along +x, -x, +y, -y, +z and -z.
pub type LightCube = [LightTexel; 6];

/// The baked light of a room.
#[derive(Debug, Serialize, Deserialize)]
pub struct BakedLight {
    /// Light of each patch of the room, by the patches' indices.
    pub patches: Vec<PatchLight>,
    pub maps: Vec<LightMap>,
    /// Texels of all maps, map by map and row by row.
    pub texels: Vec<LightTexel>,
    /// Ambient cubes of the room's surfaces without a map.
    pub cubes: Vec<LightCube>,
    pub probes: Probes,
}

/// Light map of a flat patch. Its texels are a range of all texels.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LightMap {
    /// Map from the world to column and row: each is a scalar product plus a constant. The centre of the
    /// first texel is at (0, 0).
    pub axes_values: [[f32; 4]; 2],
    /// Index of the first texel.
    pub first: u32,
    /// Number of texels along each side, at least 2.
    pub width: u32,
    pub height: u32,
}

/// A point of a surface, in the world.
#[derive(Clone, Copy)]
pub struct SurfacePoint {
    pub point_m: Vector,
    /// Unit vector.
    pub normal: Vector,
    /// Grid position of the point, for its random numbers. The numbers of neighbours complement each other.
    pub seed: [u32; 2],
}

/// Source of the light of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PatchLight {
    /// Index of its light map.
    Map(u32),
    /// Index of its ambient cube.
    Cube(u32),
}

impl BakedLight {
    /// Returns true if all indices and sizes are valid.
    pub fn is_whole(&self) -> bool {
        let is_map = |map: &LightMap| {
            let end = u64::from(map.first) + u64::from(map.width) * u64::from(map.height);
            map.width >= 2 && map.height >= 2 && end <= self.texels.len() as u64
        };
        let is_lit = |patch: &PatchLight| match patch {
            PatchLight::Map(number) => (*number as usize) < self.maps.len(),
            PatchLight::Cube(number) => (*number as usize) < self.cubes.len(),
        };
        self.maps.iter().all(is_map) && self.patches.iter().all(is_lit) && self.probes.are_whole()
    }

    /// Returns the ambient cube at a point in the room.
    pub fn cube(&self, point_m: Vector) -> LightCube {
        self.probes.cube(point_m)
    }
}

impl LightMap {
    /// Returns the column and the row of a point of the world, in texels from the centre of the first texel.
    #[inline(always)]
    pub fn place(&self, [x_m, y_m, z_m]: [f32; 3]) -> [f32; 2] {
        self.axes_values.map(
            #[inline(always)]
            |[x, y, z, constant]| x * x_m + y * y_m + z * z_m + constant,
        )
    }
}

/// Returns the light on a surface with this normal.
/// Source: McTaggart 2004, Half-Life 2 / Valve Source shading, ambient cubes.
#[inline(always)]
pub fn cube_light(cube: &LightCube, normal: [f32; 3]) -> LightTexel {
    let mut light = [0.0; 4];
    for (axis, along) in normal.into_iter().enumerate() {
        let side = &cube[2 * axis + usize::from(along < 0.0)];
        for (light, side) in light.iter_mut().zip(side) {
            *light += along * along * side;
        }
    }
    light
}

/// Returns the share of a lamp's light that moving bodies block. `blocked_share` is the share of the sun that
/// they would block, and `blocked_m` is this share times their distance. Lamps are wide, so distant bodies
/// cast faint shadows.
#[inline(always)]
pub fn lamp_shadow(blocked_share: f32, blocked_m: f32) -> f32 {
    if blocked_share <= 0.0 {
        return 0.0;
    }
    let ratio = blocked_m / (blocked_share * HALF_SHADOW_M);
    blocked_share / (1.0 + ratio * ratio)
}

/// Returns the light at a position on a map, in texels from the centre of the first texel.
#[inline(always)]
pub fn map_light(map: &LightMap, texels: &[LightTexel], [u, v]: [f32; 2]) -> LightTexel {
    let (width, height) = (map.width as usize, map.height as usize);
    let (u, v) = (u.clamp(0.0, (width - 1) as f32), v.clamp(0.0, (height - 1) as f32));
    let (column, row) = (usize::from(u as u16).min(width - 2), usize::from(v as u16).min(height - 2));
    let (right, down) = (u - column as f32, v - row as f32);
    let first = map.first as usize + row * width + column;
    let [upper, lower] = [first, first + width].map(|first| {
        let beside: &[LightTexel; 2] = texels[first..].first_chunk().expect("a map has two columns and rows");
        beside
    });
    std::array::from_fn(|i| {
        let above = upper[0][i] + (upper[1][i] - upper[0][i]) * right;
        let below = lower[0][i] + (lower[1][i] - lower[0][i]) * right;
        above + (below - above) * down
    })
}
