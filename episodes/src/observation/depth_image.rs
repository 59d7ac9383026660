//! Depth as a grey image, for policies that read images.

use tandem_sim::render::{PictureError, encode_grey_png};
use tandem_tools_spec::{DepthImage, Png};

use super::RobotView;
use crate::convert::coarse;

/// Fraction of the pixels that may be nearer than white. Without it, a hand before the camera would leave
/// little contrast for the other pixels.
const NEARER_PART: f64 = 0.1;
/// Depth drawn in black if the whole image is at one depth, relative to that depth.
const SINGLE_DEPTH_FACTOR: f64 = 2.0;

/// Returns the depth of a view as a grey image. Brightness is linear in 1 / depth.
pub fn depth_image(robot: &str, view: &RobotView) -> Result<DepthImage, PictureError> {
    let RobotView { picture, depth_m, .. } = view;
    let [white_m, black_m] = range_m(depth_m);
    let (white, black) = (1.0 / white_m, 1.0 / black_m);
    let grey = |depth_m: &f32| {
        let share = (1.0 / f64::from(*depth_m) - black) / (white - black);
        (255.0 * share.clamp(0.0, 1.0)).round() as u8
    };
    let grey: Vec<u8> = depth_m.iter().map(grey).collect();
    let png_base64 = Png(encode_grey_png(picture.width, picture.height, &grey)?);
    Ok(DepthImage { robot: robot.into(), white_m, black_m, png_base64 })
}

/// Returns the depths drawn in white and in black, as the reply states them.
fn range_m(depth_m: &[f32]) -> [f64; 2] {
    let mut seen_m: Vec<f32> = depth_m.iter().copied().filter(|depth_m| depth_m.is_finite()).collect();
    seen_m.sort_by(f32::total_cmp);
    let nearer = (NEARER_PART * seen_m.len() as f64) as usize;
    let at = |index: usize| seen_m.get(index).map_or(1.0, |depth_m| coarse((*depth_m).into()));
    let (white_m, black_m) = (at(nearer), at(seen_m.len().saturating_sub(1)));
    [white_m, if black_m > white_m { black_m } else { SINGLE_DEPTH_FACTOR * white_m }]
}

#[cfg(test)]
mod tests {
    use tandem_sim::render::{Distortion, Frame, Intrinsics};

    use super::*;

    fn grey(depth_m: Vec<f32>) -> (DepthImage, Vec<u8>) {
        let count = depth_m.len();
        let (width, height) = (count as u32, 1);
        let distortion = Distortion::NONE;
        let intrinsics = Intrinsics { width, height, focal_px: 1.0, cx: 0.0, cy: 0.0, distortion };
        let frame = Frame { width, height, rgb: vec![0; 3 * count], depth_m, ids: vec![1; count] };
        let image = depth_image("A", &RobotView::new(intrinsics, frame)).unwrap();
        let read = image::load_from_memory(&image.png_base64.0).unwrap();
        assert_eq!(read.color(), image::ColorType::L8);
        (image, read.into_luma8().into_raw())
    }

    #[test]
    fn brightness_is_linear_in_inverse_depth() {
        let (image, pixels) = grey(vec![0.5, 1.0, 2.0, 4.0, f32::INFINITY]);
        assert_eq!((image.white_m, image.black_m), (0.5, 4.0));
        // 1 / depth is 2, 1, 0.5 and 0.25.
        assert_eq!(pixels, [255, 109, 36, 0, 0]);
        for (grey, depth_m) in pixels.iter().zip([0.5, 1.0, 2.0, 4.0]) {
            let black = 1.0 / image.black_m;
            let told_m = 1.0 / (black + f64::from(*grey) / 255.0 * (1.0 / image.white_m - black));
            assert!((told_m - depth_m).abs() < 0.01 * depth_m, "{told_m} m for {depth_m} m");
        }
    }

    #[test]
    fn what_is_very_near_does_not_darken_the_rest() {
        let (image, pixels) = grey([vec![0.1; 5], vec![1.0; 60], vec![3.0; 35]].concat());
        assert_eq!((image.white_m, image.black_m), (1.0, 3.0));
        assert_eq!((pixels[0], pixels[5], pixels[99]), (255, 255, 0));
    }

    #[test]
    fn a_wall_and_the_open_sky_have_a_range() {
        let (image, pixels) = grey(vec![1.5; 4]);
        assert_eq!((image.white_m, image.black_m, pixels[0]), (1.5, 3.0, 255));
        let (image, pixels) = grey(vec![f32::INFINITY; 4]);
        assert!(image.white_m < image.black_m && pixels == [0; 4], "{image:?}");
    }
}
