//! Surfaces in an image: the connected region of similar colour at a pixel, the object at a pixel, or the
//! nearest surfaces of a colour. They are found from colours and depth that the policy may see itself,
//! without knowledge of the object to which a pixel belongs. Only a query for an object by name uses that
//! knowledge.

mod round;
mod thing;

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Point3, Vector3};
use tandem_tools_spec::{Color, JoinedBy, Surface, SurfaceQuery, UprightAxis};

use super::RobotView;
use crate::convert::coarse;
use thing::Relief;

/// Maximum difference in depth between neighbours of one surface: a distance, and a fraction of the depth
/// for slanted surfaces.
const STEP_M: f32 = 0.012;
const STEP_PART: f32 = 0.03;
/// Maximum difference in the shares of red and green between similar colours, and maximum ratio of their
/// brightness.
const ALIKE_SHARE: f32 = 0.06;
const BRIGHTER: f32 = 1.8;
/// Minimum size of a surface; smaller regions are edges, where colours mix.
const MIN_PIXELS: usize = 12;
/// Saturation and value below which a colour is grey or black, and value above which it is white.
const GREY_SATURATION: f32 = 0.25;
const BLACK_VALUE: f32 = 0.2;
/// Minimum saturation of orange. Below it, the colour is the brown of wood and cardboard, in any light.
const BROWN_SATURATION: f32 = 0.72;
const WHITE_VALUE: f32 = 0.75;

/// Maximum number of surfaces of a colour in a reply.
const MAX_SURFACES: usize = 3;
/// Size above which a surface is background. A surface cut off by the image's border is background above
/// this fraction of the image.
const BACKGROUND_M: f64 = 2.0;
const BACKGROUND_PART: f64 = 0.25;

/// Poses of the camera (MuJoCo's axes): in the frame of the reply, and in the level frame for measurements.
pub struct CameraPoses {
    pub frame_from_camera: Isometry3<f64>,
    pub level_from_camera: Isometry3<f64>,
}

/// Returns the visible surfaces of these objects, each with its object's index in `things`. An object is
/// given by its ids.
pub fn of_things(view: &RobotView, things: &[BTreeSet<u32>], poses: &CameraPoses) -> Vec<(usize, Surface)> {
    let relief = Relief::of(view);
    let surface = |(index, ids): (usize, &BTreeSet<u32>)| {
        let seen = |pixel: &usize| ids.contains(&view.ids[*pixel]) && view.depth_m[*pixel].is_finite();
        let pixels: Vec<usize> = (0..view.ids.len()).filter(seen).collect();
        let is_seen = !pixels.is_empty();
        is_seen.then(|| (index, describe(view, &relief, JoinedBy::Object, &pixels, poses)))
    };
    things.iter().enumerate().filter_map(surface).collect()
}

/// Finds the surfaces of a query by pixel or colour.
pub fn find(view: &RobotView, query: &SurfaceQuery, poses: &CameraPoses) -> Vec<Surface> {
    let relief = Relief::of(view);
    let describe = |joined_by: JoinedBy, pixels: &[usize]| describe(view, &relief, joined_by, pixels, poses);
    match (query.pixel, query.color) {
        (Some([u, v]), _) => {
            let seed = v as usize * view.picture.width as usize + u as usize;
            let like = rgb(view, seed);
            let alike = joined(view, seed, &mut vec![false; view.depth_m.len()], &|pixel| {
                are_alike(like, rgb(view, pixel))
            });
            let thing = relief.thing(view, seed);
            // If both regions are nearly the same, only one is reported.
            let is_more = 10 * thing.len() > 11 * alike.len();
            let found =
                [(JoinedBy::Color, alike), (JoinedBy::Shape, if is_more { thing } else { Vec::new() })];
            found
                .iter()
                .filter(|(_, pixels)| !pixels.is_empty())
                .map(|(by, pixels)| describe(*by, pixels))
                .collect()
        }
        (None, Some(color)) => {
            let max_pixels = (BACKGROUND_PART * view.depth_m.len() as f64) as usize;
            let regions = relief.unite(view, of_color(view, color), max_pixels);
            let mut found: Vec<Surface> =
                regions.iter().map(|pixels| describe(JoinedBy::Color, pixels)).collect();
            let eye_m = poses.frame_from_camera.translation.vector;
            let away_m = |surface: &Surface| (Vector3::from(surface.centroid_m) - eye_m).norm();
            let order = |surface: &Surface| (is_background(view, surface), away_m(surface));
            found.sort_by(|one, other| {
                let ((one_behind, one_m), (other_behind, other_m)) = (order(one), order(other));
                one_behind.cmp(&other_behind).then(one_m.total_cmp(&other_m))
            });
            found.truncate(MAX_SURFACES);
            found
        }
        (None, None) => Vec::new(),
    }
}

fn is_background(view: &RobotView, surface: &Surface) -> bool {
    let fills = f64::from(surface.pixels) > BACKGROUND_PART * view.depth_m.len() as f64;
    surface.extent_m.iter().any(|part_m| *part_m > BACKGROUND_M) || (surface.cut_off && fills)
}

/// Returns every surface of a colour, without mere edges.
fn of_color(view: &RobotView, color: Color) -> Vec<Vec<usize>> {
    let mut seen = vec![false; view.depth_m.len()];
    let is_of_it = |pixel: usize| name(rgb(view, pixel)) == color;
    let mut found = Vec::new();
    for seed in 0..view.depth_m.len() {
        if !seen[seed] && is_of_it(seed) {
            let pixels = joined(view, seed, &mut seen, &is_of_it);
            if pixels.len() >= MIN_PIXELS && is_broad(view, &pixels) {
                found.push(pixels);
            }
        }
    }
    found
}

/// Returns true if some pixel is surrounded by pixels of the same surface. Edges, where colours mix, are
/// lines.
fn is_broad(view: &RobotView, pixels: &[usize]) -> bool {
    let width = view.picture.width as usize;
    let own: BTreeSet<usize> = pixels.iter().copied().collect();
    pixels.iter().any(|pixel| {
        let rows = [pixel.checked_sub(width), Some(*pixel), Some(pixel + width)];
        rows.into_iter().all(|middle| {
            middle.is_some_and(|middle| (0..3).all(|i| own.contains(&(middle + i).wrapping_sub(1))))
        })
    })
}

/// Returns every pixel connected to `seed` by neighbours of similar depth for which `belong` is true.
fn joined(view: &RobotView, seed: usize, seen: &mut [bool], belong: &dyn Fn(usize) -> bool) -> Vec<usize> {
    grow(view, seed, seen, &|_, other| belong(other))
}

/// Returns every pixel connected to `seed` by neighbours of similar depth for which `are_joined` is true.
fn grow(
    view: &RobotView,
    seed: usize,
    seen: &mut [bool],
    are_joined: &dyn Fn(usize, usize) -> bool,
) -> Vec<usize> {
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
            if !seen[other] && (here_m - there_m).abs() < step_m && are_joined(pixel, other) {
                seen[other] = true;
                found.push(other);
            }
        }
    }
    found
}

fn rgb(view: &RobotView, pixel: usize) -> [f32; 3] {
    std::array::from_fn(|i| f32::from(view.picture.rgb()[3 * pixel + i]) / 255.0)
}

/// Returns true if two colours may be one material under different light.
fn are_alike(one_rgb: [f32; 3], other_rgb: [f32; 3]) -> bool {
    let sum = |rgb: [f32; 3]| rgb.iter().sum::<f32>() + 0.05;
    let share = |rgb: [f32; 3], i: usize| (rgb[i] + 0.05 / 3.0) / sum(rgb);
    let brighter = (sum(one_rgb) / sum(other_rgb)).max(sum(other_rgb) / sum(one_rgb));
    brighter < BRIGHTER && (0..2).all(|i| (share(one_rgb, i) - share(other_rgb, i)).abs() < ALIKE_SHARE)
}

/// Returns the common name of a colour, from hue, saturation and value.
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
        hue if hue < 42.0 && range < BROWN_SATURATION * value => Color::Brown,
        hue if hue < 42.0 => Color::Orange,
        hue if hue < 70.0 => Color::Yellow,
        hue if hue < 170.0 => Color::Green,
        hue if hue < 260.0 => Color::Blue,
        _ => Color::Violet,
    }
}

fn describe(
    view: &RobotView,
    relief: &Relief,
    joined_by: JoinedBy,
    pixels: &[usize],
    poses: &CameraPoses,
) -> Surface {
    let CameraPoses { frame_from_camera, level_from_camera } = poses;
    let (width, height) = (view.picture.width as usize, view.picture.height as usize);
    let place = |pixel: usize| [(pixel % width) as i64, (pixel / width) as i64];
    let in_camera_m = |pixel: usize| relief.point_m(pixel).unwrap_or_default();
    let point_m = |pixel: usize| -> [f64; 3] { (frame_from_camera * in_camera_m(pixel)).coords.into() };
    let (mut from, mut to) = ([i64::MAX; 2], [i64::MIN; 2]);
    let (mut low_m, mut high_m, mut sum_m) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], [0.0; 3]);
    let (mut color, mut whole) = ([0.0; 3], 0.0);
    for &pixel in pixels {
        let (at, at_m) = (place(pixel), point_m(pixel));
        // Weights pixels by area: near surfaces have more pixels, and slanted ones fewer.
        let area = relief.area(pixel).max(f64::MIN_POSITIVE);
        whole += area;
        for i in 0..2 {
            (from[i], to[i]) = (from[i].min(at[i]), to[i].max(at[i]));
        }
        for i in 0..3 {
            (low_m[i], high_m[i]) = (low_m[i].min(at_m[i]), high_m[i].max(at_m[i]));
            sum_m[i] += area * at_m[i];
            color[i] += rgb(view, pixel)[i];
        }
    }
    let count = pixels.len() as f64;
    let outline = hull(pixels.iter().map(|pixel| place(*pixel)).collect());
    let corner_m = |[u, v]: [i64; 2]| point_m(v as usize * width + u as usize).map(coarse);
    let level_m: Vec<Point3<f64>> =
        pixels.iter().map(|pixel| level_from_camera * in_camera_m(*pixel)).collect();
    let frame_from_level = frame_from_camera * level_from_camera.inverse();
    let axis = round::axis(&level_m, &level_from_camera.translation.vector.into()).map(|axis| {
        let end_m = |height_m: f64| {
            let end_m = frame_from_level * Point3::new(axis.at_m.x, axis.at_m.y, height_m);
            [end_m.x, end_m.y, end_m.z].map(coarse)
        };
        let (bottom_m, top_m) = (end_m(axis.bottom_m), end_m(axis.top_m));
        UprightAxis { bottom_m, top_m, radius_m: coarse(axis.radius_m) }
    });
    Surface {
        object: None,
        joined_by,
        pixels: pixels.len() as u32,
        from,
        to,
        rgb: color.map(|sum| (255.0 * f64::from(sum) / count).round() as u8),
        centroid_m: sum_m.map(|sum_m| coarse(sum_m / whole)),
        middle_m: std::array::from_fn(|i| coarse(0.5 * (low_m[i] + high_m[i]))),
        extent_m: std::array::from_fn(|i| coarse(high_m[i] - low_m[i])),
        corners_m: corners(&outline).into_iter().map(corner_m).collect(),
        axis,
        cut_off: from[0] == 0 || from[1] == 0 || to[0] as usize + 1 == width || to[1] as usize + 1 == height,
    }
}

/// Returns twice the signed area of a triangle; the sign is its orientation.
fn doubled_area(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Returns the convex hull of pixels, by Andrew's monotone chain.
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

/// Returns the four points of a convex outline that span the largest area, or all of them if there are no
/// more than four.
fn corners(outline: &[[i64; 2]]) -> Vec<[i64; 2]> {
    let count = outline.len();
    if count <= 4 {
        return outline.to_vec();
    }
    let (mut most, mut best) = (-1, [0; 4]);
    for one in 0..count {
        for other in one + 2..count {
            // The farthest points from the diagonal, one on either side.
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
    use tandem_sim::render::{Distortion, Frame, Intrinsics};

    use super::*;

    const WIDTH: usize = 60;
    const HEIGHT: usize = 40;

    /// Returns a view of a grey wall at 2 m with a red spot, and a red square rotated onto its corner at 1 m.
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
        let (width, height, distortion) = (WIDTH as u32, HEIGHT as u32, Distortion::NONE);
        let intrinsics = Intrinsics { width, height, focal_px: 50.0, cx: 29.5, cy: 19.5, distortion };
        RobotView::new(intrinsics, Frame { width, height, rgb, depth_m, ids: vec![0; WIDTH * HEIGHT] })
    }

    fn found(pixel: Option<[i64; 2]>, color: Option<Color>) -> Vec<Surface> {
        found_in(&view(), pixel, color)
    }

    fn found_in(view: &RobotView, pixel: Option<[i64; 2]>, color: Option<Color>) -> Vec<Surface> {
        let still = Isometry3::identity();
        let poses = CameraPoses { frame_from_camera: still, level_from_camera: still };
        find(view, &SurfaceQuery { pixel, color, object: None }, &poses)
    }

    /// The square is of two colours and hidden in the middle, and a door is of two parts.
    #[test]
    fn an_object_is_one_surface_whatever_hides_parts_of_it() {
        let mut view = view();
        let is_square = |pixel: usize| view.depth_m[pixel] < 1.5;
        let band = |pixel: usize| (18..22).contains(&(pixel / WIDTH));
        let id = |pixel: usize| match (is_square(pixel), band(pixel)) {
            (true, false) => 4 + u32::from(pixel / WIDTH >= 22),
            (true, true) => 2,
            (false, _) => 1,
        };
        view.ids = (0..WIDTH * HEIGHT).map(id).collect();
        let still = Isometry3::identity();
        let poses = CameraPoses { frame_from_camera: still, level_from_camera: still };
        let each = |things: &[&[u32]]| {
            let things: Vec<_> = things.iter().map(|ids| ids.iter().copied().collect()).collect();
            of_things(&view, &things, &poses)
        };
        let of = |ids: &[u32]| each(&[ids]).pop().map(|(_, surface)| surface);
        let square = of(&[4, 5]).unwrap();
        let hidden = 17 + 19 + 21 + 19;
        assert_eq!((square.joined_by, square.pixels), (JoinedBy::Object, 221 - hidden));
        assert_eq!((square.from, square.to, square.cut_off), ([22, 10], [38, 30], false));
        assert!(of(&[4]).unwrap().pixels < square.pixels);
        assert_eq!(of(&[9]), None);
        let found = each(&[&[9], &[4, 5], &[2]]);
        assert_eq!(found.iter().map(|(index, _)| *index).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(found[0].1, square);
    }

    #[test]
    fn a_surface_is_what_is_joined_and_looks_alike() {
        let square = found(Some([30, 20]), None).remove(0);
        assert_eq!(
            (square.pixels, square.from, square.to, square.rgb),
            (221, [20, 10], [40, 30], [200, 30, 30])
        );
        assert!(!square.cut_off && square.axis.is_none());
        assert!((square.extent_m[0] - 0.4).abs() < 1e-3 && square.extent_m[2].abs() < 1e-3, "{square:?}");
        let off_m = |i: usize| (square.middle_m[i] - square.centroid_m[i]).abs();
        assert!((0..3).all(|i| off_m(i) < 2e-3), "{square:?}");
        // The corners of the rotated square are each 0.2 m from its middle.
        assert_eq!(square.corners_m.len(), 4);
        for corner_m in &square.corners_m {
            let from_middle_m: f64 =
                (0..3).map(|i| (corner_m[i] - square.centroid_m[i]).powi(2)).sum::<f64>().sqrt();
            assert!((from_middle_m - 0.2).abs() < 2e-3, "{square:?}");
        }
        let wall = found(None, Some(Color::Grey)).remove(0);
        assert!(wall.cut_off && wall.pixels as usize == WIDTH * HEIGHT - 221 - 36, "{wall:?}");
        assert_eq!(found(None, Some(Color::Blue)), []);
    }

    /// The spot has one colour, and the wall continues around it. The square in front of the wall is a
    /// separate object.
    #[test]
    fn a_pixel_tells_of_its_colour_and_of_the_whole_thing() {
        let told = |at: [i64; 2]| -> Vec<(JoinedBy, u32)> {
            found(Some(at), None).iter().map(|surface| (surface.joined_by, surface.pixels)).collect()
        };
        let wall = (WIDTH * HEIGHT - 221) as u32;
        assert_eq!(told([4, 4]), [(JoinedBy::Color, 36), (JoinedBy::Shape, wall)]);
        assert_eq!(told([30, 20]), [(JoinedBy::Color, 221)]);
    }

    /// The largest surface of a colour is usually part of the room.
    #[test]
    fn surfaces_of_a_colour_come_nearest_first_and_the_room_last() {
        let mut view = view();
        let told = |view: &RobotView| -> Vec<u32> {
            found_in(view, None, Some(Color::Red)).iter().map(|surface| surface.pixels).collect()
        };
        assert_eq!(told(&view), [221, 36]);
        // A red carpet in front of the robot, nearer than all else and larger than a quarter of the
        // image; and a line of mixed colours.
        let is_carpet = |u: usize, v: usize| v > 30 || (v > 26 && u < 20);
        let mut rgb = view.picture.rgb().to_vec();
        for pixel in 0..WIDTH * HEIGHT {
            let (u, v) = (pixel % WIDTH, pixel / WIDTH);
            if is_carpet(u, v) || v == 0 {
                rgb[3 * pixel..3 * pixel + 3].copy_from_slice(&[200, 30, 30]);
            }
            if is_carpet(u, v) {
                view.depth_m[pixel] = 0.8;
            }
        }
        view.picture = crate::observation::Picture::new(WIDTH as u32, HEIGHT as u32, rgb).into();
        let carpet = found_in(&view, None, Some(Color::Red));
        assert_eq!(told(&view), [221, 36, (9 * WIDTH + 4 * 20) as u32], "{carpet:?}");
    }

    /// A box with a band around its middle shows two red regions; the spot on the wall is not a part of the
    /// box.
    #[test]
    fn regions_of_one_thing_are_one_surface() {
        let mut view = view();
        let mut rgb = view.picture.rgb().to_vec();
        for pixel in (0..WIDTH * HEIGHT).filter(|pixel| (18..22).contains(&(pixel / WIDTH))) {
            rgb[3 * pixel..3 * pixel + 3].copy_from_slice(&[30, 30, 200]);
        }
        view.picture = crate::observation::Picture::new(WIDTH as u32, HEIGHT as u32, rgb).into();
        let told: Vec<_> = found_in(&view, None, Some(Color::Red))
            .iter()
            .map(|surface| (surface.pixels, surface.to))
            .collect();
        let band = 17 + 19 + 21 + 19;
        assert_eq!(told, [(221 - band, [38, 30]), (36, [7, 7])]);
    }

    #[test]
    fn colours_have_the_names_that_people_give_them() {
        for (rgb, expected) in [
            ([0.9, 0.1, 0.1], Color::Red),
            ([0.9, 0.5, 0.1], Color::Orange),
            ([0.45, 0.25, 0.05], Color::Orange),
            ([0.87, 0.74, 0.55], Color::Brown),
            ([0.36, 0.21, 0.12], Color::Brown),
            ([0.9, 0.8, 0.1], Color::Yellow),
            ([0.1, 0.6, 0.2], Color::Green),
            ([0.1, 0.3, 0.9], Color::Blue),
            ([0.6, 0.2, 0.8], Color::Violet),
            ([0.95, 0.95, 0.9], Color::White),
            ([0.5, 0.5, 0.5], Color::Grey),
            ([0.1, 0.05, 0.05], Color::Black),
        ] {
            assert_eq!(name(rgb), expected, "{rgb:?}");
        }
    }
}
