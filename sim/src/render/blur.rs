//! Gaussian blur of an image's colours, for example for a lens out of focus.

use super::Camera;

/// Reach of the kernel in standard deviations.
const REACH: f32 = 2.5;

/// Blurs the colours of a camera's image, three bytes a pixel, with a Gaussian along the rows, then
/// along the columns. The border's pixels are repeated beyond it.
pub(super) fn blurred(rgb: Vec<u8>, camera: &Camera) -> Vec<u8> {
    if camera.blur_px <= 0.0 {
        return rgb;
    }
    let kernel = kernel(camera.blur_px);
    let (width, height) = (camera.width as usize, camera.height as usize);
    let sharp: Vec<f32> = rgb.into_iter().map(f32::from).collect();
    let rows = spread(&sharp, &kernel, width, |x, y| (y * width + x) * 3, height);
    let both = spread(&rows, &kernel, height, |y, x| (y * width + x) * 3, width);
    both.into_iter().map(|value| value.round() as u8).collect()
}

/// Returns the kernel's weights from the middle outwards. The whole symmetric kernel sums to 1.
fn kernel(blur_px: f32) -> Vec<f32> {
    let reach = (REACH * blur_px).ceil() as usize;
    let weights: Vec<f32> = (0..=reach).map(|i| (-0.5 * (i as f32 / blur_px).powi(2)).exp()).collect();
    let sum = 2.0 * weights.iter().sum::<f32>() - weights[0];
    weights.into_iter().map(|weight| weight / sum).collect()
}

/// Blurs along `lines` lines of `length` pixels; `at(pixel, line)` is the index of the pixel's red value.
fn spread(
    from_values: &[f32],
    weight_values: &[f32],
    length: usize,
    at: impl Fn(usize, usize) -> usize,
    lines: usize,
) -> Vec<f32> {
    let mut to = vec![0.0; from_values.len()];
    for line in 0..lines {
        for pixel in 0..length {
            for channel in 0..3 {
                let value = |pixel: usize| from_values[at(pixel, line) + channel];
                let mut sum = weight_values[0] * value(pixel);
                for (away, weight) in weight_values.iter().enumerate().skip(1) {
                    sum +=
                        weight * (value(pixel.saturating_sub(away)) + value((pixel + away).min(length - 1)));
                }
                to[at(pixel, line) + channel] = sum;
            }
        }
    }
    to
}

#[cfg(test)]
mod tests {
    use super::*;
    use rapier3d::math::Pose;

    fn camera(blur_px: f32) -> Camera {
        Camera { world_from_camera: Pose::IDENTITY, vertical_fov_rad: 1.0, width: 21, height: 15, blur_px }
    }

    #[test]
    fn a_point_is_spread_as_far_as_is_said_and_what_is_even_stays() {
        let mut point = vec![0; 21 * 15 * 3];
        point[(7 * 21 + 10) * 3] = 255;
        assert_eq!(blurred(point.clone(), &camera(0.0)), point);
        for blur_px in [0.7_f32, 1.5] {
            let seen = blurred(point.clone(), &camera(blur_px));
            // The peak of a two-dimensional Gaussian is 1 / (2 pi sigma^2), up to the discretisation of the
            // pixel grid.
            let middle = f32::from(seen[(7 * 21 + 10) * 3]);
            let expected = 255.0 / (std::f32::consts::TAU * blur_px.powi(2));
            assert!((middle - expected).abs() < 0.15 * expected + 1.0, "{blur_px}: {middle}, not {expected}");
            assert_eq!(seen[(7 * 21 + 9) * 3], seen[(7 * 21 + 11) * 3]);
            assert_eq!(seen[(7 * 21 + 10) * 3 + 1], 0, "green is another colour");
        }
        let even = vec![77; 21 * 15 * 3];
        assert_eq!(blurred(even.clone(), &camera(2.0)), even);
    }
}
