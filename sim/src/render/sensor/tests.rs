//! Tests of a D435i's images against known ideal images.

use rapier3d::math::{Pose, Rotation, Vector};

use super::colour::{Exposure, READOUT_S, SensorLight};
use super::depth::{BASELINE_M, DISPARITY_PX_M, NOISE_PX, RANGE_M, STEPS};
use super::*;
use crate::CONTROL_DT_S;
use crate::render::Distortion;
use crate::srgb::linear_light;

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
const FOCAL_PX: f32 = 129.6;

/// Returns the lens of the robots' cameras without distortion.
fn lens() -> Intrinsics {
    Intrinsics {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        focal_px: FOCAL_PX,
        cx: 159.5,
        cy: 119.5,
        distortion: Distortion::NONE,
    }
}

fn each_pixel<T>(value: impl Fn(usize, usize) -> T) -> Vec<T> {
    (0..WIDTH * HEIGHT).map(|pixel| value(pixel % WIDTH, pixel / WIDTH)).collect()
}

fn mean_and_deviation(values: impl Iterator<Item = f32> + Clone) -> [f64; 2] {
    let count = values.clone().count() as f64;
    let mean = values.clone().map(f64::from).sum::<f64>() / count;
    let variance = values.map(|value| (f64::from(value) - mean).powi(2)).sum::<f64>() / count;
    [mean, variance.sqrt()]
}

#[test]
fn a_ray_comes_back_from_the_distorted_image_and_edges_move_as_little_as_the_datasheet_says() {
    let distortion = lens().of_model(CameraModel::D435i).distortion;
    for [u, v] in [[0, 0], [319, 239], [319, 0], [160, 0], [0, 120], [200, 100]] {
        let ray = [(u as f32 - 159.5) / FOCAL_PX, (v as f32 - 119.5) / FOCAL_PX];
        let place = distortion.distorted(ray);
        let back = distortion.undistorted(place);
        let off_px = (0..2).map(|i| (back[i] - ray[i]).abs() * FOCAL_PX).fold(0.0, f32::max);
        assert!(off_px < 1e-2, "{off_px} px at {u}, {v}");
        let moved = ((place[0] - ray[0]).hypot(place[1] - ray[1])) / ray[0].hypot(ray[1]);
        assert!(moved < 0.015, "{moved} of the way at {u}, {v}");
    }
    let edge = distortion.distorted([159.5 / FOCAL_PX, 0.0])[0] * FOCAL_PX - 159.5;
    assert!((1.0..2.5).contains(&edge), "the side moves by {edge} px");
}

#[test]
fn depth_errs_by_the_square_of_the_distance_in_steps_of_a_32nd_of_a_pixel() {
    for ideal_m in [0.91, 2.03, 4.31] {
        let measured_m = depth::taken(&vec![ideal_m; WIDTH * HEIGHT], &LensMap::of(&lens()), 7);
        let disparities_px = measured_m.iter().map(|depth_m| DISPARITY_PX_M / depth_m);
        // Up close, rounding to millimetres is coarser than the disparity steps.
        let rounding_steps = STEPS * DISPARITY_PX_M / (ideal_m * ideal_m) * 0.0005 * 1.1;
        for disparity_px in disparities_px {
            let steps = disparity_px * STEPS;
            assert!((steps - steps.round()).abs() < rounding_steps.max(0.01), "{steps} at {ideal_m} m");
        }
        let [mean_m, rms_m] = mean_and_deviation(measured_m.iter().copied());
        let to_m = f64::from(ideal_m * ideal_m / DISPARITY_PX_M);
        let steps_m = to_m / f64::from(STEPS) / 12f64.sqrt();
        let expected_m = (to_m * f64::from(NOISE_PX)).hypot(steps_m).hypot(0.001 / 12f64.sqrt());
        assert!((rms_m / expected_m - 1.0).abs() < 0.02, "{rms_m} m, not {expected_m}, at {ideal_m} m");
        assert!((mean_m - f64::from(ideal_m)).abs() < 0.1 * expected_m, "{mean_m} m at {ideal_m} m");
        assert!(rms_m < 0.02 * f64::from(ideal_m), "the datasheet's 2 %, at least up to 2 m");
    }
}

#[test]
fn depth_has_limits() {
    for (ideal_m, is_measured) in
        [(0.25, false), (0.35, true), (9.0, true), (14.0, false), (f32::INFINITY, false)]
    {
        let measured_m = depth::taken(&vec![ideal_m; WIDTH * HEIGHT], &LensMap::of(&lens()), 7);
        let finite = measured_m.iter().filter(|depth_m| depth_m.is_finite()).count();
        assert!(finite == if is_measured { WIDTH * HEIGHT } else { 0 }, "{finite} pixels at {ideal_m} m");
    }
    assert_eq!(RANGE_M, [0.28, 10.0]);
}

/// A box is in front of a wall. The right imager does not see the wall behind the box's left edge.
#[test]
fn a_near_thing_has_a_hole_of_the_baseline_on_its_left() {
    let (near_m, far_m) = (0.6, 2.4);
    let is_box = |u: usize, v: usize| (150..220).contains(&u) && (60..180).contains(&v);
    let ideal_m = each_pixel(|u, v| if is_box(u, v) { near_m } else { far_m });
    let measured_m = depth::taken(&ideal_m, &LensMap::of(&lens()), 7);
    let width_px = FOCAL_PX * BASELINE_M * (1.0 / near_m - 1.0 / far_m);
    for row in [30, 60, 120, 179, 200] {
        let holes: Vec<usize> =
            (0..WIDTH).filter(|column| measured_m[row * WIDTH + column].is_infinite()).collect();
        if !(60..180).contains(&row) {
            assert!(holes.is_empty(), "row {row} has no edge");
            continue;
        }
        assert_eq!(holes.last(), Some(&149), "row {row}");
        assert_eq!(holes.len(), 150 - holes[0], "one hole in row {row}: {holes:?}");
        assert!((holes.len() as f32 - width_px).abs() <= 1.0, "{} columns, not {width_px}", holes.len());
    }
    // A floor that extends away from the camera has no holes.
    let floor_m = each_pixel(|u, v| if v < 130 { 9.0 } else { 90.0 / (v as f32 - 120.0 + 0.05 * u as f32) });
    assert!(depth::taken(&floor_m, &LensMap::of(&lens()), 7).iter().all(|depth_m| depth_m.is_finite()));
}

#[test]
fn colours_have_the_noise_of_their_electrons() {
    // The scene is dark, so that the gain is at its limit.
    let grey = vec![20; 3 * WIDTH * HEIGHT];
    let light = SensorLight::of(&grey, WIDTH as u32, HEIGHT as u32);
    let exposure = light.exposure();
    assert!((exposure.time_s, exposure.gain) == (0.033, 1983.0 / 128.0), "{exposure:?}");
    let shot = Shot { seed: 3, motion: CameraMotion::STILL };
    let taken = light.taken(&exposure, &vec![1.0; WIDTH * HEIGHT], &LensMap::of(&lens()), &shot);
    let value = linear_light(20.0 / 255.0) * exposure.factor();
    let to_byte = |value: f32| 255.0 * (1.055 * value.powf(1.0 / 2.4) - 0.055);
    let slope = f64::from((to_byte(value + 1e-3) - to_byte(value - 1e-3)) / 2e-3);
    for (axis, [shot_noise, read_noise]) in exposure.variance(HEIGHT as u32).into_iter().enumerate() {
        let bytes = taken.chunks_exact(3).map(|pixel| f32::from(pixel[axis]));
        let [mean, deviation] = mean_and_deviation(bytes);
        let expected = (f64::from(shot_noise * value + read_noise) * slope * slope + 1.0 / 12.0).sqrt();
        assert!((deviation / expected - 1.0).abs() < 0.03, "{deviation}, not {expected}, of colour {axis}");
        assert!((mean - f64::from(to_byte(value))).abs() < 0.5, "{mean} of colour {axis}");
        assert!(deviation > 2.0, "one would see it: {deviation}");
    }
    // With twice the electrons, the variance relative to the square of their number is half.
    let variance = |gain| Exposure { time_s: 0.02, gain }.variance(HEIGHT as u32)[1][0];
    assert!((variance(4.0) / variance(2.0) - 2.0).abs() < 1e-5);
}

#[test]
fn bright_scenes_are_exposed_for_less_long_and_dark_ones_with_gain() {
    let exposed =
        |byte: u8| SensorLight::of(&vec![byte; 3 * WIDTH * HEIGHT], WIDTH as u32, HEIGHT as u32).exposure();
    for byte in [60, 120, 180, 250] {
        let exposure = exposed(byte);
        let mean = linear_light(f32::from(byte) / 255.0) * exposure.factor();
        assert!((mean - 0.18).abs() < 1e-3, "{mean} at {byte}");
    }
    let [dark, usual, bright] = [60, 120, 255].map(exposed);
    assert!(dark.gain > usual.gain && usual.gain >= bright.gain && bright.gain == 1.0);
    assert!(dark.time_s == 0.033 && bright.time_s < 0.02, "{dark:?} {bright:?}");
}

/// Returns for each row the column of a vertical edge, and the number of blurred pixels between dark and
/// bright. The edge is at column 160 in the ideal image.
fn edge(depth_m: f32, motion: CameraMotion) -> Vec<[f32; 2]> {
    let ideal = each_pixel(|u, _| if u < 160 { [40; 3] } else { [200; 3] }).concat();
    let light = SensorLight::of(&ideal, WIDTH as u32, HEIGHT as u32);
    let exposure = light.exposure();
    let shot = Shot { seed: 3, motion };
    let taken = light.taken(&exposure, &vec![depth_m; WIDTH * HEIGHT], &LensMap::of(&lens()), &shot);
    let values = [40.0, 200.0].map(|byte: f32| linear_light(byte / 255.0) * exposure.factor());
    let rows = taken.chunks_exact(3 * WIDTH).map(|row| {
        // The sum of the row's brightness gives the edge's position with the least noise.
        let bright = |column: usize| {
            let value = linear_light(f32::from(row[3 * column + 1]) / 255.0);
            (value - values[0]) / (values[1] - values[0])
        };
        let near = 130..190;
        let place = 190.0 - near.clone().map(bright).sum::<f32>();
        let between = near.filter(|column| (0.15..0.85).contains(&bright(*column))).count();
        [place, between as f32]
    });
    rows.collect()
}

#[test]
fn a_turning_camera_shears_and_blurs_its_image() {
    let turn_rad_s = 1.5;
    let motion = CameraMotion { linear_m_s: Vector::ZERO, angular_rad_s: Vector::Y * turn_rad_s };
    let rows = edge(f32::INFINITY, motion);
    // The camera turns to the left, so the image moves to the right, and farther the later a row is read.
    let shear_px = FOCAL_PX * turn_rad_s * READOUT_S;
    let part = |rows: &[[f32; 2]], i: usize| rows.iter().map(|row| row[i]).sum::<f32>() / rows.len() as f32;
    let (top, bottom) = (part(&rows[..20], 0), part(&rows[220..], 0));
    let expected_px = shear_px * 220.0 / 240.0;
    assert!((bottom - top - expected_px).abs() < 0.1 * expected_px, "{top} to {bottom}, not {expected_px}");
    assert!((part(&rows[110..130], 0) - 160.0).abs() < 0.2, "the middle row is of this moment");
    let still = edge(f32::INFINITY, CameraMotion::STILL);
    assert!(part(&still, 1) < 0.5 && (part(&still, 0) - 160.0).abs() < 0.2);
    // With an exposure of 33 ms, the transition from 15 % to 85 % covers seven tenths of the motion.
    let blur_px = 0.7 * FOCAL_PX * turn_rad_s * 0.033;
    assert!((part(&rows, 1) - blur_px).abs() < 1.0, "{} pixels, not {blur_px}", part(&rows, 1));
}

#[test]
fn what_is_near_moves_more_in_the_image_of_a_camera_that_passes_by() {
    let motion = CameraMotion { linear_m_s: Vector::X * 1.2, angular_rad_s: Vector::ZERO };
    for depth_m in [0.5, 1.0, 4.0] {
        let rows = edge(depth_m, motion);
        let mean = |rows: &[[f32; 2]]| rows.iter().map(|row| row[0]).sum::<f32>() / rows.len() as f32;
        let expected_px = -FOCAL_PX * 1.2 / depth_m * READOUT_S * 220.0 / 240.0;
        let moved_px = mean(&rows[220..]) - mean(&rows[..20]);
        assert!((moved_px - expected_px).abs() < 0.15, "{moved_px}, not {expected_px}, at {depth_m} m");
    }
}

#[test]
fn motion_is_that_between_two_poses_in_the_cameras_own_frame() {
    let before = Pose::from_parts(Vector::new(1.0, 2.0, 3.0), Rotation::from_rotation_y(0.7));
    let turn = Rotation::from_axis_angle(Vector::new(0.6, 0.0, 0.8), 0.01);
    let after = before * Pose::from_parts(Vector::new(0.002, -0.004, 0.006), turn);
    let motion = CameraMotion::between(&before, &after);
    let expected = Vector::new(0.6, 0.0, 0.8) * (0.01 / CONTROL_DT_S);
    assert!((motion.angular_rad_s - expected).length() < 1e-3, "{motion:?}");
    let expected = turn.inverse() * Vector::new(0.1, -0.2, 0.3);
    assert!((motion.linear_m_s - expected).length() < 1e-3, "{motion:?}");
    let still = CameraMotion::between(&before, &before);
    assert!(still.angular_rad_s.length() < 1e-5 && still.linear_m_s.length() < 1e-5);
}

#[test]
fn an_image_depends_on_seed_step_and_robot_alone() {
    let ideal = Frame {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        rgb: each_pixel(|u, v| [(u % 256) as u8, (v % 256) as u8, 90]).concat(),
        depth_m: each_pixel(|u, _| 0.5 + 0.01 * u as f32),
        ids: each_pixel(|u, v| (u / 40 + v / 40) as u32),
    };
    let lens = lens().of_model(CameraModel::D435i);
    let taken = |seed: u64| Shot { seed, motion: CameraMotion::STILL }.d435i(ideal.clone(), &lens);
    let seeds =
        [(1, 0, 0), (2, 0, 0), (1, 1, 0), (1, 0, 1)].map(|(seed, robot, step)| Shot::seed(seed, robot, step));
    let first = taken(seeds[0]);
    assert_eq!(taken(seeds[0]), first);
    for seed in &seeds[1..] {
        let other = taken(*seed);
        assert!(other.rgb != first.rgb && other.depth_m != first.depth_m && other.ids == first.ids);
    }
    assert_eq!((first.width, first.height, first.rgb.len()), (ideal.width, ideal.height, ideal.rgb.len()));
}
