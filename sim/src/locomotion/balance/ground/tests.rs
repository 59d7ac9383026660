//! Sharing of a force between two feet, and the effect of a leg's torques.

use rapier3d::math::Rotation;

use super::*;
use crate::body::posed::Posed;

const COM_M: Vector = Vector::new(0.02, 0.01, 0.7);
const FORCE_N: Vector = Vector::new(8.0, -5.0, 330.0);

/// Returns feet 24 cm apart, the left one a little ahead and turned out.
fn soles() -> Sides<Pose> {
    Sides {
        left: Pose::from_parts(Vector::new(0.05, 0.12, 0.0), Rotation::from_rotation_z(0.2)),
        right: Pose::from_translation(Vector::new(0.0, -0.12, 0.0)),
    }
}

/// Returns the moment about the centre of mass for which the force acts at `pressure_m` on the ground.
fn moment_n_m(pressure_m: Vector) -> Vector {
    (pressure_m - COM_M).cross(FORCE_N)
}

#[test]
fn both_feet_together_give_the_force_and_its_moment() {
    for (x, y) in [(0.02, 0.0), (0.03, 0.08), (0.0, -0.09), (0.06, 0.02)] {
        let pressure_m = Vector::new(x, y, 0.0);
        let moment_n_m = moment_n_m(pressure_m);
        let feet = distribute(&BodyScale::G1, COM_M, FORCE_N, moment_n_m, soles());
        let force_n: Vector = feet.map(|foot| foot.force_n).into_iter().sum();
        assert!((force_n - FORCE_N).length() < 1e-3);
        let given_n_m: Vector = feet.map(|foot| (foot.point_m - COM_M).cross(foot.force_n)).into_iter().sum();
        let missing_n_m = given_n_m - moment_n_m;
        assert!(flat(missing_n_m).length() < 0.02, "at {pressure_m}: {missing_n_m} N m are missing");
    }
}

#[test]
fn the_nearer_foot_carries_more_and_neither_lets_go() {
    let feet = soles();
    let (left_m, right_m) = (feet.left.translation, feet.right.translation);
    for part in [0.0, 0.25, 0.5, 0.9, 1.0] {
        let pressure_m = right_m + (left_m - right_m) * part;
        let left_n = distribute(&BodyScale::G1, COM_M, FORCE_N, moment_n_m(pressure_m), feet).left.force_n;
        let expected = part.clamp(SMALLEST_SHARE, 1.0 - SMALLEST_SHARE);
        assert!((left_n.z / FORCE_N.z - expected).abs() < 1e-4, "at {part}: {left_n}");
    }
}

#[test]
fn pressure_stays_under_the_feet() {
    let inside_m = Vector::new(0.03, 0.04, 0.0);
    assert!((nearest_support_m(&BodyScale::G1, inside_m, soles()) - inside_m).length() < 1e-6);
    for (x, y) in [(0.3, 0.0), (-0.4, 0.1), (0.0, 0.5), (0.2, -0.5)] {
        let nearest_m = nearest_support_m(&BodyScale::G1, Vector::new(x, y, 0.0), soles());
        assert!(nearest_m.x.abs() < 0.05 + SOLE_HALF_LENGTH_M + SOLE_HALF_WIDTH_M);
        assert!(nearest_m.y.abs() < 0.12 + 2.0 * SOLE_HALF_WIDTH_M, "{nearest_m}");
    }
}

/// A moment that would tip the feet reduces the horizontal force, and only by the amount that brings the
/// pressure back under the feet.
#[test]
fn tipping_moments_cost_horizontal_force() {
    let pressure_m = Vector::new(0.3, 0.0, 0.0);
    let moment_n_m = moment_n_m(pressure_m);
    let supported_n = supported_force_n(&BodyScale::G1, COM_M, FORCE_N, moment_n_m, soles());
    assert_eq!(supported_n.z, FORCE_N.z);
    let now_m = centre_of_pressure_m(&BodyScale::G1, COM_M, supported_n, moment_n_m, soles());
    assert!((now_m - nearest_support_m(&BodyScale::G1, pressure_m, soles())).length() < 1e-4, "{now_m}");
    let kept_n = supported_force_n(
        &BodyScale::G1,
        COM_M,
        FORCE_N,
        self::moment_n_m(Vector::new(0.03, 0.0, 0.0)),
        soles(),
    );
    assert!((kept_n - FORCE_N).length() < 1e-3, "{kept_n}");
}

/// The ground's power on a leg that moves about its hip is minus the joints': tau . q' = -(f . v + m . w).
#[test]
fn leg_torques_do_the_work_of_the_ground() {
    let standing = Posed::standing();
    let foot = FootForce { force_n: Vector::new(20.0, -15.0, 160.0), point_m: Vector::new(0.05, 0.1, 0.0) };
    let free_n_m = Vector::new(0.0, 0.0, 4.0);
    let body = standing.body();
    for side in Side::BOTH {
        let torques_n_m = leg_torques_n_m(&body, side, foot, free_n_m);
        let in_foot_m = body.world_from_foot(side).inverse() * foot.point_m;
        for (i, torque_n_m) in torques_n_m.into_iter().enumerate() {
            let turned = |angle_rad: f32| {
                let mut posed = standing.clone();
                posed.q_rad[LEGS[side] + i] += angle_rad;
                posed.body().world_from_foot(side)
            };
            let (before, after) = (turned(-0.005), turned(0.005));
            let moved_m = (after * in_foot_m - before * in_foot_m) / 0.01;
            let spun = (after.rotation * before.rotation.inverse()).to_scaled_axis() / 0.01;
            let expected_n_m = -(foot.force_n.dot(moved_m) + free_n_m.dot(spun));
            assert!((torque_n_m - expected_n_m).abs() < 0.05, "{i}: {torque_n_m} {expected_n_m}");
        }
    }
}

/// Feet that push in opposite directions turn the robot and move it nowhere.
#[test]
fn a_couple_of_both_feet_is_a_moment_about_the_vertical_alone() {
    let feet = soles();
    for wanted_n_m in [12.0, -7.0] {
        let left_n = couple_n(wanted_n_m, feet);
        let apart_m = feet.left.translation - feet.right.translation;
        let given_n_m = apart_m.cross(left_n);
        assert!((given_n_m - Vector::Z * wanted_n_m).length() < 1e-4, "{given_n_m}, not {wanted_n_m} N m");
    }
}
