//! Baked light on pushed points.

use super::shade::{Strip, Surfaces};
use crate::render::baked::{LightCube, LightMap, LightTexel, SURE_SLOPE, SheetLight, cube_light, map_light};
use crate::render::scene::prepared::Prepared;
use crate::render::shading::lanes::{Affine, Lanes, axes, lanes};
use crate::render::{Carrier, PlacedScenery};

/// Source of a strip's light.
#[derive(Clone, Copy)]
pub(super) enum StripLight<'a> {
    /// Sun and sky, or lamps of a file.
    Plain,
    Map {
        map: &'a LightMap,
        from_world: Affine,
        texels: &'a [LightTexel],
    },
    Cube(&'a LightCube),
}

impl<'a> StripLight<'a> {
    /// Returns the light of a sheet; `cubes` are those of the parts.
    #[inline(always)]
    pub(super) fn of(prepared: &'a Prepared, cubes: &'a [LightCube], sheet: u32) -> StripLight<'a> {
        let Some(baked) = &prepared.baked else { return StripLight::Plain };
        match baked.sheets.get(sheet as usize) {
            Some(SheetLight::Map(number)) => {
                let map = &baked.maps[*number as usize];
                StripLight::Map { map, from_world: map.from_world(), texels: &baked.texels }
            }
            Some(SheetLight::Cube(number)) => StripLight::Cube(&baked.cubes[*number as usize]),
            None => StripLight::Cube(&cubes[prepared.sheets[sheet as usize].part as usize]),
        }
    }
}

/// Updates the light on each part that moves, from the state `before` to another.
pub(super) fn place_cubes(
    cubes: &mut Vec<LightCube>,
    prepared: &Prepared,
    placed: &PlacedScenery,
    before: &PlacedScenery,
) {
    let Some(baked) = &prepared.baked else { return };
    cubes.resize(prepared.scenery.parts.len(), LightCube::default());
    for (number, (part, cube)) in prepared.scenery.parts.iter().zip(cubes).enumerate() {
        let pose = placed.world_from_mesh[number];
        if part.carrier != Carrier::Room && before.world_from_mesh.get(number) != Some(&pose) {
            *cube = baked.cube(pose * prepared.geometry(number).bounds.0);
        }
    }
}

impl Surfaces {
    /// Sets the baked light of points that have places and normals.
    #[inline(always)]
    pub(super) fn set_baked<const N: usize>(&mut self, at: usize, strip: &Strip, point_m: &[Lanes<N>; 3]) {
        let lit: [LightTexel; N] = match strip.light {
            StripLight::Plain => return,
            StripLight::Map { map, from_world, texels } => {
                let [u, v, _] = from_world.map_lanes(point_m);
                std::array::from_fn(
                    #[inline(always)]
                    |i| map_light(map, texels, [u[i], v[i]]),
                )
            }
            StripLight::Cube(cube) => {
                let (normal, ray): ([Lanes<N>; 3], [Lanes<N>; 3]) = (self.normal.read(at), self.ray.read(at));
                let outwards: Lanes<N> = lanes(|i| {
                    let (mut squared, mut towards) = (0.0, 0.0);
                    for axis in 0..3 {
                        squared += normal[axis][i] * normal[axis][i];
                        towards -= normal[axis][i] * ray[axis][i];
                    }
                    (1.0 / f32::sqrt(squared)).copysign(towards)
                });
                std::array::from_fn(
                    #[inline(always)]
                    |i| cube_light(cube, axes(|axis| normal[axis][i] * outwards[i])),
                )
            }
        };
        self.baked.set::<N>(at, axes(|axis| lanes(|i| lit[i][axis])));
        self.set_lamp_share::<N>(at, lanes(|i| lit[i][3]));
    }

    /// Returns the light on points, weighted by their shares. `tint` multiplies the baked light.
    #[inline(always)]
    pub(super) fn lit_by_baked(&self, at: usize, tint: [f32; 3]) -> [Lanes; 3] {
        let (albedo, baked) = (self.albedo.block(at), self.baked.block(at));
        let [facing, sunlit, highlight, lamps] = self.towards_sun(at);
        let share = self.shares(at);
        let lamp: Lanes = lanes(|i| {
            let shadow = (1.0 - sunlit[i]) * (facing[i] * (1.0 / SURE_SLOPE)).clamp(0.0, 1.0);
            lamps[i] * shadow
        });
        let gloss: Lanes = lanes(|i| highlight[i] * facing[i].max(0.0) * sunlit[i] * lamps[i]);
        axes(
            #[inline(always)]
            |axis| {
                lanes(|i| {
                    let light = baked[axis][i] * (1.0 - lamp[i]);
                    (albedo[axis][i] * light + gloss[i]) * tint[axis] * share[i]
                })
            },
        )
    }
}
