//! SE(3): the logarithm is a logarithm, and its Jacobian is its derivative.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};
use tandem_ik::spatial::{Log6, log3};

/// Angles of every size, the smallest below the series' limit and the largest next to pi.
const ANGLES_RAD: [f64; 9] = [0.0, 1e-12, 1e-7, 0.9e-3, 1.1e-3, 0.1, 1.0, 3.0, 3.13];

fn poses() -> Vec<Isometry3<f64>> {
    let axes = [Vector3::x(), Vector3::new(1.0, -2.0, 0.5), Vector3::new(-0.3, 0.1, 0.9)];
    let pose = |axis: &Vector3<f64>, angle: f64| {
        let rotation = UnitQuaternion::from_scaled_axis(axis.normalize() * angle);
        Isometry3::from_parts(Translation3::new(0.3, -0.2 * axis.x, 0.7), rotation)
    };
    ANGLES_RAD.iter().flat_map(|angle| axes.iter().map(move |axis| pose(axis, *angle))).collect()
}

fn assert_close(a: Vector6<f64>, b: Vector6<f64>, within: f64, pose: &Isometry3<f64>) {
    assert!((a - b).amax() < within, "{a} against {b} at {pose:?}");
}

/// Returns the exponential of a small twist, to second order.
fn small_motion(twist: &Vector6<f64>) -> Isometry3<f64> {
    let (v, w) = (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned());
    Isometry3::from_parts((v + 0.5 * w.cross(&v)).into(), UnitQuaternion::from_scaled_axis(w))
}

#[test]
fn rotation_vectors_come_back() {
    for angle in ANGLES_RAD {
        let w = Vector3::new(0.6, 0.0, -0.8) * angle;
        assert!((log3(&UnitQuaternion::from_scaled_axis(w)) - w).amax() < 1e-12, "{angle}");
    }
}

#[test]
fn logarithm_of_the_inverse_is_the_negative() {
    for pose in poses() {
        assert_close(Log6::of(&pose.inverse()).twist, -Log6::of(&pose).twist, 1e-9, &pose);
    }
    assert_eq!(Log6::of(&Isometry3::identity()).twist, Vector6::zeros());
}

/// A screw motion does not change its own twist: J^-1 xi = xi.
#[test]
fn twists_are_fixed_points_of_their_jacobian() {
    for pose in poses() {
        let log = Log6::of(&pose);
        let (v, w) = (log.twist.fixed_rows::<3>(0).into_owned(), log.twist.fixed_rows::<3>(3).into_owned());
        assert_close(log.transform(&v, &w), log.twist, 1e-9, &pose);
    }
}

/// log(exp(d) T) = log(T) + J^-1 d + O(d^2).
#[test]
fn jacobian_is_the_derivative() {
    let step = 1e-5;
    for pose in poses().iter().filter(|pose| pose.rotation.angle() < 3.1) {
        let log = Log6::of(pose);
        for axis in 0..6 {
            let twist = Vector6::ith(axis, step);
            let ahead = Log6::of(&(small_motion(&twist) * pose)).twist;
            let behind = Log6::of(&(small_motion(&-twist) * pose)).twist;
            let unit = Vector6::ith(axis, 1.0);
            let (v, w) = (unit.fixed_rows::<3>(0).into_owned(), unit.fixed_rows::<3>(3).into_owned());
            assert_close((ahead - behind) / (2.0 * step), log.transform(&v, &w), 1e-6, pose);
        }
    }
}
