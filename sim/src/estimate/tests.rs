//! Filters on motions whose truth is known.

use rapier3d::glamx::{DMat3, DQuat, DVec3};

use super::covariance::{Covariance, ERRORS, MeasurementRow, PLACE, TURN, Update, cross};
use super::*;
use crate::PHYSICS_DT_S;
use crate::body::posed::{Posed, model};
use crate::body::{LEG_JOINTS, LEGS};
use crate::random::SplitMix64;

/// Returns the readings of a robot that stands on both feet, its weight shared equally under the middles
/// of its soles.
fn standing() -> SensorReadings {
    let body = Posed::standing().body();
    let mut torque_n_m = body.gravity_torques_n_m();
    for side in Side::BOTH {
        let sole_m = body.world_from_soles()[side].translation;
        let carried = Vector::Z * (0.5 * model().mass_kg * GRAVITY_M_S2);
        for (joint, torque_n_m) in torque_n_m.iter_mut().enumerate().skip(LEGS[side]).take(LEG_JOINTS) {
            *torque_n_m -= body.moment_n_m(joint, sole_m, carried);
        }
    }
    SensorReadings {
        joints: JointReadings { q_rad: body.q_rad, qd_rad_s: [0.0; JOINTS], torque_n_m },
        gyro_rad_s: Vector::ZERO,
        specific_force_m_s2: Vector::Z * GRAVITY_M_S2,
    }
}

fn estimator(readings: &SensorReadings) -> StateEstimator {
    let pelvis = Posed::standing().world_from_pelvis;
    StateEstimator::new(model(), &pelvis, &readings.joints.q_rad, readings.specific_force_m_s2, 0.0)
}

fn body_after(estimator: &mut StateEstimator, readings: &SensorReadings, seconds: f32) -> BodyEstimate {
    let mut links = Vec::new();
    for _ in 0..(seconds / PHYSICS_DT_S) as usize {
        links = estimator.update(model(), readings, PHYSICS_DT_S);
    }
    estimator.body(model(), readings, &links)
}

#[test]
fn a_robot_that_stands_stays_where_it_is() {
    let readings = standing();
    let body = body_after(&mut estimator(&readings), &readings, 20.0);
    let start = Posed::standing().world_from_pelvis;
    assert!((body.world_from_pelvis().translation - start.translation).length() < 1e-3);
    assert!(body.world_from_pelvis().rotation.dot(start.rotation).abs() > 1.0 - 1e-6);
    assert!(body.pelvis_velocity_m_s.length() < 1e-3 && body.com_velocity_m_s.length() < 1e-3);
}

/// A standing robot separates gyro bias and turning by its feet, about the vertical as well.
#[test]
fn a_gyros_bias_is_learnt_while_both_feet_stand() {
    let bias_rad_s = Vector::new(1e-3, -8e-4, 9e-4);
    let readings = SensorReadings { gyro_rad_s: bias_rad_s, ..standing() };
    let mut estimator = estimator(&readings);
    let body = body_after(&mut estimator, &readings, 20.0);
    assert!(
        (estimator.gyro_bias_rad_s.as_vec3() - bias_rad_s).length() < 1e-4,
        "{}",
        estimator.gyro_bias_rad_s
    );
    assert!(heading_rad(&body.world_from_pelvis()).abs() < 3e-3);
}

/// A robot on one leg notices from the torques that its other foot is in the air. The ground point of that
/// foot is soon unknown.
#[test]
fn a_foot_that_carries_nothing_does_not_stand() {
    let mut readings = standing();
    let body = Posed::standing().body();
    let gravity_n_m = body.gravity_torques_n_m();
    let left = LEGS[Side::Left];
    readings.joints.torque_n_m[left..left + LEG_JOINTS]
        .copy_from_slice(&gravity_n_m[left..left + LEG_JOINTS]);
    let mut estimator = estimator(&readings);
    body_after(&mut estimator, &readings, 0.1);
    assert_eq!(estimator.feet.left.contact_share, 0.0);
    assert_eq!(estimator.feet.right.contact_share, 1.0);
}

/// Returns a covariance without zeros.
fn mixed() -> (Covariance, [[f64; ERRORS]; ERRORS]) {
    let mut random = SplitMix64(3);
    let roots: [[f64; ERRORS]; ERRORS] =
        std::array::from_fn(|_| std::array::from_fn(|_| f64::from(random.uniform([-1.0, 1.0]))));
    let rows: [[f64; ERRORS]; ERRORS] = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..ERRORS).map(|k| roots[i][k] * roots[j][k]).sum())
    });
    (Covariance::of_rows(rows), rows)
}

fn product(a: &[[f64; ERRORS]; ERRORS], b: &[[f64; ERRORS]; ERRORS]) -> [[f64; ERRORS]; ERRORS] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..ERRORS).map(|k| a[i][k] * b[k][j]).sum()))
}

fn check(found: &Covariance, expected: &[[f64; ERRORS]; ERRORS]) {
    for (i, row) in expected.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            assert!((found.at(i, j) - value).abs() < 1e-9, "{i} {j}: {} {value}", found.at(i, j));
        }
    }
}

#[test]
fn a_prediction_is_the_product_of_three_matrices() {
    let (mut covariance, before) = mixed();
    let rotation = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.3, -0.2, 0.9)));
    let (force, dt_s) = (DVec3::new(1.0, -2.0, 9.0), 0.005);
    covariance.predict(rotation, force, dt_s);
    let mut step = [[0.0; ERRORS]; ERRORS];
    for i in 0..3 {
        for j in 0..3 {
            step[TURN + i][GYRO_BIAS + j] = -dt_s * rotation.col(j)[i];
            step[VELOCITY + i][TURN + j] = -dt_s * cross(force).col(j)[i];
            step[VELOCITY + i][ACC_BIAS + j] = -dt_s * rotation.col(j)[i];
        }
        step[PLACE + i][VELOCITY + i] = dt_s;
    }
    (0..ERRORS).for_each(|i| step[i][i] = 1.0);
    let transposed = std::array::from_fn(|i| std::array::from_fn(|j| step[j][i]));
    check(&covariance, &product(&product(&step, &before), &transposed));
}

/// The textbook's formula, and for considered errors Joseph's form.
#[test]
fn a_measurement_is_josephs_form() {
    for considered in [&[][..], &[TURN + 2, GYRO_BIAS + 2][..]] {
        let (mut covariance, before) = mixed();
        let row = MeasurementRow::of([(PLACE, -1.0), (FEET, 1.0), (TURN + 1, 0.4)]);
        let (y, sigma) = (0.7, 0.3);
        let mut update = Update { covariance: &mut covariance, errors: [0.0; ERRORS], considered };
        update.measure(&row, y, sigma);
        let mut h = [0.0; ERRORS];
        (h[PLACE], h[FEET], h[TURN + 1]) = (-1.0, 1.0, 0.4);
        let ph: Errors = std::array::from_fn(|i| (0..ERRORS).map(|j| before[i][j] * h[j]).sum());
        let spread = (0..ERRORS).map(|i| h[i] * ph[i]).sum::<f64>() + sigma * sigma;
        let gain: Errors =
            std::array::from_fn(|i| if considered.contains(&i) { 0.0 } else { ph[i] / spread });
        for (error, gain) in update.errors.iter().zip(gain) {
            assert!((error - gain * y).abs() < 1e-12);
        }
        let expected = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                before[i][j] - gain[i] * ph[j] - ph[i] * gain[j] + spread * gain[i] * gain[j]
            })
        });
        check(&covariance, &expected);
    }
}
