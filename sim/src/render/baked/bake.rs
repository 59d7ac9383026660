//! Baking: the lit points of a room, and conversion of their light to image values.

use std::collections::HashMap;

use rapier3d::math::{Pose, Vector};

use super::maps::FlatPatch;
use crate::render::path::irradiance::{Irradiance, irradiance};
use crate::render::path::toned_rgb;
use crate::render::scene::prepared::Prepared;
use crate::render::shading::baked::{
    BakedLight, LightCube, LightMap, LightTexel, PatchLight, Probes, SurfacePoint, cube_light,
};
use crate::render::{Carrier, Light, Scenery};

/// Margin around the walls up to which surfaces have light maps. Beyond it, the light is that at the border.
const MARGIN_M: f32 = 0.5;
/// Side of the cells in which patches without a light map share an ambient cube.
const CELL_M: f32 = 0.08;
/// Share of the lamps' light that moving bodies can shadow.
const SHADOWED_SHARE: f32 = 0.9;
/// Number of corrections of the exposure; each takes the compression of bright tones into account.
const CORRECTIONS: usize = 6;

/// Computes the baked light of a room; the box bounds its walls.
pub(super) fn bake(room: &Scenery, [low_m, high_m]: [Vector; 2]) -> BakedLight {
    let box_m = [low_m - Vector::splat(MARGIN_M), high_m + Vector::splat(MARGIN_M)];
    let prepared = Prepared::new(room.clone());
    let corners = corners(&prepared);
    let mut flat: Vec<Option<FlatPatch>> = patches(&prepared, &corners, box_m);
    let texel_factor = FlatPatch::fit(&mut flat);
    let (mut maps, mut points): (Vec<LightMap>, Vec<SurfacePoint>) = (Vec::new(), Vec::new());
    let patch_map: Vec<Option<u32>> = flat
        .iter()
        .map(|patch| {
            let patch = patch.as_ref()?;
            let map = patch.map(points.len() as u32, texel_factor);
            points.extend(patch.points(&map));
            maps.push(map);
            Some(maps.len() as u32 - 1)
        })
        .collect();
    let mapped = points.len();
    let mut probes = Probes::over([low_m, high_m]);
    points.extend(probes.points());
    let found = irradiance(room.clone(), &points);
    let exposed = RoomExposure::of(&room.light, &points[..mapped], &found[..mapped]);
    let texel = |light: &Irradiance| (!light.is_inside).then(|| exposed.texel(light));
    let mut texels: Vec<Option<LightTexel>> = found[..mapped].iter().map(texel).collect();
    maps.iter().for_each(|map| finish(map, &mut texels));
    let cube = |sides: &[Irradiance]| -> Option<LightCube> {
        let sides: Vec<LightTexel> = sides.iter().filter_map(texel).collect();
        sides.try_into().ok()
    };
    probes.set(found[mapped..].chunks_exact(6).map(cube).collect());
    let (mut cells, mut cubes) = (HashMap::new(), Vec::new());
    let middles_m = middles_m(&prepared, &corners);
    let patches = patch_map.iter().zip(middles_m).map(|(map, middle_m)| match map {
        Some(map) => PatchLight::Map(*map),
        None => {
            let cell = (middle_m / CELL_M).round();
            PatchLight::Cube(*cells.entry(cell.to_array().map(|i| i as i32)).or_insert_with(|| {
                cubes.push(probes.cube(cell * CELL_M));
                cubes.len() as u32 - 1
            }))
        }
    });
    let patches = patches.collect();
    // A map that is completely inside an object has no light of its own, but an edge of it may be visible.
    let texels = texels.into_iter().zip(&points).map(|(texel, point)| {
        texel.unwrap_or_else(|| cube_light(&probes.cube(point.point_m), point.normal.to_array()))
    });
    let texels = texels.collect();
    BakedLight { patches, maps, texels, cubes, probes }
}

/// Returns the flat patches of a room, by patch index; `None` for patches without a light map.
fn patches(prepared: &Prepared, corners: &[Vec<Vector>], box_m: [Vector; 2]) -> Vec<Option<FlatPatch>> {
    let patches = prepared.patches.iter().zip(corners).map(|(patch, corners_m)| {
        let part = &prepared.scenery.parts[patch.part as usize];
        // Reliefs need light from several directions.
        let is_even = part.image.as_ref().is_none_or(|image| image.relief.is_none());
        (patch.bend.slope_1_m.is_none() && is_even)
            .then(|| FlatPatch::of(corners_m, patch.bend.normal.normalize(), part.carrier_from_mesh, box_m))
            .flatten()
    });
    patches.collect()
}

/// Returns the corners of each patch's triangles, in the mesh's frame.
fn corners(prepared: &Prepared) -> Vec<Vec<Vector>> {
    let mut corners = vec![Vec::new(); prepared.patches.len()];
    for (number, part) in prepared.scenery.parts.iter().enumerate() {
        for (triangle, patch) in part.mesh.triangles.iter().zip(prepared.patches_of(number)) {
            let places_m = triangle.map(|corner| part.mesh.vertices[corner as usize].position_m);
            corners[*patch as usize].extend(places_m);
        }
    }
    corners
}

/// Returns the centre of each patch in the world.
fn middles_m(prepared: &Prepared, corners: &[Vec<Vector>]) -> Vec<Vector> {
    let patches = prepared.patches.iter().zip(corners).map(|(patch, corners_m)| {
        let part = &prepared.scenery.parts[patch.part as usize];
        debug_assert_eq!(part.carrier, Carrier::Room);
        let pose: Pose = part.carrier_from_mesh;
        pose * (corners_m.iter().sum::<Vector>() / corners_m.len().max(1) as f32)
    });
    patches.collect()
}

/// Fills the texels of a map that are inside an object from adjacent texels, and smooths noise.
fn finish(map: &LightMap, texels: &mut [Option<LightTexel>]) {
    let (width, height, first) = (map.width as usize, map.height as usize, map.first as usize);
    let texels = &mut texels[first..first + width * height];
    let around = |number: usize| {
        let (column, row) = (number % width, number / width);
        let rows = row.saturating_sub(1)..(row + 2).min(height);
        rows.flat_map(move |row| {
            (column.saturating_sub(1)..(column + 2).min(width)).map(move |column| row * width + column)
        })
    };
    let mean = |before: &[Option<LightTexel>], number: usize| {
        let (mut sum, mut weights) = ([0.0; 4], 0.0);
        for beside in around(number) {
            let Some(light) = before[beside] else { continue };
            let weight = if beside == number {
                4.0
            } else if beside % width == number % width || beside / width == number / width {
                2.0
            } else {
                1.0
            };
            weights += weight;
            sum.iter_mut().zip(light).for_each(|(sum, value)| *sum += weight * value);
        }
        (weights > 0.0).then(|| sum.map(|value| value / weights))
    };
    let before = texels.to_vec();
    for (number, texel) in texels.iter_mut().enumerate().filter(|(_, texel)| texel.is_some()) {
        *texel = mean(&before, number);
    }
    while texels.contains(&None) && texels.iter().any(Option::is_some) {
        let before = texels.to_vec();
        for (number, texel) in texels.iter_mut().enumerate().filter(|(_, texel)| texel.is_none()) {
            *texel = mean(&before, number);
        }
    }
}

/// Exposure that converts light to image values. Rooms are about as bright as without baked light.
struct RoomExposure {
    factor: f32,
}

impl RoomExposure {
    fn of(light: &Light, points: &[SurfacePoint], found: &[Irradiance]) -> RoomExposure {
        let lit = || points.iter().zip(found).filter(|(_, light)| !light.is_inside);
        let wanted: f32 = lit().map(|(point, _)| plain_rgb(light, point.normal).element_sum()).sum();
        let mut exposure = RoomExposure { factor: 1.0 };
        for _ in 0..CORRECTIONS {
            let drawn: f32 = lit().map(|(_, light)| exposure.rgb(light).element_sum()).sum();
            if drawn > 0.0 {
                exposure.factor *= wanted / drawn;
            }
        }
        exposure
    }

    fn rgb(&self, light: &Irradiance) -> Vector {
        toned_rgb((light.of_lamps_rgb + light.reflected_rgb) * self.factor)
    }

    fn texel(&self, light: &Irradiance) -> LightTexel {
        let sum = (light.of_lamps_rgb + light.reflected_rgb).element_sum();
        let Vector { x, y, z } = self.rgb(light);
        [x, y, z, SHADOWED_SHARE * light.of_lamps_rgb.element_sum() / sum.max(f32::MIN_POSITIVE)]
    }
}

/// Returns the light of sun and sky on a surface without baking. The surface is mostly in the sun.
fn plain_rgb(light: &Light, normal: Vector) -> Vector {
    const SUNLIT_SHARE: f32 = 0.92;
    const HEADLIGHT: f32 = 0.09;
    let Light { sun_rgb, sun_direction, below_rgb, above_rgb } = *light;
    let sky_rgb = below_rgb + (above_rgb - below_rgb) * (normal.z * 0.5 + 0.5);
    let sun_share = normal.dot(sun_direction).max(0.0) * SUNLIT_SHARE;
    sky_rgb + sun_rgb * sun_share + Vector::splat(HEADLIGHT)
}
