//! Light on the pixels of a moving camera's sensor.

use super::lens::LensMap;
use super::motion::CameraMotion;
use crate::render::Intrinsics;

/// Maximum motion blur per sample, in pixels of the ideal image. Bilinear interpolation covers this distance.
const SAMPLE_PX: f32 = 1.0;
/// Maximum number of samples of a blurred pixel.
const MAX_SAMPLES: i32 = 16;

/// Linear colours of an ideal image, with a fourth number to fill lanes. The last column and row are
/// duplicated, so that every pixel has a neighbour.
pub struct LinearImage {
    width: usize,
    height: usize,
    padded_rgb: Vec<[f32; 4]>,
}

/// Positions of one row of pixels in the ideal image, and their velocities.
pub struct Warp<'a> {
    map: &'a LensMap,
    places_px: [Vec<f32>; 2],
    flow_px_s: [Vec<f32>; 2],
}

impl LinearImage {
    /// Converts an image, three bytes a pixel, by a table of linear light.
    pub fn of(rgb: &[u8], width: usize, height: usize, decoded_values: &[f32; 256]) -> LinearImage {
        let mut padded_rgb = Vec::with_capacity((width + 1) * (height + 1));
        let (pixels, _) = rgb.as_chunks::<3>();
        for row in pixels.chunks_exact(width) {
            padded_rgb.extend(row.iter().map(|&[red, green, blue]| {
                [
                    decoded_values[red as usize],
                    decoded_values[green as usize],
                    decoded_values[blue as usize],
                    0.0,
                ]
            }));
            padded_rgb.extend(padded_rgb.last().copied());
        }
        padded_rgb.extend_from_within(padded_rgb.len() - (width + 1)..);
        LinearImage { width, height, padded_rgb }
    }

    /// Returns the mean over every `every`-th pixel.
    pub fn mean(&self, every: usize) -> [f32; 3] {
        let mut sum = [0.0; 4];
        let metered = || self.padded_rgb.iter().step_by(every);
        for colour in metered() {
            sum = std::array::from_fn(|lane| sum[lane] + colour[lane]);
        }
        std::array::from_fn(|axis| sum[axis] / metered().count() as f32)
    }

    /// Interpolates between pixels. The border's pixels are repeated beyond it.
    #[inline(always)]
    fn read(&self, [x, y]: [f32; 2]) -> [f32; 4] {
        let (x, y) = (x.max(0.0).min((self.width - 1) as f32), y.max(0.0).min((self.height - 1) as f32));
        let (left, above) = (x as i32, y as i32);
        let (right_part, below_part) = (x - left as f32, y - above as f32);
        let first = above as usize * (self.width + 1) + left as usize;
        let blended = |first: usize| -> [f32; 4] {
            let [left, right] = [self.padded_rgb[first], self.padded_rgb[first + 1]];
            std::array::from_fn(|lane| left[lane] + right_part * (right[lane] - left[lane]))
        };
        let (upper, lower) = (blended(first), blended(first + self.width + 1));
        std::array::from_fn(|lane| upper[lane] + below_part * (lower[lane] - upper[lane]))
    }
}

impl<'a> Warp<'a> {
    pub fn new(map: &'a LensMap) -> Warp<'a> {
        let zeros = || vec![0.0; map.lens.width as usize];
        Warp { map, places_px: [zeros(), zeros()], flow_px_s: [zeros(), zeros()] }
    }

    /// Computes the positions of a row's pixels, and their velocities in the image of a moving camera.
    pub fn place_row(&mut self, row: usize, depth_m: &[f32], motion: &CameraMotion) {
        let Intrinsics { width, focal_px, cx, cy, .. } = self.map.lens;
        let pixels = row * width as usize..(row + 1) * width as usize;
        let [xs, ys] = self.map.pixel_ray.each_ref().map(|axis| &axis[pixels.clone()]);
        let nearest = &self.map.nearest[pixels];
        let ([places_x, places_y], [flow_x, flow_y]) = (&mut self.places_px, &mut self.flow_px_s);
        for (column, (x, y)) in xs.iter().zip(ys).enumerate() {
            places_x[column] = focal_px * x + cx;
            places_y[column] = focal_px * y + cy;
        }
        if *motion != CameraMotion::STILL {
            for (column, (x, y)) in xs.iter().zip(ys).enumerate() {
                let flow = motion.flow([*x, *y], 1.0 / depth_m[nearest[column] as usize]);
                flow_x[column] = focal_px * flow[0];
                flow_y[column] = focal_px * flow[1];
            }
        }
    }

    /// Returns the light on a pixel whose exposure takes `time_s`. The middle of the exposure is `late_s`
    /// after the time of the ideal image.
    #[inline(always)]
    pub fn light(&self, ideal: &LinearImage, column: usize, late_s: f32, time_s: f32) -> [f32; 4] {
        let [x, y] = [self.places_px[0][column], self.places_px[1][column]];
        let [dx, dy] = [self.flow_px_s[0][column], self.flow_px_s[1][column]];
        let samples = ((dx.abs().max(dy.abs()) * time_s / SAMPLE_PX) as i32 + 1).min(MAX_SAMPLES);
        if samples == 1 {
            return ideal.read([x + late_s * dx, y + late_s * dy]);
        }
        let share = 1.0 / samples as f32;
        let first_s = late_s + time_s * (0.5 * share - 0.5);
        let [step_x, step_y] = [dx, dy].map(|part| part * time_s * share);
        let [mut x, mut y] = [x + first_s * dx, y + first_s * dy];
        let mut sum = [0.0; 4];
        for _ in 0..samples {
            let read = ideal.read([x, y]);
            sum = std::array::from_fn(|lane| sum[lane] + read[lane]);
            (x, y) = (x + step_x, y + step_y);
        }
        sum.map(|value| value * share)
    }
}
