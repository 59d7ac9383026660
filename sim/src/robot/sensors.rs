//! Readings of a robot's sensors. Ideal sensors report the simulator's state; those of a G1 add noise, bias
//! and latency.

use rapier3d::math::{Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::joints;
use crate::GRAVITY_M_S2;
use crate::body::{JOINTS, RobotModel};
use crate::dynamics::Tree;
use crate::estimate::{JointReadings, SensorReadings};
use crate::random::SplitMix64;

/// Quality of a robot's sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SensorModel {
    /// Exact readings without latency.
    #[default]
    Ideal,
    /// Noise, bias and latency of a Unitree G1.
    G1,
    /// A G1's sensors with twice the noise and bias.
    G1Twice,
    /// A G1's sensors with four times the noise and bias.
    G1Fourfold,
}

impl SensorModel {
    /// Models available in settings. The others are only applied to episodes as stress.
    pub const ALL: [SensorModel; 2] = [SensorModel::Ideal, SensorModel::G1];

    pub fn name(self) -> &'static str {
        match self {
            SensorModel::Ideal => "ideal",
            SensorModel::G1 => "g1",
            SensorModel::G1Twice => "g1_twice",
            SensorModel::G1Fourfold => "g1_fourfold",
        }
    }
}

/// Standard deviations of the noise on each reading at 200 Hz, and the latency of readings.
struct Noise {
    gyro_rad_s: f32,
    gyro_bias_rad_s: f32,
    acc_m_s2: f32,
    acc_bias_m_s2: f32,
    encoder_rad: f32,
    torque_n_m: f32,
    latency_s: f32,
    /// Cutoff frequency of joint velocities, which are low-passed differences of positions.
    rate_cutoff_hz: f32,
}

impl Noise {
    /// Returns the noise and bias multiplied by `factor`, with the same latency.
    fn times(&self, factor: f32) -> Noise {
        Noise {
            gyro_rad_s: factor * self.gyro_rad_s,
            gyro_bias_rad_s: factor * self.gyro_bias_rad_s,
            acc_m_s2: factor * self.acc_m_s2,
            acc_bias_m_s2: factor * self.acc_bias_m_s2,
            encoder_rad: factor * self.encoder_rad,
            torque_n_m: factor * self.torque_n_m,
            latency_s: self.latency_s,
            rate_cutoff_hz: self.rate_cutoff_hz,
        }
    }
}

const G1: Noise = Noise {
    gyro_rad_s: 3.5e-3,
    gyro_bias_rad_s: 8.7e-4,
    acc_m_s2: 0.05,
    acc_bias_m_s2: 0.02,
    encoder_rad: 1e-4,
    torque_n_m: 0.5,
    latency_s: 4e-3,
    rate_cutoff_hz: 40.0,
};

/// Number of readings over which a robot at rest averages its accelerometer: one second.
const STILL_READINGS: f32 = 200.0;

/// The sensors of one robot.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Sensors {
    model: SensorModel,
    random: SplitMix64,
    gyro_bias_rad_s: Vector,
    acc_bias_m_s2: Vector,
    /// Velocity of the IMU and rotation of the pelvis at the last reading.
    last_motion: Option<(Vector, Rotation)>,
    /// The last reading without noise and latency.
    last_ideal: Option<SensorReadings>,
    last: Option<SensorReadings>,
}

impl Sensors {
    pub(super) fn new(model: SensorModel, seed: u64) -> Sensors {
        let mut sensors = Sensors {
            model,
            random: SplitMix64(seed),
            gyro_bias_rad_s: Vector::ZERO,
            acc_bias_m_s2: Vector::ZERO,
            last_motion: None,
            last_ideal: None,
            last: None,
        };
        if let Some(noise) = sensors.noise() {
            sensors.gyro_bias_rad_s = sensors.normal() * noise.gyro_bias_rad_s;
            sensors.acc_bias_m_s2 = sensors.normal() * noise.acc_bias_m_s2;
        }
        sensors
    }

    fn noise(&self) -> Option<Noise> {
        match self.model {
            SensorModel::Ideal => None,
            SensorModel::G1 => Some(G1.times(1.0)),
            SensorModel::G1Twice => Some(G1.times(2.0)),
            SensorModel::G1Fourfold => Some(G1.times(4.0)),
        }
    }

    /// Draws a vector whose components each have a standard deviation of 1.
    fn normal(&mut self) -> Vector {
        let mut draw = || self.random.normal();
        Vector::new(draw(), draw(), draw())
    }

    /// Reads the sensors one physics step after the last reading.
    pub(super) fn read(&mut self, tree: &Tree, model: &RobotModel, dt_s: f32) -> SensorReadings {
        let ideal = self.ideal(tree, model, dt_s);
        let Some(noise) = self.noise() else { return ideal };
        let mut read = match &self.last_ideal {
            Some(last) => between(&ideal, last, noise.latency_s / dt_s),
            None => ideal.clone(),
        };
        self.last_ideal = Some(ideal);
        for joint in (0..JOINTS).filter(|joint| model.joints[*joint].exists()) {
            read.joints.q_rad[joint] += self.random.normal() * noise.encoder_rad;
            read.joints.torque_n_m[joint] += self.random.normal() * noise.torque_n_m;
        }
        read.gyro_rad_s += self.gyro_bias_rad_s + self.normal() * noise.gyro_rad_s;
        read.specific_force_m_s2 += self.acc_bias_m_s2 + self.normal() * noise.acc_m_s2;
        let part = 1.0 - (-std::f32::consts::TAU * noise.rate_cutoff_hz * dt_s).exp();
        read.joints.qd_rad_s = std::array::from_fn(|joint| {
            self.last.as_ref().map_or(0.0, |SensorReadings { joints: last, .. }| {
                let difference_rad_s = (read.joints.q_rad[joint] - last.q_rad[joint]) / dt_s;
                last.qd_rad_s[joint] + (difference_rad_s - last.qd_rad_s[joint]) * part
            })
        });
        self.last = Some(read.clone());
        read
    }

    /// Returns the age of readings when the robot receives them.
    pub(super) fn latency_s(&self) -> f32 {
        self.noise().map_or(0.0, |noise| noise.latency_s)
    }

    /// Returns the mean accelerometer reading over a second at rest, for an exact value of `ideal_m_s2`.
    pub(super) fn still_force_m_s2(&mut self, ideal_m_s2: Vector) -> Vector {
        let noise_m_s2 = self.noise().map_or(0.0, |noise| noise.acc_m_s2 / STILL_READINGS.sqrt());
        ideal_m_s2 + self.acc_bias_m_s2 + self.normal() * noise_m_s2
    }

    fn ideal(&mut self, tree: &Tree, model: &RobotModel, dt_s: f32) -> SensorReadings {
        let (q_rad, qd_rad_s) = joints::read(tree, model);
        let world_from_pelvis = tree.world_from_link(0);
        let rotation = world_from_pelvis.rotation.as_quat();
        let imu_m = world_from_pelvis * model.imu_in_pelvis_m.as_dvec3();
        let velocity_m_s = tree.point_velocity_m_s(0, imu_m).as_vec3();
        let (before_m_s, before) = self.last_motion.unwrap_or((velocity_m_s, rotation));
        self.last_motion = Some((velocity_m_s, rotation));
        let force_m_s2 = (velocity_m_s - before_m_s) / dt_s + Vector::Z * GRAVITY_M_S2;
        SensorReadings {
            joints: JointReadings { q_rad, qd_rad_s, torque_n_m: joints::torques_n_m(tree, model) },
            gyro_rad_s: rotation.inverse() * tree.link_spin_rad_s(0).as_vec3(),
            specific_force_m_s2: before.slerp(rotation, 0.5).inverse() * force_m_s2,
        }
    }
}

/// Interpolates the readings at a share of a step before `now`; `before` is one step before `now`.
fn between(now: &SensorReadings, before: &SensorReadings, share: f32) -> SensorReadings {
    let mix = |now: &[f32; JOINTS], before: &[f32; JOINTS]| {
        std::array::from_fn(|joint| now[joint] + (before[joint] - now[joint]) * share)
    };
    SensorReadings {
        joints: JointReadings {
            q_rad: mix(&now.joints.q_rad, &before.joints.q_rad),
            qd_rad_s: mix(&now.joints.qd_rad_s, &before.joints.qd_rad_s),
            torque_n_m: mix(&now.joints.torque_n_m, &before.joints.torque_n_m),
        },
        gyro_rad_s: now.gyro_rad_s.lerp(before.gyro_rad_s, share),
        specific_force_m_s2: now.specific_force_m_s2.lerp(before.specific_force_m_s2, share),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::{Robot, RobotPlacement};
    use super::*;
    use crate::PHYSICS_DT_S;
    use crate::body::posed::model;
    use crate::dynamics::{DVec3, Dynamics, Settings};

    /// Returns a robot in the air, before its first step.
    fn hanging() -> (Dynamics, Robot) {
        let mut dynamics = Dynamics::new(Settings::new(f64::from(PHYSICS_DT_S), DVec3::Z * -9.81));
        let placement = RobotPlacement { name: "A".into(), position_m: [0.0; 2], yaw_rad: 0.0 };
        let robot =
            Robot::spawn(&mut dynamics, &Arc::new(RobotModel::clone(model())), &placement, 0).unwrap();
        (dynamics, robot)
    }

    fn spread(values: &[f32]) -> f32 {
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        (values.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / values.len() as f32).sqrt()
    }

    #[test]
    fn readings_spread_as_they_should() {
        let (dynamics, robot) = hanging();
        let tree = dynamics.tree(robot.tree);
        let read = |seed: u64| {
            let mut sensors = Sensors::new(SensorModel::G1, seed);
            (0..1000).map(|_| sensors.read(tree, model(), PHYSICS_DT_S)).collect::<Vec<_>>()
        };
        let readings = read(1);
        let check = |value: fn(&SensorReadings) -> f32, expected: f32| {
            let found = spread(&readings.iter().map(value).collect::<Vec<_>>());
            assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
        };
        check(|read| read.joints.q_rad[3], G1.encoder_rad);
        check(|read| read.joints.torque_n_m[7], G1.torque_n_m);
        check(|read| read.gyro_rad_s.z, G1.gyro_rad_s);
        check(|read| read.specific_force_m_s2.x, G1.acc_m_s2);
        // Differences of white noise s have variance 2 s^2 / dt^2. The filter y += a (d - y) leaves 2
        // a^2 s^2 / dt^2 / (2 - a), and a is 0.7154 at 40 Hz and 200 readings a second.
        check(|read| read.joints.qd_rad_s[3], 0.8926 * G1.encoder_rad / PHYSICS_DT_S);
        assert!(read(1) == readings && read(2) != readings, "the seed decides");

        let ideal = Sensors::new(SensorModel::Ideal, 1).read(tree, model(), PHYSICS_DT_S);
        assert_eq!(ideal.joints.q_rad, joints::read(tree, model()).0);
        assert!((ideal.specific_force_m_s2 - Vector::Z * GRAVITY_M_S2).length() < 1e-4);
    }

    /// The mean of many readings of one robot is off by a constant bias, which depends on the seed.
    #[test]
    fn biases_stay() {
        const READINGS: usize = 100;
        let (dynamics, robot) = hanging();
        let tree = dynamics.tree(robot.tree);
        let (mut gyros_rad_s, mut forces_m_s2) = (Vec::new(), Vec::new());
        for seed in 0..100 {
            let mut sensors = Sensors::new(SensorModel::G1, seed);
            let (mut gyro_rad_s, mut force_m_s2) = (Vector::ZERO, Vector::ZERO);
            for _ in 0..READINGS {
                let read = sensors.read(tree, model(), PHYSICS_DT_S);
                gyro_rad_s += read.gyro_rad_s / READINGS as f32;
                force_m_s2 += (read.specific_force_m_s2 - Vector::Z * GRAVITY_M_S2) / READINGS as f32;
            }
            gyros_rad_s.extend(gyro_rad_s.to_array());
            forces_m_s2.extend(force_m_s2.to_array());
        }
        let check = |means: &[f32], bias: f32, noise: f32| {
            let (found, expected) = (spread(means), bias.hypot(noise / (READINGS as f32).sqrt()));
            assert!((found / expected - 1.0).abs() < 0.2, "{found} {expected}");
        };
        check(&gyros_rad_s, G1.gyro_bias_rad_s, G1.gyro_rad_s);
        check(&forces_m_s2, G1.acc_bias_m_s2, G1.acc_m_s2);
    }

    /// A robot that begins to fall immediately measures zero force with ideal sensors. With noisy sensors,
    /// which have latency, it still measures most of its weight.
    #[test]
    fn readings_are_late() {
        let upwards = |sensors: SensorModel| {
            let (mut dynamics, robot) = hanging();
            let mut sensors = Sensors::new(sensors, 1);
            sensors.read(dynamics.tree(robot.tree), model(), PHYSICS_DT_S);
            dynamics.step().unwrap();
            sensors.read(dynamics.tree(robot.tree), model(), PHYSICS_DT_S).specific_force_m_s2.z
        };
        assert!(upwards(SensorModel::Ideal).abs() < 0.1);
        let late = G1.latency_s / PHYSICS_DT_S;
        assert!((upwards(SensorModel::G1) - late * GRAVITY_M_S2).abs() < 0.3);
    }
}
