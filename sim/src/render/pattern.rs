//! Textures made in code: how much of a surface's second colour there is at a point.

use rapier3d::math::Vector;

/// How a surface varies between two colours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Pattern {
    #[default]
    Plain,
    /// Squares of half a metre in the world's ground plane; every other one has this colour, sRGB, 0 to 1.
    Checker([f32; 3]),
    /// Grain along the longest side.
    Wood,
    /// A coarse weave.
    Fabric,
}

/// Words in names of materials that make them so. The names are those of MJCF files; no scene has to say more.
const WOODS: [&str; 8] = ["wood", "birch", "oak", "walnut", "pine", "beech", "plank", "batten"];
const FABRICS: [&str; 7] = ["fabric", "cloth", "velvet", "curtain", "carpet", "rug", "cushion"];
/// The second colour, as a part of the first: calm enough for what lies on it to stand out.
const WOOD_DARK: f32 = 0.70;
const FABRIC_DARK: f32 = 0.75;

pub(super) const CHECKER_PER_M: f32 = 2.0;
/// Broad bands, fine lines, and how far a band strays along the grain.
pub(super) const BANDS_PER_M: f32 = 13.0;
pub(super) const LINES_PER_M: f32 = 41.0;
pub(super) const STRAY: f32 = 0.4;
pub(super) const THREADS_PER_M: f32 = 18.0;

impl Pattern {
    /// Of a material, by its name.
    pub fn of(material: &str) -> Pattern {
        let has = |words: &[&str]| words.iter().any(|word| material.contains(word));
        match () {
            () if has(&WOODS) => Pattern::Wood,
            () if has(&FABRICS) => Pattern::Fabric,
            () => Pattern::Plain,
        }
    }

    /// Linear; the first colour is given.
    pub(super) fn second_rgb(self, linear_rgb: Vector) -> Vector {
        match self {
            Pattern::Plain => linear_rgb,
            Pattern::Checker(rgb) => super::light::linear(rgb),
            Pattern::Wood => linear_rgb * WOOD_DARK,
            Pattern::Fabric => linear_rgb * FABRIC_DARK,
        }
    }

    /// From 0 to 1, at a point of the world, and in the mesh's frame with x along the grain.
    #[inline(always)]
    pub(super) fn share(self, point_m: Vector, in_mesh_m: impl Fn() -> Vector) -> f32 {
        match self {
            Pattern::Plain => 0.0,
            Pattern::Checker(_) => {
                let [x, y] = [point_m.x, point_m.y].map(|metres| (metres * CHECKER_PER_M).floor() as i32);
                f32::from(u8::from((x + y) & 1 == 0))
            }
            Pattern::Wood => {
                let p = in_mesh_m();
                let across = p.y + p.z;
                let band = wave(across * BANDS_PER_M + STRAY * wave(p.x * 1.1 + across));
                0.7 * band * band + 0.3 * wave(across * LINES_PER_M + p.x)
            }
            Pattern::Fabric => {
                let p = in_mesh_m() * THREADS_PER_M;
                wave(p.x + p.z) * wave(p.y + p.z)
            }
        }
    }
}

/// Up and down between 0 and 1 with a period of 1.
#[inline(always)]
fn wave(value: f32) -> f32 {
    (2.0 * (value - value.floor()) - 1.0).abs()
}
