//! Procedural textures: the share of a surface's second colour at a point.

use rapier3d::math::{Matrix, Pose, Vector};

use super::lanes::{Affine, Lanes, lanes};
use crate::mjcf::SurfacePattern;

/// Pattern of a surface between two colours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Pattern {
    #[default]
    Plain,
    /// Squares of half a metre in the world's ground plane; every other square has this colour, sRGB, 0 to 1.
    Checker([f32; 3]),
    /// Grain along the longest side.
    Wood,
    /// A coarse weave.
    Fabric,
    /// Lines of words, one above the other along the mesh's z, for labels and boxes.
    Print,
}

/// Second colour as a share of the first. The contrast is low, so that objects on the surface stand out.
const WOOD_DARK: f32 = 0.70;
const FABRIC_DARK: f32 = 0.75;
const INK_DARK: f32 = 0.45;

pub const CHECKER_PER_M: f32 = 2.0;
/// Numbers of broad bands and of fine lines per metre, and the displacement of a band along the grain.
pub const BANDS_PER_M: f32 = 13.0;
pub const LINES_PER_M: f32 = 41.0;
pub const STRAY: f32 = 0.4;
pub const THREADS_PER_M: f32 = 18.0;
/// Lines of print per metre, and words per metre of a line. The gaps are shares of half a period, and the
/// words of the next line are shifted.
pub const TEXT_PER_M: f32 = 48.0;
pub const TEXT_GAP: f32 = 0.55;
pub const WORDS_PER_M: f32 = 27.0;
pub const WORD_GAP: f32 = 0.3;
pub const WORD_STRAY: f32 = 0.37;

impl Pattern {
    /// Returns the pattern of a material in a file; plain if the file states none.
    pub fn of(stated: Option<SurfacePattern>) -> Pattern {
        match stated {
            Some(SurfacePattern::Wood) => Pattern::Wood,
            Some(SurfacePattern::Fabric) => Pattern::Fabric,
            Some(SurfacePattern::Print) => Pattern::Print,
            // Without two colours there are no tiles.
            Some(SurfacePattern::Tiles) | None => Pattern::Plain,
        }
    }

    /// Returns the second linear colour for a given first one.
    pub(in crate::render) fn second_rgb(self, linear_rgb: Vector) -> Vector {
        match self {
            Pattern::Plain => linear_rgb,
            Pattern::Checker(rgb) => super::linear(rgb),
            Pattern::Wood => linear_rgb * WOOD_DARK,
            Pattern::Fabric => linear_rgb * FABRIC_DARK,
            Pattern::Print => linear_rgb * INK_DARK,
        }
    }

    /// Returns the map from the world to the frame of the pattern. This is the world frame for a checker, and
    /// otherwise the mesh frame with x along the grain.
    pub(in crate::render) fn frame(self, world_from_mesh: Pose, grain: usize) -> Affine {
        if let Pattern::Checker(_) = self {
            return Affine::IDENTITY;
        }
        let axes = Matrix::from_quat(world_from_mesh.rotation);
        let axis = |i: usize| {
            let axis = axes.col((grain + i) % 3);
            (axis, -axis.dot(world_from_mesh.translation))
        };
        Affine([axis(0), axis(1), axis(2)])
    }

    /// Returns the shares of the second colour, from 0 to 1, at several points of [`Pattern::frame`].
    #[inline(always)]
    pub(in crate::render) fn shares<const N: usize>(self, points_m: [Lanes<N>; 3]) -> Lanes<N> {
        match self {
            Pattern::Plain => lanes(|_| 0.0),
            Pattern::Checker(_) => each(&points_m, checker),
            Pattern::Wood => each(&points_m, wood),
            Pattern::Fabric => each(&points_m, fabric),
            Pattern::Print => each(&points_m, print),
        }
    }
}

/// Applies a function to each point. It is fully inlined; otherwise it would not be compiled for wide
/// registers.
#[inline(always)]
fn each<const N: usize>([x_m, y_m, z_m]: &[Lanes<N>; 3], share: impl Fn([f32; 3]) -> f32) -> Lanes<N> {
    lanes(
        #[inline(always)]
        |i| share([x_m[i], y_m[i], z_m[i]]),
    )
}

/// Returns 1 if the sum of two whole numbers is even.
#[inline(always)]
fn checker([x_m, y_m, _]: [f32; 3]) -> f32 {
    let half = 0.5 * (floor(x_m * CHECKER_PER_M) + floor(y_m * CHECKER_PER_M));
    if half == rounded(half) { 1.0 } else { 0.0 }
}

#[inline(always)]
fn wood([x_m, y_m, z_m]: [f32; 3]) -> f32 {
    let across_m = y_m + z_m;
    let band = wave(across_m * BANDS_PER_M + STRAY * wave(x_m * 1.1 + across_m));
    0.7 * band * band + 0.3 * wave(across_m * LINES_PER_M + x_m)
}

#[inline(always)]
fn fabric([x_m, y_m, z_m]: [f32; 3]) -> f32 {
    wave((x_m + z_m) * THREADS_PER_M) * wave((y_m + z_m) * THREADS_PER_M)
}

#[inline(always)]
fn print([x_m, y_m, z_m]: [f32; 3]) -> f32 {
    let line = z_m * TEXT_PER_M;
    let word = wave((x_m + y_m) * WORDS_PER_M + WORD_STRAY * floor(line));
    if wave(line) > TEXT_GAP && word > WORD_GAP { 1.0 } else { 0.0 }
}

/// Returns a triangle wave between 0 and 1 with a period of 1.
#[inline(always)]
fn wave(value: f32) -> f32 {
    1.0 - 2.0 * (value - rounded(value)).abs()
}

#[inline(always)]
fn floor(value: f32) -> f32 {
    rounded(value - 0.5)
}

/// Returns the nearest whole number, for values up to four million. The sum with `NO_PARTS` has no bits left
/// for fractions.
#[inline(always)]
fn rounded(value: f32) -> f32 {
    const NO_PARTS: f32 = (3 << 22) as f32;
    (value + NO_PARTS) - NO_PARTS
}
