//! Surfaces in a picture: what is joined to a pixel and looks alike, or the largest of a colour. From the colours and the depth that
//! the policy may see itself; nothing is known of which object a pixel belongs to.

use nalgebra::{Isometry3, Point3};
use tandem_tools_spec::{Color, Surface, SurfaceQuery};

use super::RobotView;
use crate::convert::coarse;

/// Neighbours are of one surface whose depth differs by less: this, and this part of it, for what is seen at a slant.
const STEP_M: f32 = 0.012;
const STEP_PART: f32 = 0.03;
/// Pixels look alike whose colours, by their shares of red and green, differ by less, and of which one is less than so much brighter.
const ALIKE_SHARE: f32 = 0.06;
const BRIGHTER: f32 = 1.8;
/// What is smaller is no surface: edges of things mix colours.
const LEAST_PIXELS: usize = 12;
/// Saturation and value below which a colour is grey or black, and value above which it is white.
const GREY_SATURATION: f32 = 0.25;
const BLACK_VALUE: f32 = 0.2;
const WHITE_VALUE: f32 = 0.75;

/// Finds what `query` asks for, with its points by the pose of the camera (MuJoCo's axes) in some frame.
pub fn find(view: &RobotView, query: &SurfaceQuery, frame_from_camera: &Isometry3<f64>) -> Option<Surface> {
    let pixels = match (query.pixel, query.color) {
        (Some([u, v]), _) => {
            let seed = v as usize * view.picture.width as usize + u as usize;
            let like = rgb(view, seed);
            joined(view, seed, &mut vec![false; view.depth_m.len()], &|pixel| {
                are_alike(like, rgb(view, pixel))
            })
        }
        (None, color) => largest(view, color?),
    };
    (!pixels.is_empty()).then(|| describe(view, &pixels, frame_from_camera))
}

/// The largest surface of a colour.
fn largest(view: &RobotView, color: Color) -> Vec<usize> {
    let mut seen = vec![false; view.depth_m.len()];
    let is_of_it = |pixel: usize| name(rgb(view, pixel)) == color;
    let mut found = Vec::new();
    for seed in 0..view.depth_m.len() {
        if !seen[seed] && is_of_it(seed) {
            let pixels = joined(view, seed, &mut seen, &is_of_it);
            if pixels.len() > found.len().max(LEAST_PIXELS) {
                found = pixels;
            }
        }
    }
    found
}

/// Every pixel that is joined to `seed` by neighbours of about the same depth that `belong`.
fn joined(view: &RobotView, seed: usize, seen: &mut [bool], belong: &dyn Fn(usize) -> bool) -> Vec<usize> {
    if !view.depth_m[seed].is_finite() {
        return Vec::new();
    }
    let width = view.picture.width as usize;
    let (mut found, mut next) = (vec![seed], 0);
    seen[seed] = true;
    while let Some(&pixel) = found.get(next) {
        next += 1;
        let column = pixel % width;
        let beside = [
            (column > 0).then(|| pixel - 1),
            (column + 1 < width).then(|| pixel + 1),
            pixel.checked_sub(width),
            Some(pixel + width).filter(|below| *below < view.depth_m.len()),
        ];
        for other in beside.into_iter().flatten() {
            let [here_m, there_m] = [pixel, other].map(|pixel| view.depth_m[pixel]);
            let step_m = STEP_M + STEP_PART * here_m;
            if !seen[other] && (here_m - there_m).abs() < step_m && belong(other) {
                seen[other] = true;
                found.push(other);
            }
        }
    }
    found
}

fn rgb(view: &RobotView, pixel: usize) -> [f32; 3] {
    std::array::from_fn(|i| f32::from(view.picture.rgb[3 * pixel + i]) / 255.0)
}

/// Whether two colours are those of one material in more and in less light.
fn are_alike(one_rgb: [f32; 3], other_rgb: [f32; 3]) -> bool {
    let sum = |rgb: [f32; 3]| rgb.iter().sum::<f32>() + 0.05;
    let share = |rgb: [f32; 3], i: usize| (rgb[i] + 0.05 / 3.0) / sum(rgb);
    let brighter = (sum(one_rgb) / sum(other_rgb)).max(sum(other_rgb) / sum(one_rgb));
    brighter < BRIGHTER && (0..2).all(|i| (share(one_rgb, i) - share(other_rgb, i)).abs() < ALIKE_SHARE)
}

/// What people call a colour: by hue, saturation and value.
fn name([red, green, blue]: [f32; 3]) -> Color {
    let value = red.max(green).max(blue);
    let range = value - red.min(green).min(blue);
    if value < BLACK_VALUE {
        return Color::Black;
    }
    if range < GREY_SATURATION * value {
        return if value > WHITE_VALUE { Color::White } else { Color::Grey };
    }
    let sixth = if value == red {
        (green - blue) / range
    } else if value == green {
        2.0 + (blue - red) / range
    } else {
        4.0 + (red - green) / range
    };
    match (60.0 * sixth).rem_euclid(360.0) {
        hue if !(18.0..340.0).contains(&hue) => Color::Red,
        hue if hue < 42.0 => Color::Orange,
        hue if hue < 70.0 => Color::Yellow,
        hue if hue < 170.0 => Color::Green,
        hue if hue < 260.0 => Color::Blue,
        _ => Color::Purple,
    }
}

fn describe(view: &RobotView, pixels: &[usize], frame_from_camera: &Isometry3<f64>) -> Surface {
    let (width, height) = (view.picture.width as usize, view.picture.height as usize);
    let place = |pixel: usize| [(pixel % width) as i64, (pixel / width) as i64];
    let point_m = |pixel: usize| -> [f64; 3] {
        let [u, v] = place(pixel).map(|at| at as f32);
        let in_camera_m = view.intrinsics.unproject([u, v], view.depth_m[pixel]).to_array().map(f64::from);
        (frame_from_camera * Point3::from(in_camera_m)).coords.into()
    };
    let (mut from, mut to) = ([i64::MAX; 2], [i64::MIN; 2]);
    let (mut low_m, mut high_m, mut sum_m) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], [0.0; 3]);
    let mut color = [0.0; 3];
    for &pixel in pixels {
        let at = place(pixel);
        for i in 0..2 {
            (from[i], to[i]) = (from[i].min(at[i]), to[i].max(at[i]));
        }
        let at_m = point_m(pixel);
        for i in 0..3 {
            (low_m[i], high_m[i]) = (low_m[i].min(at_m[i]), high_m[i].max(at_m[i]));
            sum_m[i] += at_m[i];
            color[i] += rgb(view, pixel)[i];
        }
    }
    let count = pixels.len() as f64;
    let outline = hull(pixels.iter().map(|pixel| place(*pixel)).collect());
    let corner_m = |[u, v]: [i64; 2]| point_m(v as usize * width + u as usize).map(coarse);
    Surface {
        pixels: pixels.len() as u32,
        from,
        to,
        rgb: color.map(|sum| (255.0 * f64::from(sum) / count).round() as u8),
        centroid_m: sum_m.map(|sum_m| coarse(sum_m / count)),
        extent_m: std::array::from_fn(|i| coarse(high_m[i] - low_m[i])),
        corners_m: corners(&outline).into_iter().map(corner_m).collect(),
        cut_off: from[0] == 0 || from[1] == 0 || to[0] as usize + 1 == width || to[1] as usize + 1 == height,
    }
}

/// Twice the area of a triangle, positive where its corners go round one way.
fn doubled_area(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The convex hull of pixels, by Andrew's monotone chain.
fn hull(mut pixels: Vec<[i64; 2]>) -> Vec<[i64; 2]> {
    pixels.sort_unstable();
    let chain = |pixels: &mut dyn Iterator<Item = &[i64; 2]>| {
        let mut chain: Vec<[i64; 2]> = Vec::new();
        for &pixel in pixels {
            while chain.len() > 1 && doubled_area(chain[chain.len() - 2], chain[chain.len() - 1], pixel) <= 0
            {
                chain.pop();
            }
            chain.push(pixel);
        }
        chain.pop();
        chain
    };
    let lower = chain(&mut pixels.iter());
    let upper = chain(&mut pixels.iter().rev());
    let whole: Vec<_> = lower.into_iter().chain(upper).collect();
    if whole.is_empty() { pixels.into_iter().take(1).collect() } else { whole }
}

/// Those four of a convex outline that span the largest area; all where there are no more.
fn corners(outline: &[[i64; 2]]) -> Vec<[i64; 2]> {
    let count = outline.len();
    if count <= 4 {
        return outline.to_vec();
    }
    let (mut most, mut best) = (-1, [0; 4]);
    for one in 0..count {
        for other in one + 2..count {
            // The farthest from the diagonal on either side of it.
            let farthest = |range: &mut dyn Iterator<Item = usize>| {
                let area = |i: usize| doubled_area(outline[one], outline[other], outline[i % count]).abs();
                range.map(|i| (area(i), i % count)).max().unwrap_or((0, one))
            };
            let (near_area, near) = farthest(&mut (one + 1..other));
            let (far_area, far) = farthest(&mut (other + 1..one + count));
            if near_area + far_area > most {
                (most, best) = (near_area + far_area, [one, near, other, far]);
            }
        }
    }
    best.map(|i| outline[i]).to_vec()
}

#[cfg(test)]
mod tests {
    use tandem_sim::render::{Frame, Intrinsics};

    use super::*;

    const WIDTH: usize = 60;
    const HEIGHT: usize = 40;

    /// A grey wall 2 m off, before it 1 m off a red square that stands on its corner, and a red spot on the wall.
    fn view() -> RobotView {
        let mut rgb = Vec::new();
        let mut depth_m = Vec::new();
        for pixel in 0..WIDTH * HEIGHT {
            let (u, v) = ((pixel % WIDTH) as i64, (pixel / WIDTH) as i64);
            let is_square = (u - 30).abs() + (v - 20).abs() <= 10;
            let is_spot = (2..8).contains(&u) && (2..8).contains(&v);
            rgb.extend(if is_square || is_spot { [200, 30, 30] } else { [120, 120, 120] });
            depth_m.push(if is_square { 1.0 } else { 2.0 });
        }
        let intrinsics =
            Intrinsics { width: WIDTH as u32, height: HEIGHT as u32, focal_px: 50.0, cx: 29.5, cy: 19.5 };
        let (width, height) = (WIDTH as u32, HEIGHT as u32);
        RobotView::new(intrinsics, Frame { width, height, rgb, depth_m, ids: vec![0; WIDTH * HEIGHT] })
    }

    fn found(pixel: Option<[i64; 2]>, color: Option<Color>) -> Option<Surface> {
        find(&view(), &SurfaceQuery { pixel, color }, &Isometry3::identity())
    }

    #[test]
    fn a_surface_is_what_is_joined_and_looks_alike() {
        let square = found(Some([30, 20]), None).unwrap();
        assert_eq!(
            (square.pixels, square.from, square.to, square.rgb),
            (221, [20, 10], [40, 30], [200, 30, 30])
        );
        assert!(!square.cut_off);
        assert_eq!(found(None, Some(Color::Red)), Some(square.clone()), "the larger of two red ones");
        assert!((square.extent_m[0] - 0.4).abs() < 1e-3 && square.extent_m[2].abs() < 1e-3, "{square:?}");
        // Its corners are those of the square on its corner, each 0.2 m from the middle.
        assert_eq!(square.corners_m.len(), 4);
        for corner_m in &square.corners_m {
            let from_middle_m: f64 =
                (0..3).map(|i| (corner_m[i] - square.centroid_m[i]).powi(2)).sum::<f64>().sqrt();
            assert!((from_middle_m - 0.2).abs() < 2e-3, "{square:?}");
        }
        assert_eq!(found(Some([4, 4]), None).unwrap().pixels, 36);
        let wall = found(None, Some(Color::Grey)).unwrap();
        assert!(wall.cut_off && wall.pixels as usize == WIDTH * HEIGHT - 221 - 36, "{wall:?}");
        assert_eq!(found(None, Some(Color::Blue)), None);
    }

    #[test]
    fn colours_have_the_names_that_people_give_them() {
        for (rgb, expected) in [
            ([0.9, 0.1, 0.1], Color::Red),
            ([0.9, 0.5, 0.1], Color::Orange),
            ([0.9, 0.8, 0.1], Color::Yellow),
            ([0.1, 0.6, 0.2], Color::Green),
            ([0.1, 0.3, 0.9], Color::Blue),
            ([0.6, 0.2, 0.8], Color::Purple),
            ([0.95, 0.95, 0.9], Color::White),
            ([0.5, 0.5, 0.5], Color::Grey),
            ([0.1, 0.05, 0.05], Color::Black),
        ] {
            assert_eq!(name(rgb), expected, "{rgb:?}");
        }
    }
}
