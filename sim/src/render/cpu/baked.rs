//! Baked light on the points of [`Surfaces`].

use super::shade::{StripLight, Surfaces};
use crate::render::scene::prepared::Prepared;
use crate::render::shading::baked::{LightCube, PatchLight, SURE_SLOPE, map_light};
use crate::render::shading::lanes::{Lanes, axes, lanes};
use crate::render::{Carrier, PlacedScenery};

impl<'a> StripLight<'a> {
    /// Returns the light source of a patch; `cubes` are the ambient cubes of the parts.
    #[inline(always)]
    pub(super) fn of(prepared: &'a Prepared, cubes: &'a [LightCube], patch: u32) -> StripLight<'a> {
        let Some(baked) = &prepared.baked else { return StripLight::Plain };
        match baked.patches.get(patch as usize) {
            Some(PatchLight::Map(number)) => StripLight::Map(&baked.maps[*number as usize], &baked.texels),
            Some(PatchLight::Cube(number)) => StripLight::Cube(&baked.cubes[*number as usize]),
            None => StripLight::Cube(&cubes[prepared.patches[patch as usize].part as usize]),
        }
    }
}

/// Updates the ambient cube of each moving part whose pose differs from the state `before`.
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
    /// Sets the baked light of the first `count` points of a block whose positions and normals are set. Light
    /// maps are only looked up at the first, the last and one point between: texels are much wider than
    /// pixels.
    #[inline(always)]
    pub(super) fn set_baked<const N: usize>(
        &mut self,
        at: usize,
        count: usize,
        light: &StripLight,
        [x_m, y_m, z_m]: &[Lanes<N>; 3],
    ) {
        let lit = match light {
            StripLight::Plain => return,
            StripLight::Map(map, texels) => {
                let (last, half) = (count.min(N) - 1, (count.min(N) - 1).min(N / 2));
                let light = |i: usize| map_light(map, texels, map.place([x_m[i], y_m[i], z_m[i]]));
                let first = light(0);
                let middle = if half == 0 { first } else { light(half) };
                let other = if last == half { middle } else { light(last) };
                let [per_first, per_second] = [half, last - half].map(|steps| 1.0 / steps.max(1) as f32);
                channels(
                    #[inline(always)]
                    |channel| {
                        let [from, over, to] = [first[channel], middle[channel], other[channel]];
                        let [early, late] = [(over - from) * per_first, (to - over) * per_second];
                        lanes(|i| match i.checked_sub(half) {
                            None => from + early * i as f32,
                            Some(beyond) => over + late * beyond as f32,
                        })
                    },
                )
            }
            StripLight::Cube(cube) => {
                let normal = self.outward_normals::<N>(at);
                channels(
                    #[inline(always)]
                    |channel| {
                        let side = |axis: usize, i: usize| {
                            let [ahead, behind] = [cube[2 * axis][channel], cube[2 * axis + 1][channel]];
                            let along = normal[axis][i];
                            along * along * if along < 0.0 { behind } else { ahead }
                        };
                        lanes(|i| side(0, i) + side(1, i) + side(2, i))
                    },
                )
            }
        };
        let [red, green, blue, lamps] = lit;
        self.baked.set::<N>(at, [red, green, blue]);
        self.set_lamp_share::<N>(at, lamps);
    }

    /// Returns the points' unit normals, turned towards the camera.
    #[inline(always)]
    fn outward_normals<const N: usize>(&self, at: usize) -> [Lanes<N>; 3] {
        let (normal, ray): ([Lanes<N>; 3], [Lanes<N>; 3]) = (self.normal.read(at), self.ray.read(at));
        let product = |a: &[Lanes<N>; 3], b: &[Lanes<N>; 3], i: usize| {
            a[0][i] * b[0][i] + a[1][i] * b[1][i] + a[2][i] * b[2][i]
        };
        let outwards: Lanes<N> =
            lanes(|i| (1.0 / product(&normal, &normal, i).sqrt()).copysign(-product(&normal, &ray, i)));
        axes(
            #[inline(always)]
            |axis| lanes(|i| normal[axis][i] * outwards[i]),
        )
    }

    /// Returns the light on points, weighted by their shares. `tint_rgb` multiplies the baked light.
    #[inline(always)]
    pub(super) fn lit_by_baked(&self, at: usize, tint_rgb: [f32; 3]) -> [Lanes; 3] {
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
                    (albedo[axis][i] * light + gloss[i]) * tint_rgb[axis] * share[i]
                })
            },
        )
    }
}

impl Surfaces {
    /// Returns the baked light that does not come from lamps. `tint_rgb` multiplies it.
    #[inline(always)]
    pub(super) fn reflected(&self, at: usize, tint_rgb: [f32; 3]) -> [Lanes; 3] {
        let (baked, [_, _, _, lamps]) = (self.baked.block(at), self.towards_sun(at));
        axes(
            #[inline(always)]
            |axis| lanes(|i| baked[axis][i] * (1.0 - lamps[i]) * tint_rgb[axis]),
        )
    }
}

/// Computes the values of a light's channels.
#[inline(always)]
fn channels<T>(each: impl Fn(usize) -> T) -> [T; 4] {
    [each(0), each(1), each(2), each(3)]
}
