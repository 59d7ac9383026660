//! Preparation of triangles for the rasteriser, eight at a time.

use super::{Outlines, Wide, wide};
use crate::render::shading::lanes::{LANES, Lanes, lanes};

/// Projected triangles that wait for a full batch.
#[derive(Default)]
pub struct TriangleBatch {
    count: usize,
    /// For each corner its image coordinates and its nearness.
    corners: [[Lanes; 3]; 3],
    /// Tag that each triangle is drawn with.
    tags: [u32; LANES],
}

impl TriangleBatch {
    pub fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Adds a triangle; the batch must not be full. Corners are image coordinates and nearness.
    #[inline(always)]
    pub fn push(&mut self, corners: [[f32; 3]; 3], tag: u32) {
        let place = self.count % LANES;
        for (lanes, numbers) in self.corners.iter_mut().zip(corners) {
            for (lanes, number) in lanes.iter_mut().zip(numbers) {
                lanes[place] = number;
            }
        }
        self.tags[place] = tag;
        self.count += 1;
    }

    /// Takes all waiting triangles.
    #[inline(always)]
    pub fn take(&mut self) -> Outlines {
        let corners = self.corners;
        let places = corners.map(|[x, y, _]| [wide(&x), wide(&y)]);
        let [[ax, ay], [bx, by], [cx, cy]] = &places;
        let [an, bn, cn] = corners.map(|[_, _, nearness]| wide(&nearness));
        let minus = |to: &Wide, from: &Wide| -> Wide { lanes(|i| to[i] - from[i]) };
        let (ux, uy, un) = (minus(bx, ax), minus(by, ay), minus(&bn, &an));
        let (vx, vy, vn) = (minus(cx, ax), minus(cy, ay), minus(&cn, &an));
        // Rows count downwards, so a counter-clockwise triangle has a negative area.
        let area: Wide = lanes(|i| ux[i] * vy[i] - uy[i] * vx[i]);
        let per_area: Wide = lanes(|i| 1.0 / area[i]);
        Outlines {
            count: std::mem::take(&mut self.count),
            corners,
            tags: self.tags,
            x_factor: lanes(|i| (un[i] * vy[i] - vn[i] * uy[i]) * per_area[i]),
            y_factor: lanes(|i| (vn[i] * ux[i] - un[i] * vx[i]) * per_area[i]),
            front: lanes(|i| area[i] < 0.0 && area[i] > f64::NEG_INFINITY),
            nearness_value: an,
            places,
        }
    }
}
