//! Light maps: rectangles of texels around the flat patches of a room.

use rapier3d::math::{Pose, Vector};

use crate::render::shading::baked::{LightMap, SurfacePoint};

/// Usual side of a texel; `MAX_SIDE` limits the number of texels along a side of a map.
const TEXEL_M: f32 = 0.08;
/// Maximum number of texels of all maps of a room. Texels grow by the factor `TEXEL_GROWTH` until there are
/// few enough, at most to `MAX_TEXEL_FACTOR` times their usual side.
const MAX_TEXELS: f32 = 50_000.0;
const TEXEL_GROWTH: f32 = 1.1;
const MAX_TEXEL_FACTOR: f32 = 8.0;
const MAX_SIDE: f32 = 160.0;
/// Maximum distance of points from the plane of a flat patch.
const FLAT_M: f32 = 1e-3;

/// A flat patch in the world.
pub(super) struct FlatPatch {
    normal: Vector,
    /// Rectangle around the patch: the directions of its sides, a corner, and the lengths of its sides.
    sides_direction: [Vector; 2],
    corner_m: Vector,
    sides_m: [f32; 2],
}

impl FlatPatch {
    /// Returns the rectangle around some points with a common normal, clipped to a box. Returns `None` if
    /// they are not in one plane.
    pub(super) fn of(
        points_m: &[Vector],
        normal: Vector,
        world_from_mesh: Pose,
        box_m: [Vector; 2],
    ) -> Option<FlatPatch> {
        let height_m = normal.dot(*points_m.first()?);
        if points_m.iter().any(|point_m| (normal.dot(*point_m) - height_m).abs() > FLAT_M) {
            return None;
        }
        // Boxes of a mesh have sides along its axes.
        let least = normal.abs().min_position();
        let mut axis = Vector::ZERO;
        axis[least] = 1.0;
        let across = (axis - normal * normal.dot(axis)).normalize();
        let down = normal.cross(across);
        let rotation = world_from_mesh.rotation;
        let (normal, along) = (rotation * normal, [rotation * across, rotation * down]);
        let mut low_m = [f32::INFINITY; 2];
        let mut high_m = [f32::NEG_INFINITY; 2];
        for point_m in points_m {
            let clipped_m = (world_from_mesh * *point_m).clamp(box_m[0], box_m[1]);
            for (axis, direction) in along.iter().enumerate() {
                low_m[axis] = low_m[axis].min(direction.dot(clipped_m));
                high_m[axis] = high_m[axis].max(direction.dot(clipped_m));
            }
        }
        let height_m = normal.dot(world_from_mesh * points_m[0]);
        let corner_m = normal * height_m + along[0] * low_m[0] + along[1] * low_m[1];
        let sides_m = [high_m[0] - low_m[0], high_m[1] - low_m[1]];
        Some(FlatPatch { normal, sides_direction: along, corner_m, sides_m })
    }

    /// Returns the factor on the usual size of texels at which the maps of a room have few enough texels.
    /// Patches smaller than the growth of a texel become `None`: a mesh may have more triangles than all maps
    /// have texels.
    pub(super) fn fit(patches: &mut [Option<FlatPatch>]) -> f32 {
        let mut texel_factor = 1.0;
        while texels(patches, texel_factor) > MAX_TEXELS && texel_factor < MAX_TEXEL_FACTOR {
            texel_factor *= TEXEL_GROWTH;
            let min_side_m = TEXEL_M * (texel_factor - 1.0);
            for patch in patches.iter_mut() {
                patch.take_if(|patch| patch.sides_m[0].max(patch.sides_m[1]) < min_side_m);
            }
        }
        texel_factor
    }

    /// Returns the map of the patch with texels of about `texel_factor` times the usual size.
    pub(super) fn map(&self, first: u32, texel_factor: f32) -> LightMap {
        let count = |side_m: f32| (side_m / (TEXEL_M * texel_factor)).ceil().clamp(2.0, MAX_SIDE);
        let [width, height] = self.sides_m.map(count);
        let axis = |i: usize, count: f32| {
            let along = self.sides_direction[i] * (count / self.sides_m[i].max(FLAT_M));
            [along.x, along.y, along.z, -along.dot(self.corner_m) - 0.5]
        };
        LightMap {
            axes_values: [axis(0, width), axis(1, height)],
            first,
            width: width as u32,
            height: height as u32,
        }
    }

    /// Returns the centres of the texels, row by row.
    pub(super) fn points(&self, map: &LightMap) -> impl Iterator<Item = SurfacePoint> {
        let middle = |i: u32, count: u32, side: usize| {
            self.sides_direction[side] * ((i as f32 + 0.5) / count as f32 * self.sides_m[side])
        };
        (0..map.height).flat_map(move |row| {
            (0..map.width).map(move |column| SurfacePoint {
                point_m: self.corner_m + middle(column, map.width, 0) + middle(row, map.height, 1),
                normal: self.normal,
                seed: [map.first + column, row],
            })
        })
    }
}

/// Returns the number of texels in the maps of patches.
fn texels(patches: &[Option<FlatPatch>], texel_factor: f32) -> f32 {
    let maps = patches.iter().flatten().map(|patch| patch.map(0, texel_factor));
    maps.map(|map| (map.width * map.height) as f32).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns squares with sides of `side_m`.
    fn squares(count: usize, side_m: f32) -> impl Iterator<Item = Option<FlatPatch>> {
        let corners =
            [Vector::ZERO, Vector::X * side_m, Vector::Y * side_m, Vector::new(side_m, side_m, 0.0)];
        let box_m = [Vector::splat(-100.0), Vector::splat(100.0)];
        (0..count).map(move |_| FlatPatch::of(&corners, Vector::Z, Pose::IDENTITY, box_m))
    }

    fn count(patches: &[Option<FlatPatch>]) -> usize {
        patches.iter().flatten().count()
    }

    #[test]
    fn rooms_with_few_texels_keep_all_maps() {
        let mut room: Vec<_> = squares(6, 4.0).chain(squares(500, 0.02)).collect();
        assert_eq!(FlatPatch::fit(&mut room), 1.0);
        assert_eq!(count(&room), 506);
    }

    #[test]
    fn large_rooms_have_larger_texels_and_small_patches_have_none() {
        let mut large: Vec<_> = squares(24, 10.0).collect();
        let texel_factor = FlatPatch::fit(&mut large);
        assert!(texel_factor > 1.5 && texels(&large, texel_factor) <= MAX_TEXELS, "{texel_factor}");
        assert_eq!(count(&large), 24);

        let mut detailed: Vec<_> = squares(6, 4.0).chain(squares(100_000, 0.02)).collect();
        let texel_factor = FlatPatch::fit(&mut detailed);
        assert!(texels(&detailed, texel_factor) <= MAX_TEXELS);
        assert_eq!(count(&detailed), 6, "walls keep their maps, triangles do not");
    }
}
