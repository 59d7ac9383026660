//! Edge-preserving filter against the noise of few paths. Each pass averages a pixel with eight others on the
//! same surface, at twice the distance of the previous pass.
//!
//! Source: Dammertz et al. 2010, Edge-avoiding a-trous wavelet transform. Differences of light have no
//! weight here: with few paths they are noise, and pixels that differ from all around them would remain.

use rapier3d::math::Vector;

use super::rows::for_each_row;
use super::scene::{COATED, DIRECT, INDIRECT, LAYERS};
use super::view::SeenSurface;

/// Number of passes for each layer: smoother light gets more. Shadows of lamps have the sharpest edges, and
/// the least noise.
const PASSES: [usize; LAYERS] = {
    let mut passes = [0; LAYERS];
    passes[DIRECT] = 2;
    passes[INDIRECT] = 4;
    passes[COATED] = 3;
    passes
};
/// Weights of a pixel and its neighbours along one axis.
const KERNEL: [f32; 3] = [0.25, 0.5, 0.25];

/// Returns the layers of light at each pixel, averaged over neighbours on the same surface.
pub fn filtered(
    mut light_rgb: Vec<[Vector; LAYERS]>,
    guides: &[SeenSurface],
    width: usize,
    threads: usize,
) -> Vec<[Vector; LAYERS]> {
    let mut averages_rgb = light_rgb.clone();
    for number in 0..PASSES.into_iter().max().unwrap_or(0) {
        let pass = FilterPass { light_rgb: &light_rgb, guides, width, number };
        for_each_row(&mut averages_rgb, width, threads, |row, averages_rgb| {
            for (column, average_rgb) in averages_rgb.iter_mut().enumerate() {
                *average_rgb = pass.average_rgb(row, column);
            }
        });
        std::mem::swap(&mut light_rgb, &mut averages_rgb);
    }
    light_rgb
}

/// One pass over an image.
struct FilterPass<'a> {
    light_rgb: &'a [[Vector; LAYERS]],
    guides: &'a [SeenSurface],
    width: usize,
    number: usize,
}

impl FilterPass<'_> {
    fn average_rgb(&self, row: usize, column: usize) -> [Vector; LAYERS] {
        let here = row * self.width + column;
        let (own_rgb, own) = (self.light_rgb[here], &self.guides[here]);
        if own.id == 0 {
            return own_rgb;
        }
        let own_weight = KERNEL[1] * KERNEL[1];
        let (mut sums_rgb, mut weights) = (own_rgb.map(|rgb| rgb * own_weight), own_weight);
        let [rows, columns] = [(row, self.guides.len() / self.width), (column, self.width)]
            .map(|(at, limit)| self.neighbours(at, limit));
        for (row, down) in rows.into_iter().zip(KERNEL) {
            for (column, right) in columns.into_iter().zip(KERNEL) {
                let (Some(row), Some(column)) = (row, column) else { continue };
                let there = row * self.width + column;
                if there == here {
                    continue;
                }
                let weight = own.likeness(&self.guides[there]) * down * right;
                weights += weight;
                for (sum_rgb, rgb) in sums_rgb.iter_mut().zip(self.light_rgb[there]) {
                    *sum_rgb += rgb * weight;
                }
            }
        }
        std::array::from_fn(|layer| {
            if self.number < PASSES[layer] { sums_rgb[layer] / weights } else { own_rgb[layer] }
        })
    }

    /// Returns a row or column of pixels and its neighbours on both sides, where the image has them.
    fn neighbours(&self, at: usize, limit: usize) -> [Option<usize>; 3] {
        let step = 1 << self.number;
        [at.checked_sub(step), Some(at), Some(at + step).filter(|at| *at < limit)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_on_a_surface_goes_and_the_edge_to_another_stays() {
        const SIDE: usize = 32;
        let place = |number: usize| [number % SIDE, number / SIDE].map(|at| at as f32 * 0.01);
        let guide = |number: usize| {
            let [x, y] = place(number);
            let id = if number % SIDE < SIDE / 2 { 1 } else { 2 };
            SeenSurface {
                id,
                point_m: Vector::new(x, y, 0.0),
                normal: Vector::Z,
                albedo: Vector::ONE,
                ..SeenSurface::default()
            }
        };
        let guides: Vec<SeenSurface> = (0..SIDE * SIDE).map(guide).collect();
        // Every other pixel is dark on the left, and every other one bright on the right.
        let light = |number: usize| {
            let noise = ((number % SIDE + number / SIDE) % 2) as f32;
            [Vector::splat(if guides[number].id == 1 { noise } else { 4.0 + noise }); LAYERS]
        };
        let smooth = filtered((0..SIDE * SIDE).map(light).collect(), &guides, SIDE, 3);
        for (layers_rgb, guide) in smooth.iter().zip(&guides) {
            let expected = if guide.id == 1 { 0.5 } else { 4.5 };
            assert!(layers_rgb.iter().all(|rgb| (rgb.x - expected).abs() < 0.2), "{layers_rgb:?}");
        }
    }
}
