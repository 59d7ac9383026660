//! Blended surfaces of an image, in layers: the nearest at each sample, then those behind them.

use pulp::Simd;

use super::raster::Rays;
use super::shade::Facet;
use super::target::{RenderTarget, draw_veils};
use crate::render::scene::prepared::Prepared;
use crate::render::shading::{MIN_SEEN_ALPHA, VEILS};
use crate::render::{Camera, Frame, PlacedScenery};

/// Layers of blended surfaces, the nearest first.
#[derive(Default)]
pub(super) struct Veils {
    layers: Vec<RenderTarget>,
    /// Number of layers with any surface.
    count: usize,
}

impl Veils {
    /// Draws the layers in front of solid surfaces.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &mut self,
        simd: S,
        solid: &RenderTarget,
        prepared: &Prepared,
        placed: &PlacedScenery,
        camera: &Camera,
    ) {
        self.count = 0;
        if !prepared.is_veil.contains(&true) {
            return;
        }
        self.layers.resize_with(VEILS, RenderTarget::default);
        for layer in 0..VEILS {
            let (before, rest) = self.layers.split_at_mut(layer);
            let Some(drawn) = rest.first_mut() else { break };
            if !draw_veils(simd, drawn, solid, before.last(), prepared, placed, camera) {
                break;
            }
            (0..drawn.height()).for_each(|row| drawn.finish_row(row));
            self.count = layer + 1;
        }
    }

    /// Returns the layers with any surface, the farthest first.
    pub(super) fn farthest_first(&self) -> impl Iterator<Item = &RenderTarget> {
        self.layers[..self.count].iter().rev()
    }

    /// Sets depth and ids at pixels where an image with alpha shows a surface. The layers must be those at
    /// the pixels' centres.
    pub(super) fn measure(&self, prepared: &Prepared, facets: &[Facet], rays: &Rays, frame: &mut Frame) {
        let width = frame.width as usize;
        for layer in self.farthest_first() {
            for row in 0..layer.height() {
                let patches = layer.patches(row).iter().zip(layer.nearness_1_m(row));
                for (column, (patch, nearness_1_m)) in patches.enumerate() {
                    let Some(part) = prepared.patches.get(*patch as usize).map(|patch| patch.part as usize)
                    else {
                        continue;
                    };
                    if !prepared.scenery.parts[part].is_cut_out() {
                        continue;
                    }
                    let point_m = rays.point_m([column, row], *nearness_1_m);
                    let alpha = prepared.images[part].as_ref().map_or(1.0, |image| {
                        let at = facets[*patch as usize].pattern_from_world.map(point_m);
                        image.rgb_and_alpha(&image.place(at, [0.0; 3], [0.0; 3])).1
                    });
                    if alpha >= MIN_SEEN_ALPHA {
                        frame.depth_m[row * width + column] = 1.0 / nearness_1_m;
                        frame.ids[row * width + column] = prepared.id(*patch);
                    }
                }
            }
        }
    }
}
