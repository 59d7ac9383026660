//! From samples to pixels: colour where a camera's rays meet triangles, and outlines between things.

use std::ops::Range;

use rapier3d::math::Vector;

use super::facets::{Facet, Facets};
use super::shade::{Surface, Surfaces};
use super::shadow::ShadowMap;
use super::srgb::SrgbTable;
use super::target::Target;
use crate::render::Camera;
use crate::render::contact::ContactMap;
use crate::render::light::{CONTACT, OUTLINE, OUTLINE_DEPTH_STEP, SAMPLES, SKY};
use crate::render::prepared::{NOTHING, Prepared};

const PER_PIXEL: usize = SAMPLES * SAMPLES;

/// A filled target, ready to be shaded.
pub(super) struct View<'a> {
    prepared: &'a Prepared,
    target: &'a Target,
    shadow: &'a ShadowMap,
    contact: &'a ContactMap,
    eye_m: Vector,
    /// Ray through the target's top left corner, and from one sample to the next, at a depth of 1 m in the world.
    corner_ray: Vector,
    right_ray: Vector,
    down_ray: Vector,
}

/// A row of pixels under way.
struct Row<'a> {
    facets: &'a mut Facets,
    surfaces: Surfaces,
    /// For each surface, the pixel and how much it counts there.
    shares: Vec<(usize, f32)>,
    /// For each column of samples, whether an edge is in it or to its right: some bits are set.
    edges: Vec<u32>,
    /// Linear colours of the pixels, as far as they are known.
    sum_rgb: Vec<Vector>,
}

impl<'a> View<'a> {
    pub(super) fn new(
        prepared: &'a Prepared,
        target: &'a Target,
        shadow: &'a ShadowMap,
        contact: &'a ContactMap,
        camera: &Camera,
    ) -> View<'a> {
        let rotation = camera.world_from_camera.rotation;
        let sample = 1.0 / (camera.focal_px() * SAMPLES as f32);
        View {
            prepared,
            target,
            shadow,
            contact,
            eye_m: camera.world_from_camera.translation,
            corner_ray: rotation * camera.unproject([0.0, 0.0], 1.0),
            right_ray: rotation * Vector::X * sample,
            down_ray: rotation * Vector::NEG_Y * sample,
        }
    }

    /// The picture, three bytes a pixel.
    #[inline(always)]
    pub(super) fn rgb(&self, facets: &mut Facets, srgb: &SrgbTable) -> Vec<u8> {
        let (width, height) = (self.target.width() / SAMPLES, self.target.height() / SAMPLES);
        let mut rgb = Vec::with_capacity(width * height * 3);
        let mut row = Row::new(facets);
        for y in 0..height {
            row.sum_rgb.clear();
            row.sum_rgb.resize(width, Vector::ZERO);
            self.row(y, &mut row);
            rgb.extend(
                row.sum_rgb.iter().flat_map(|colour| colour.to_array()).map(|linear| srgb.encode(linear)),
            );
        }
        rgb
    }

    /// Colours of a row of pixels: means of their samples. A triangle that covers several of them is shaded once.
    #[inline(always)]
    fn row(&self, y: usize, row: &mut Row<'_>) {
        let last = self.target.height() - 1;
        let rows: [&[u32]; SAMPLES + 1] =
            std::array::from_fn(|i| self.target.triangles((y * SAMPLES + i).min(last)));
        mark_edges(rows, &mut row.edges);
        let plain = |edges: &[u32], x: usize| edges[x * SAMPLES] | edges[x * SAMPLES + 1] == 0;
        let mut x = 0;
        while x < row.sum_rgb.len() {
            row.make_room(self.shadow);
            if !plain(&row.edges, x) {
                self.mixed(row, x, y, rows);
                x += 1;
                continue;
            }
            // Of one triangle as far as they are plain: an edge would be in the last of them.
            let most = row.sum_rgb.len().min(x + row.surfaces.room());
            let end = (x + 1..most).find(|x| !plain(&row.edges, *x)).unwrap_or(most);
            self.run(row, x..end, y, rows[0][x * SAMPLES]);
            x = end;
        }
        row.flush(self.shadow);
    }

    /// Neighbouring pixels that one triangle covers.
    #[inline(always)]
    fn run(&self, row: &mut Row<'_>, pixels: Range<usize>, y: usize, triangle: u32) {
        if triangle == NOTHING {
            row.sum_rgb[pixels].fill(SKY);
            return;
        }
        let facet = *row.facets.get(self.prepared, triangle);
        let nearness_1_m = self.target.nearness_1_m(y * SAMPLES);
        for x in pixels {
            let surface =
                self.surface(row.facets, &facet, [x * SAMPLES, y * SAMPLES], nearness_1_m[x * SAMPLES]);
            row.push(surface, x, 1.0);
        }
    }

    /// A pixel with an edge in or beside it, `rows` being those of its samples and the one below.
    #[inline(always)]
    fn mixed(&self, row: &mut Row<'_>, x: usize, y: usize, rows: [&[u32]; SAMPLES + 1]) {
        let sx = x * SAMPLES;
        let at = |i: usize| [sx + i % SAMPLES, y * SAMPLES + i / SAMPLES];
        let triangles: [u32; PER_PIXEL] = std::array::from_fn(|i| rows[i / SAMPLES][sx + i % SAMPLES]);
        let last = (sx + SAMPLES).min(self.target.width() - 1);
        let share = if self.one_thing(rows.map(|row| &row[sx..=last])) {
            1.0
        } else {
            let edges: u32 = (0..PER_PIXEL).map(|i| self.outlines(at(i))).sum();
            1.0 - OUTLINE * (edges as f32 / (2 * SAMPLES) as f32).min(1.0)
        };
        for (i, triangle) in triangles.iter().enumerate() {
            if !triangles[..i].contains(triangle) {
                let covered = triangles[i..].iter().filter(|other| *other == triangle).count();
                let share = share * covered as f32 / PER_PIXEL as f32;
                match *triangle {
                    NOTHING => row.sum_rgb[x] += SKY * share,
                    triangle => {
                        let (_, nearness_1_m) = self.sample(at(i));
                        let facet = *row.facets.get(self.prepared, triangle);
                        let surface = self.surface(row.facets, &facet, at(i), nearness_1_m);
                        row.push(surface, x, share);
                    }
                }
            }
        }
    }

    /// Whether all samples show one thing, so that there is no outline.
    #[inline(always)]
    fn one_thing(&self, rows: [&[u32]; SAMPLES + 1]) -> bool {
        let first = rows[0][0];
        let id = self.prepared.id(first);
        rows.iter().all(|row| row.iter().all(|other| *other == first || self.prepared.id(*other) == id))
    }

    /// How many of the neighbours to the right and below belong to another thing at another depth.
    #[inline(always)]
    fn outlines(&self, [sx, sy]: [usize; 2]) -> u32 {
        if sx + 1 >= self.target.width() || sy + 1 >= self.target.height() {
            return 0;
        }
        let here = self.sample([sx, sy]);
        u32::from(self.differ(here, self.sample([sx + 1, sy])))
            + u32::from(self.differ(here, self.sample([sx, sy + 1])))
    }

    /// Triangle and nearness that a sample shows.
    #[inline(always)]
    fn sample(&self, [sx, sy]: [usize; 2]) -> (u32, f32) {
        (self.target.triangles(sy)[sx], self.target.nearness_1_m(sy)[sx])
    }

    /// Whether two samples show different things at different depths.
    #[inline(always)]
    fn differ(&self, (a, near_a): (u32, f32), (b, near_b): (u32, f32)) -> bool {
        a != b
            && a != NOTHING
            && b != NOTHING
            && (near_a - near_b).abs() > OUTLINE_DEPTH_STEP * near_a.max(near_b)
            && self.prepared.id(a) != self.prepared.id(b)
    }

    /// Where the ray of a sample meets a triangle.
    #[inline(always)]
    fn surface(&self, facets: &Facets, facet: &Facet, [sx, sy]: [usize; 2], nearness_1_m: f32) -> Surface {
        let ray = self.corner_ray + self.right_ray * (sx as f32 + 0.5) + self.down_ray * (sy as f32 + 0.5);
        let point_m = self.eye_m + ray * (1.0 / nearness_1_m);
        let albedo = facets.albedo(self.prepared, facet, point_m);
        let open_share = if facet.carries { 1.0 - CONTACT * self.contact.darkness(point_m) } else { 1.0 };
        Surface { point_m, ray, normal: facet.normal(point_m), albedo, open_share }
    }
}

impl Row<'_> {
    fn new(facets: &mut Facets) -> Row<'_> {
        Row { facets, surfaces: Surfaces::new(), shares: Vec::new(), edges: Vec::new(), sum_rgb: Vec::new() }
    }

    #[inline(always)]
    fn push(&mut self, surface: Surface, pixel: usize, share: f32) {
        self.surfaces.push(surface);
        self.shares.push((pixel, share));
    }

    /// Shades the surfaces that have come together if another pixel's may be too many.
    #[inline(always)]
    fn make_room(&mut self, shadow: &ShadowMap) {
        if self.surfaces.room() < PER_PIXEL {
            self.flush(shadow);
        }
    }

    /// Shades the surfaces that have come together.
    #[inline(always)]
    fn flush(&mut self, shadow: &ShadowMap) {
        for ((pixel, share), colour) in self.shares.drain(..).zip(self.surfaces.shade(shadow)) {
            self.sum_rgb[pixel] += colour * share;
        }
    }
}

/// Finds the columns in which samples show another triangle than the one below or to the right.
#[inline(always)]
fn mark_edges(rows: [&[u32]; SAMPLES + 1], edges: &mut Vec<u32>) {
    let [top, middle, bottom] = rows;
    let count = top.len() - 1;
    let differ = |row: &[u32], i: usize| row[i] ^ row[i + 1];
    edges.clear();
    edges.extend((0..count).map(|i| {
        differ(&top[..=count], i)
            | differ(&middle[..=count], i)
            | differ(&bottom[..=count], i)
            | (top[i] ^ middle[i])
            | (middle[i] ^ bottom[i])
    }));
    edges.push((top[count] ^ middle[count]) | (middle[count] ^ bottom[count]));
}
