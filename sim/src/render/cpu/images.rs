//! Colours, gloss, normals and emitted light from the layers of images, for points that are shaded together.

use rapier3d::math::Vector;

use super::raster::Rays;
use super::shade::{Facet, Surfaces, block, block_mut, gloss_lanes};
use crate::render::shading::SAMPLES;
use crate::render::shading::image::{Image, ImagePlace, bent_normal};
use crate::render::shading::lanes::{Lanes, axes, lanes};
use crate::render::{Light, Pattern};

/// Surface at several points, without light.
pub(super) struct ShownSurface<const N: usize> {
    /// Linear colours.
    pub albedo: [Lanes<N>; 3],
    /// Linear colours of the image alone; 1 without an image.
    pub texture: [Lanes<N>; 3],
    pub alpha: Lanes<N>,
    /// Normals of any length.
    pub normal: [Lanes<N>; 3],
    /// Emission, specular strength, shininess and metallic share.
    pub gloss: [Lanes<N>; 4],
    /// Shares of ambient light that reach the surface.
    pub ambient: Lanes<N>,
    /// Linear colours of emitted light.
    pub emitted: [Lanes<N>; 3],
}

impl Facet {
    /// Returns normals of any length.
    #[inline(always)]
    pub(super) fn normals<const N: usize>(&self, point_m: &[Lanes<N>; 3]) -> [Lanes<N>; 3] {
        let normal = axes(|axis| [self.normal[axis]; N]);
        let Some(slope_1_m) = &self.slope_1_m else { return normal };
        let (x, y, z) = (slope_1_m.x_axis, slope_1_m.y_axis, slope_1_m.z_axis);
        let [x_m, y_m, z_m] = point_m;
        axes(
            #[inline(always)]
            |axis| lanes(|i| normal[axis][i] + (x[axis] * x_m[i] + y[axis] * y_m[i] + z[axis] * z_m[i])),
        )
    }

    /// Returns the linear colours of the surface, without light.
    #[inline(always)]
    pub(super) fn albedo<const N: usize>(&self, point_m: &[Lanes<N>; 3]) -> [Lanes<N>; 3] {
        let [first, second] = self.linear_rgb;
        if self.pattern == Pattern::Plain {
            return axes(|axis| [first[axis]; N]);
        }
        let share = self.pattern.shares(self.pattern_from_world.map_lanes(point_m));
        axes(
            #[inline(always)]
            |axis| lanes(|i| first[axis] + (second[axis] - first[axis]) * share[i]),
        )
    }

    /// Returns the surface with an image at points whose rays, positions, normals and depths are set.
    #[inline(always)]
    pub(super) fn shown<const N: usize>(
        &self,
        image: &Image,
        rays: &Rays,
        [ray, point_m, normal]: [&[Lanes<N>; 3]; 3],
        depth_m: &Lanes<N>,
    ) -> ShownSurface<N> {
        let at = self.pattern_from_world.map_lanes(point_m);
        let along_ray = self.pattern_from_world.derivatives(ray);
        let facing: Lanes<N> = lanes(|i| {
            let facing = normal[0][i] * ray[0][i] + normal[1][i] * ray[1][i] + normal[2][i] * ray[2][i];
            if facing == 0.0 { f32::INFINITY } else { facing }
        });
        let by = |step: Vector| self.image_step(step, [&along_ray, normal], &facing, depth_m);
        let (x, y) = (by(rays.right_ray * SAMPLES as f32), by(rays.down_ray * SAMPLES as f32));
        let mut shown = ShownSurface {
            albedo: [[0.0; N]; 3],
            texture: [[0.0; N]; 3],
            alpha: [1.0; N],
            normal: *normal,
            gloss: gloss_lanes(self.gloss),
            ambient: [1.0; N],
            emitted: [[0.0; N]; 3],
        };
        for i in 0..N {
            let place = image.place(
                [at[0][i], at[1][i], at[2][i]],
                [x[0][i], x[1][i], x[2][i]],
                [y[0][i], y[1][i], y[2][i]],
            );
            let (rgb, alpha_here) = image.rgb_and_alpha(&place);
            shown.alpha[i] = alpha_here;
            for (axis, value) in rgb.into_iter().enumerate() {
                shown.texture[axis][i] = value;
                shown.albedo[axis][i] = value * self.linear_rgb[0][axis];
            }
            if image.changes_light() || image.relief.is_some() {
                let here = |vectors: &[Lanes<N>; 3]| Vector::new(vectors[0][i], vectors[1][i], vectors[2][i]);
                self.add_layers(&mut shown, i, image, &place, [here(ray), here(normal)]);
            }
        }
        shown
    }

    /// Sets gloss, emitted light and normal at one point of a surface whose image has layers for them.
    fn add_layers<const N: usize>(
        &self,
        shown: &mut ShownSurface<N>,
        i: usize,
        image: &Image,
        place: &ImagePlace,
        [ray, normal]: [Vector; 2],
    ) {
        if let Some(texture) = &image.gloss {
            let gloss = self.gloss.at_texel(image.numbers(texture, place));
            let here: [Lanes<1>; 4] = gloss_lanes(gloss);
            shown.gloss.iter_mut().zip(here).for_each(|(lanes, [value])| lanes[i] = value);
            shown.ambient[i] = gloss.ambient_factor;
        }
        if let Some(rgb) = image.emitted_rgb(place, &self.gloss) {
            shown.gloss[0][i] = 0.0;
            shown.emitted.iter_mut().zip(rgb).for_each(|(lanes, value)| lanes[i] = value);
        }
        if let Some(texture) = &image.relief {
            let towards_eye = normal.normalize_or_zero() * 1f32.copysign(-normal.dot(ray));
            let [(right, _), (down, _), _] = self.pattern_from_world.0;
            let bent = bent_normal(towards_eye, -ray, [right, down], image.numbers(texture, place));
            shown.normal.iter_mut().zip(bent.to_array()).for_each(|(lanes, value)| lanes[i] = value);
        }
    }

    /// Returns the change of the image coordinates from each point to where its ray, turned by `step_ray`,
    /// meets the same plane. `along_ray` has the derivatives of the coordinates along the rays, and `facing`
    /// the scalar products of rays and normals.
    #[inline(always)]
    fn image_step<const N: usize>(
        &self,
        step_ray: Vector,
        [along_ray, normal]: [&[Lanes<N>; 3]; 2],
        facing: &Lanes<N>,
        depth_m: &Lanes<N>,
    ) -> [Lanes<N>; 3] {
        let deeper: Lanes<N> = lanes(|i| {
            (normal[0][i] * step_ray.x + normal[1][i] * step_ray.y + normal[2][i] * step_ray.z) / facing[i]
        });
        axes(
            #[inline(always)]
            |row| {
                let along_step = self.pattern_from_world.0[row].0.dot(step_ray);
                lanes(|i| (along_step - along_ray[row][i] * deeper[i]) * depth_m[i])
            },
        )
    }
}

impl Surfaces {
    #[inline(always)]
    pub(super) fn set_layers<const N: usize>(
        &mut self,
        at: usize,
        ambient: Lanes<N>,
        emitted: [Lanes<N>; 3],
    ) {
        *block_mut(&mut self.ambient_share, at) = ambient;
        self.emitted.set(at, emitted);
    }

    /// Returns the shares of ambient light that reach points, and the linear colours of the light that they
    /// emit.
    #[inline(always)]
    pub(super) fn layers(&self, at: usize) -> (Lanes, [Lanes; 3]) {
        (*block(&self.ambient_share, at), self.emitted.block(at))
    }

    /// Corrects colours that were computed without layers. It adds emitted light, and removes the share of
    /// the ambient light `ambient` that layers block.
    #[inline(always)]
    pub(super) fn add_layers(&self, at: usize, ambient: [Lanes; 3], colours: &mut [Lanes; 3]) {
        let (albedo, (ambient_share, emitted)) = (self.albedo.block(at), self.layers(at));
        let (lit_share, share) = (self.shares(at), block(&self.pixel_share, at));
        for (axis, colour) in colours.iter_mut().enumerate() {
            *colour = lanes(|i| {
                let kept_out = albedo[axis][i] * ambient[axis][i] * (1.0 - ambient_share[i]);
                colour[i] + emitted[axis][i] * share[i] - kept_out * lit_share[i]
            });
        }
    }

    /// Returns the light of the sky on points.
    #[inline(always)]
    pub(super) fn sky_light(&self, at: usize, light: &Light) -> [Lanes; 3] {
        let [_, _, up] = self.normal.block(at);
        axes(
            #[inline(always)]
            |axis| {
                let (below, above) = (light.below_rgb[axis], light.above_rgb[axis]);
                lanes(|i| below + (above - below) * (up[i] * 0.5 + 0.5))
            },
        )
    }
}
