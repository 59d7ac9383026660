//! Resolution of samples to pixels: colour where a camera's rays meet triangles, and outlines between bodies.

use std::ops::Range;

use super::contact::ContactMap;
use super::lamps::LitLamps;
use super::raster::Rays;
use super::shade::{Facet, Strip, StripLight, Surfaces};
use super::shadow::ShadowMap;
use super::target::RenderTarget;
use super::veil::Veils;
use crate::render::scene::prepared::{NOTHING, Prepared};
use crate::render::shading::baked::LightCube;
use crate::render::shading::srgb::SrgbTable;
use crate::render::shading::{OUTLINE, OUTLINE_DEPTH_STEP, SAMPLES, SKY};

/// Number of pixels that are tested together.
const TOGETHER: usize = size_of::<u64>();
const PER_PIXEL: usize = SAMPLES * SAMPLES;

/// Patch indices or ids of a pixel's samples, and of the samples to the right and below.
type Neighbours = [[u32; SAMPLES + 1]; SAMPLES + 1];

/// A filled target, ready to be shaded.
pub(super) struct View<'a> {
    pub prepared: &'a Prepared,
    /// The facet of each patch.
    pub facets: &'a [Facet],
    /// Ambient cube of each moving part.
    pub cubes: &'a [LightCube],
    pub target: &'a mut RenderTarget,
    pub veils: &'a Veils,
    pub shadow: &'a ShadowMap,
    /// Lamps in place of the sun.
    pub lamps: Option<&'a LitLamps>,
    pub contact: &'a ContactMap,
    pub rays: Rays,
}

/// Buffers for a row of pixels, reused from image to image.
pub(super) struct Row {
    pub surfaces: Surfaces,
    /// For each column of samples, non-zero if an edge is in it or to its right.
    edges: Vec<u32>,
    /// For each pixel, 1 if an edge is in it or beside it, otherwise 0. After the last pixel follow
    /// [`TOGETHER`] entries of 1.
    mixed: Vec<u8>,
    /// Sums of the pixels' linear colours so far: all red values, all green, all blue.
    pub sum_rgb: [Vec<f32>; 3],
    /// The same for one layer of blended surfaces, and the shares of light that they block.
    pub veil_rgb: [Vec<f32>; 3],
    pub veil_alpha: Vec<f32>,
}

impl View<'_> {
    /// Returns the image, three bytes a pixel.
    #[inline(always)]
    pub(super) fn rgb(&mut self, row: &mut Row, srgb: &SrgbTable) -> Vec<u8> {
        let (width, height) = (self.target.width() / SAMPLES, self.target.height() / SAMPLES);
        let mut rgb = vec![0; width * height * 3];
        let mut finished = 0;
        for (y, bytes) in rgb.chunks_exact_mut(width * 3).enumerate() {
            // Pixels are compared with the samples below them.
            let seen = ((y + 1) * SAMPLES + 1).min(self.target.height());
            for row in std::mem::replace(&mut finished, seen)..seen {
                self.target.finish_row(row);
            }
            for sum in &mut row.sum_rgb {
                sum.clear();
                sum.resize(width, 0.0);
            }
            self.row(y, width, row);
            self.blend_veils(y, width, row);
            srgb.encode(&row.sum_rgb, bytes);
        }
        rgb
    }

    /// Computes the colours of a row of pixels, which are the means of their samples. A patch that covers
    /// several samples is shaded once.
    #[inline(always)]
    fn row(&self, y: usize, width: usize, row: &mut Row) {
        let last = self.target.height() - 1;
        let rows: [&[u32]; SAMPLES + 1] =
            std::array::from_fn(|i| self.target.patches((y * SAMPLES + i).min(last)));
        mark_edges(rows, &mut row.edges);
        row.mixed.resize(width, 0);
        for (mixed, [left, right]) in row.mixed.iter_mut().zip(row.edges.as_chunks::<SAMPLES>().0) {
            *mixed = u8::from(left | right != 0);
        }
        row.mixed.resize(width + TOGETHER, 1);
        let mut x = 0;
        while x < width {
            if row.surfaces.room() < PER_PIXEL {
                self.shade(&mut row.surfaces, &mut row.sum_rgb);
            }
            if row.mixed[x] != 0 {
                self.mixed(row, [x, y], rows);
                x += 1;
                continue;
            }
            // Adjacent pixels without an edge show one patch. An edge between two of them would mark the
            // first as mixed.
            let end = next_mixed(&row.mixed, x).min(x + row.surfaces.room());
            self.show(row, x..end, [x * SAMPLES, y * SAMPLES], rows[0][x * SAMPLES], 1.0);
            x = end;
        }
        self.shade(&mut row.surfaces, &mut row.sum_rgb);
    }

    /// Adds the colours of all points of `surfaces`.
    #[inline(always)]
    pub(super) fn shade(&self, surfaces: &mut Surfaces, sum_rgb: &mut [Vec<f32>; 3]) {
        match self.lamps {
            None => {
                let light = &self.prepared.scenery.light;
                surfaces.shade(light, self.prepared.tint(), self.shadow, sum_rgb);
            }
            Some(lamps) => surfaces.shade_by_lamps(lamps, self.rays.back_direction, sum_rgb),
        }
    }

    /// Adds a patch to adjacent pixels that it covers, or covers by a share. `sample` is the sample of the
    /// first pixel.
    #[inline(always)]
    fn show(&self, row: &mut Row, pixels: Range<usize>, sample: [usize; 2], patch: u32, share: f32) {
        if let (NOTHING, Some(sky)) = (patch, &self.prepared.sky) {
            for (across, x) in pixels.enumerate() {
                let (ray, steps) = self.rays.sample([sample[0] + across * SAMPLES, sample[1]]);
                let rgb = sky.sky_rgb(ray, steps) * share;
                row.sum_rgb.iter_mut().zip(rgb.to_array()).for_each(|(sum, value)| sum[x] += value);
            }
            return;
        }
        if patch == NOTHING {
            for (sum, sky) in row.sum_rgb.iter_mut().zip(SKY.to_array()) {
                sum[pixels.clone()].iter_mut().for_each(|sum| *sum += sky * share);
            }
            return;
        }
        let part = self.prepared.patches[patch as usize].part;
        let strip = Strip {
            facet: &self.facets[patch as usize],
            image: self.prepared.images[part as usize].as_ref(),
            sample,
            nearness_1_m: &self.target.nearness_1_m(sample[1])[sample[0]..],
            first_pixel: pixels.start,
            count: pixels.len(),
            share,
            alpha: None,
            light: StripLight::of(self.prepared, self.cubes, patch),
            has_lamps: self.lamps.is_some(),
            has_layers: self.prepared.has_layers,
        };
        row.surfaces.push(&self.rays, self.contact, &strip);
    }

    /// Shades a pixel with an edge in or beside it; `rows` are the rows of its samples and the row below.
    #[inline(always)]
    fn mixed(&self, row: &mut Row, [x, y]: [usize; 2], rows: [&[u32]; SAMPLES + 1]) {
        let sx = x * SAMPLES;
        // At the border of the image the last samples are their own neighbours.
        let columns = [sx, sx + 1, (sx + SAMPLES).min(self.target.width() - 1)];
        let seen = [picked(rows[0], columns), picked(rows[1], columns), picked(rows[2], columns)];
        let [above, here, below] = &seen;
        let ids = [self.ids(above), self.ids(here), self.ids(below)];
        let one_thing = ids.as_flattened().iter().all(|id| *id == ids[0][0]);
        let edges = if one_thing || self.prepared.baked.is_some() {
            0
        } else {
            self.outlines(y, columns, &seen, &ids)
        };
        let share = 1.0 - OUTLINE * (edges as f32 / (2 * SAMPLES) as f32).min(1.0);
        let patches = [seen[0][0], seen[0][1], seen[1][0], seen[1][1]];
        for (i, patch) in patches.iter().enumerate() {
            if !patches[..i].contains(patch) {
                let covered = patches[i..].iter().filter(|other| *other == patch).count();
                let sample = [sx + i % SAMPLES, y * SAMPLES + i / SAMPLES];
                self.show(row, x..x + 1, sample, *patch, share * covered as f32 / PER_PIXEL as f32);
            }
        }
    }

    #[inline(always)]
    fn ids(&self, patches: &[u32; SAMPLES + 1]) -> [u32; SAMPLES + 1] {
        let [a, b, c] = *patches;
        [self.prepared.id(a), self.prepared.id(b), self.prepared.id(c)]
    }

    /// Returns the number of samples in row `y` whose neighbour to the right or below shows another id at
    /// another depth.
    fn outlines(&self, y: usize, columns: [usize; 3], seen: &Neighbours, ids: &Neighbours) -> u32 {
        let last = self.target.height() - 1;
        let two_things = |[r, c]: [usize; 2], [other_r, other_c]: [usize; 2]| {
            ids[r][c] != ids[other_r][other_c] && seen[r][c] != NOTHING && seen[other_r][other_c] != NOTHING
        };
        let nearness_1_m =
            |[r, c]: [usize; 2]| self.target.nearness_1_m((y * SAMPLES + r).min(last))[columns[c]];
        let mut edges = 0;
        // Samples in the last row or column of the image have no outline.
        for r in 0..SAMPLES.min(last - y * SAMPLES) {
            for c in 0..columns[2] - columns[0] {
                for other in [[r, c + 1], [r + 1, c]] {
                    if two_things([r, c], other) {
                        let (a, b) = (nearness_1_m([r, c]), nearness_1_m(other));
                        edges += u32::from((a - b).abs() > OUTLINE_DEPTH_STEP * a.max(b));
                    }
                }
            }
        }
        edges
    }
}

#[inline(always)]
fn picked(row: &[u32], columns: [usize; SAMPLES + 1]) -> [u32; SAMPLES + 1] {
    [row[columns[0]], row[columns[1]], row[columns[2]]]
}

impl Default for Row {
    fn default() -> Row {
        Row {
            surfaces: Surfaces::new(),
            edges: Vec::new(),
            mixed: Vec::new(),
            sum_rgb: Default::default(),
            veil_rgb: Default::default(),
            veil_alpha: Vec::new(),
        }
    }
}

/// Returns the first mixed pixel from `x` on.
#[inline(always)]
fn next_mixed(mixed: &[u8], mut x: usize) -> usize {
    loop {
        let next = u64::from_le_bytes(*mixed[x..].first_chunk().expect("ones are behind the last"));
        x += next.trailing_zeros() as usize / 8;
        if next != 0 {
            return x;
        }
    }
}

/// Finds the columns in which samples show another patch than the sample below or to the right.
#[inline(always)]
fn mark_edges([top, middle, bottom]: [&[u32]; SAMPLES + 1], edges: &mut Vec<u32>) {
    edges.resize(top.len(), 0);
    let last = top.len() - 1;
    // The last sample has no neighbour to the right.
    edges[last] = (top[last] ^ middle[last]) | (middle[last] ^ bottom[last]);
    let [(top, top_right), (middle, middle_right), (bottom, bottom_right)] =
        [top, middle, bottom].map(|row| (&row[..last], &row[1..=last]));
    for (x, edge) in edges[..last].iter_mut().enumerate() {
        let down = (top[x] ^ middle[x]) | (middle[x] ^ bottom[x]);
        let right = (top[x] ^ top_right[x]) | (middle[x] ^ middle_right[x]) | (bottom[x] ^ bottom_right[x]);
        *edge = down | right;
    }
}
