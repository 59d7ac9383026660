//! Estimation of a robot's own motion: a contact-aided error-state Kalman filter over IMU, joint
//! encoders and joint torques. It follows Bloesch et al. 2013 ("State estimation for legged robots") and
//! Hartley et al. 2020 ("Contact-aided invariant extended Kalman filtering"). It has no access to the
//! physics world, and infers contacts only from the legs' torques.
//!
//! State: rotation R, velocity v and place p of the IMU, gyro bias b_g, accelerometer bias b_a. For each
//! foot it also has the point f_i of the ground that the foot stands on, and the foot's heading psi_i.
//! The error of the rotation is in world axes, R = exp(theta) R^:
//!
//!   R+ = R exp((w - b_g) dt),   v+ = v + (R (a - b_a) + g) dt,   p+ = p + v+ dt
//!   theta' = -R b_g,   v' = -[R a]x theta - R b_a,   p' = v
//!   0 = R r_i(q) - (f_i - p)           r_i: from the IMU to the sole's pressure point, by the encoders
//!   0 = f_i,z                          the floor is level, at the given initial height
//!   0 = heading(R R_i(q)) - psi_i      only while standing still: feet twist under a walking robot
//!
//! The point moves over the sole with the centre of pressure (a foot that tips rests on its edge), and
//! f_i moves along.

mod covariance;
mod feet;

#[cfg(test)]
mod tests;

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use rapier3d::glamx::{DMat3, DQuat, DVec3};
use rapier3d::math::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

use crate::body::{BodyEstimate, JOINTS, PelvisMotion, RobotModel, joint_array};
use crate::plane::heading_rad;
use crate::{GRAVITY_M_S2, Side, Sides};
use covariance::{
    ACC_BIAS, Covariance, ERRORS, Errors, FEET, GYRO_BIAS, HEADINGS, MeasurementRow, PLACE, TURN, Update,
    VELOCITY, cross,
};
use feet::{Foot, facing_rad};

/// Readings of a robot's joints at one instant, in the published order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointReadings {
    #[serde(with = "joint_array")]
    pub q_rad: [f32; JOINTS],
    #[serde(with = "joint_array")]
    pub qd_rad_s: [f32; JOINTS],
    #[serde(with = "joint_array")]
    pub torque_n_m: [f32; JOINTS],
}

/// Readings of a robot's sensors at one instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorReadings {
    pub joints: JointReadings,
    /// Angular velocity of the pelvis, in pelvis axes.
    pub gyro_rad_s: Vector,
    /// Mean specific force at the IMU since the last reading, in pelvis axes; at rest 9.81 upwards.
    pub specific_force_m_s2: Vector,
}

/// Estimator of pose and motion of a robot's pelvis. The initial place and heading are given once, and
/// define the frame of all later estimates.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct StateEstimator {
    world_from_imu: DQuat,
    velocity_m_s: DVec3,
    imu_m: DVec3,
    gyro_bias_rad_s: DVec3,
    acc_bias_m_s2: DVec3,
    feet: Sides<Foot>,
    covariance: Covariance,
    /// Time for which both feet have been on the floor while the pelvis hardly turned.
    still_s: f32,
    /// Delay of the readings.
    latency_s: f32,
}

/// Noise of gyro and accelerometer readings at 200 Hz. With a third or three times of it, velocities change
/// by less than a third.
const GYRO_NOISE_RAD_S: f64 = 4e-3;
const ACC_NOISE_M_S2: f64 = 0.1;
/// Random walks of the biases, per root of a second.
const GYRO_WALK_RAD_S: f64 = 2e-5;
const ACC_WALK_M_S2: f64 = 1e-4;
/// Random walk of a foot's point, per root of a second: while the robot stands still, while it walks
/// (feet slip a little), and in flight.
const STILL_WALK_M: f64 = 5e-4;
const STEPPING_WALK_M: f64 = 3e-3;
const FLYING_WALK_M: f64 = 3.0;
const STILL_HEADING_WALK_RAD: f64 = 1e-3;
/// Noise of kinematics: encoder errors and yielding legs.
const POINT_NOISE_M: f64 = 5e-4;
const HEADING_NOISE_RAD: f64 = 2e-3;
const FLOOR_NOISE_M: f64 = 4e-3;
/// Squared number of standard deviations beyond which a foot counts as having slipped.
const SLIP_GATE: f64 = 9.0;
/// Minimum time of standing still, and maximum angular velocity, for estimating the heading from the feet.
const STILL_S: f32 = 0.4;
const STILL_RAD_S: f32 = 0.1;
/// Minimum certainty at which a foot counts as standing on the floor.
const SURE: f64 = 0.9;

/// Standard deviations at the start.
const START_TILT_RAD: f64 = 3e-3;
const START_FOOT_M: f64 = 1e-3;
const START_GYRO_BIAS_RAD_S: f64 = 2e-3;
const START_ACC_BIAS_M_S2: f64 = 2e-2;
const START_KNOWN: f64 = 1e-4;

impl StateEstimator {
    /// Creates the estimator of a robot that has stood long enough for the mean of its accelerometer,
    /// `still_force_m_s2`, to determine its tilt. Position and heading are those of `world_from_pelvis`.
    /// Readings are delayed by `latency_s`.
    pub(crate) fn new(
        model: &RobotModel,
        world_from_pelvis: &Pose,
        q_rad: &[f32],
        still_force_m_s2: Vector,
        latency_s: f32,
    ) -> StateEstimator {
        let heading = Rotation::from_rotation_z(heading_rad(world_from_pelvis));
        let level = Rotation::from_rotation_arc(still_force_m_s2.normalize(), Vector::Z);
        let rotation = (heading * level).as_dquat().normalize();
        let imu_m = world_from_pelvis.translation.as_dvec3() + rotation * model.imu_in_pelvis_m.as_dvec3();
        let pelvis_from_link = model.forward_kinematics(Pose::IDENTITY, q_rad);
        let feet = Sides::from_fn(|side| {
            let mut foot = Foot::standing(model, side);
            let pelvis_from_foot = &pelvis_from_link[foot.link];
            foot.point_m = imu_m + rotation * foot.arm_m(pelvis_from_foot, model);
            foot.heading_rad = facing_rad(rotation * pelvis_from_foot.rotation.as_dquat());
            foot
        });
        let sigma = |error: usize| match error {
            TURN..2 => START_TILT_RAD,
            GYRO_BIAS..ACC_BIAS => START_GYRO_BIAS_RAD_S,
            ACC_BIAS..FEET => START_ACC_BIAS_M_S2,
            FEET..HEADINGS => START_FOOT_M,
            _ => START_KNOWN,
        };
        StateEstimator {
            world_from_imu: rotation,
            velocity_m_s: DVec3::ZERO,
            imu_m,
            gyro_bias_rad_s: DVec3::ZERO,
            acc_bias_m_s2: DVec3::ZERO,
            feet,
            covariance: Covariance::diagonal(sigma),
            still_s: 0.0,
            latency_s,
        }
    }

    /// Processes one reading, `dt_s` after the last one. Returns the poses of all links in the pelvis frame,
    /// from the joint readings.
    pub(crate) fn update(&mut self, model: &RobotModel, readings: &SensorReadings, dt_s: f32) -> Vec<Pose> {
        self.predict(readings, f64::from(dt_s));
        let pelvis_from_link = model.forward_kinematics(Pose::IDENTITY, &readings.joints.q_rad);
        let rotation = self.world_from_imu.as_quat();
        Foot::feel(&mut self.feet, model, &pelvis_from_link, rotation, &readings.joints.torque_n_m, dt_s);
        self.see_stillness(readings, &pelvis_from_link, dt_s);
        self.correct(model, &pelvis_from_link, f64::from(dt_s));
        pelvis_from_link
    }

    /// Returns the body by this estimate, the last readings, and the result of
    /// [`StateEstimator::update`]. The pelvis is extrapolated to the present, joints are not. Their
    /// velocities, differences of readings, are even later, and extrapolation would add mostly noise.
    pub(crate) fn body(
        &self,
        model: &Arc<RobotModel>,
        readings: &SensorReadings,
        pelvis_from_link: &[Pose],
    ) -> BodyEstimate {
        let late_s = self.latency_s;
        let then = self.world_from_imu.as_quat();
        let spin_rad_s = then * (readings.gyro_rad_s - self.gyro_bias_rad_s.as_vec3());
        let force_m_s2 = then * (readings.specific_force_m_s2 - self.acc_bias_m_s2.as_vec3());
        let acceleration_m_s2 = force_m_s2 - Vector::Z * GRAVITY_M_S2;
        let imu_m = self.imu_m.as_vec3() + self.velocity_m_s.as_vec3() * late_s;
        let velocity_m_s = self.velocity_m_s.as_vec3() + acceleration_m_s2 * late_s;
        let rotation = (Rotation::from_scaled_axis(spin_rad_s * late_s) * then).normalize();
        let lever_m = rotation * model.imu_in_pelvis_m;
        let pelvis = PelvisMotion {
            world_from_pelvis: Pose::from_parts(imu_m - lever_m, rotation),
            velocity_m_s: velocity_m_s - spin_rad_s.cross(lever_m),
            spin_rad_s,
        };
        let world_from_link = pelvis_from_link.iter().map(|link| pelvis.world_from_pelvis * *link).collect();
        BodyEstimate::of_motion(
            model,
            &pelvis,
            &readings.joints.q_rad,
            &readings.joints.qd_rad_s,
            world_from_link,
        )
    }

    fn is_still(&self) -> bool {
        self.still_s > STILL_S
    }

    /// Predicts the state. Positions move by the new velocity, as in the simulator.
    fn predict(&mut self, readings: &SensorReadings, dt_s: f64) {
        let turn_rad = (readings.gyro_rad_s.as_dvec3() - self.gyro_bias_rad_s) * dt_s;
        let half = self.world_from_imu * DQuat::from_scaled_axis(turn_rad * 0.5);
        let force_m_s2 = half * (readings.specific_force_m_s2.as_dvec3() - self.acc_bias_m_s2);
        self.velocity_m_s += (force_m_s2 - DVec3::Z * f64::from(GRAVITY_M_S2)) * dt_s;
        self.imu_m += self.velocity_m_s * dt_s;
        self.world_from_imu = (self.world_from_imu * DQuat::from_scaled_axis(turn_rad)).normalize();
        self.covariance.predict(DMat3::from_quat(half), force_m_s2, dt_s);
        let root_s = dt_s.sqrt();
        for i in 0..3 {
            self.covariance.widen(TURN + i, GYRO_NOISE_RAD_S * dt_s);
            self.covariance.widen(VELOCITY + i, ACC_NOISE_M_S2 * dt_s);
            self.covariance.widen(GYRO_BIAS + i, GYRO_WALK_RAD_S * root_s);
            self.covariance.widen(ACC_BIAS + i, ACC_WALK_M_S2 * root_s);
        }
    }

    /// Detects that the robot stands still; from that moment on, the feet keep their present headings.
    fn see_stillness(&mut self, readings: &SensorReadings, pelvis_from_link: &[Pose], dt_s: f32) {
        let spin_rad_s = readings.gyro_rad_s - self.gyro_bias_rad_s.as_vec3();
        let stands =
            self.feet.iter().all(|foot| foot.contact_share > 0.5) && spin_rad_s.length() < STILL_RAD_S;
        let was_still = self.is_still();
        self.still_s = if stands { self.still_s + dt_s } else { 0.0 };
        if was_still && !self.is_still() {
            (0..2).for_each(|side| self.covariance.forget(HEADINGS + side));
        }
        if self.is_still() && !was_still {
            for (side, foot) in self.feet.iter_mut().enumerate() {
                let rotation = pelvis_from_link[foot.link].rotation.as_dquat();
                foot.heading_rad = facing_rad(self.world_from_imu * rotation);
                self.covariance.copy(TURN + 2, HEADINGS + side);
            }
        }
    }

    fn correct(&mut self, model: &RobotModel, pelvis_from_link: &[Pose], dt_s: f64) {
        let still = self.is_still();
        // A walking robot's heading and the gyro's bias about the vertical are considered, not corrected.
        let considered: &[usize] = if still { &[] } else { &[TURN + 2, GYRO_BIAS + 2] };
        let mut update = Update { covariance: &mut self.covariance, errors: [0.0; ERRORS], considered };
        for (side, foot) in Side::BOTH.into_iter().zip(self.feet.iter()) {
            let standing_walk_m = if still { STILL_WALK_M } else { STEPPING_WALK_M };
            let walk_m = (FLYING_WALK_M.ln() * (1.0 - foot.contact_share)
                + standing_walk_m.ln() * foot.contact_share)
                .exp();
            let at = FEET + 3 * side.index();
            (at..at + 3).for_each(|error| update.covariance.widen(error, walk_m * dt_s.sqrt()));
            // A foot in the air gives no information; after landing, its point's uncertainty reflects
            // the duration of the flight.
            if foot.contact_share == 0.0 {
                continue;
            }
            let pelvis_from_foot = &pelvis_from_link[foot.link];
            let arm_m = self.world_from_imu * foot.arm_m(pelvis_from_foot, model);
            let missing_m = arm_m - (foot.point_m - self.imu_m);
            let turning = cross(arm_m);
            for axis in 0..3 {
                let mut row = MeasurementRow::of([(PLACE + axis, -1.0), (at + axis, 1.0)]);
                (0..if still { 3 } else { 2 })
                    .for_each(|about| row.push(TURN + about, turning.col(about)[axis]));
                update.gate(&row, missing_m[axis], POINT_NOISE_M, at + axis);
                update.measure(&row, missing_m[axis], POINT_NOISE_M);
            }
            if still {
                let heading = HEADINGS + side.index();
                let facing_rad = facing_rad(self.world_from_imu * pelvis_from_foot.rotation.as_dquat());
                let turned_rad = wrapped_rad(facing_rad - foot.heading_rad);
                let row = MeasurementRow::of([(TURN + 2, -1.0), (heading, 1.0)]);
                update.covariance.widen(heading, STILL_HEADING_WALK_RAD * dt_s.sqrt());
                update.gate(&row, turned_rad, HEADING_NOISE_RAD, heading);
                update.measure(&row, turned_rad, HEADING_NOISE_RAD);
            }
            if foot.contact_share > SURE {
                update.measure(&MeasurementRow::of([(at + 2, 1.0)]), -foot.point_m.z, FLOOR_NOISE_M);
            }
        }
        let errors = update.errors;
        self.add(&errors);
    }

    fn add(&mut self, errors: &Errors) {
        let part = |at: usize| DVec3::new(errors[at], errors[at + 1], errors[at + 2]);
        self.world_from_imu = (DQuat::from_scaled_axis(part(TURN)) * self.world_from_imu).normalize();
        self.velocity_m_s += part(VELOCITY);
        self.imu_m += part(PLACE);
        self.gyro_bias_rad_s += part(GYRO_BIAS);
        self.acc_bias_m_s2 += part(ACC_BIAS);
        for (side, foot) in self.feet.iter_mut().enumerate() {
            foot.point_m += part(FEET + 3 * side);
            foot.heading_rad += errors[HEADINGS + side];
        }
    }
}

/// Returns the equivalent angle within half a turn of zero.
fn wrapped_rad(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}
