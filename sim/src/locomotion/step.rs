//! Stepping: one foot carries the robot, the other swings to where the capture point asks for it.
//!
//! With x the balance point, v its velocity and w = sqrt(g / h), the capture point xi = x + v / w obeys
//!   xi' = w (xi - p),   p the centre of pressure,
//! so that a foot put down at  u = p + (xi - p) e^{w t} - b  when t of the step remains leaves the capture point the
//! wanted offset b from the new foot. b is the one of a steady gait at the commanded velocity:
//!   b = v T / (e^{w T} - 1)  along the motion,   width / (1 + e^{w T})  to the inside.
//! Source: Englsberger, Ott, Albu-Schaeffer 2015; Khadiv et al. 2016.

use rapier3d::math::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::LegCommand;
use super::ground::{FootForce, distribute, leg_torques_n_m, soles};
use super::legs::{LegAngles, inverse, rotation_vector_rad};
use super::load::Load;
use crate::robot::{LEG_JOINT_COUNT, LEGS, Side, WholeBody};
use crate::world::GRAVITY_M_S2;

/// Length of a step and distance of the feet, found by random search on a prototype.
const PERIOD_S: f32 = 0.262;
const WIDTH_M: f32 = 0.254;
const SWING_HEIGHT_M: f32 = 0.056;
/// The feet never cross.
const LEAST_SPREAD_M: f32 = 0.13;
/// Part of the capture point's error that the centre of pressure of the carrying foot works against.
const CAPTURE_GAIN: f32 = 1.033;
/// Position loop: a steady gait falls short of its command by a fifth.
const VELOCITY_GAIN: f32 = 1.3;
const POSITION_GAIN_1_S: f32 = 0.8;
const BIAS_GAIN_1_S2: f32 = 0.3;
/// A robot that was pushed farther than this off its way does not come back for it.
const LEASH_M: f32 = 0.4;
const LIFT_STIFFNESS_1_S2: f32 = 111.0;
const LIFT_DAMPING_1_S: f32 = 16.0;
const TRUNK_STIFFNESS_N_M_RAD: f32 = 200.0;
const TRUNK_DAMPING_N_M_S_RAD: f32 = 25.0;
const LARGEST_MOMENT_N_M: f32 = 60.0;
/// Walking is neither stretched nor crouched.
const HEIGHT_RANGE_M: [f32; 2] = [0.66, 0.745];
const HEIGHT_RATE_M_S: f32 = 0.15;

/// Ankle roll link to the centre of its sole.
const SOLE_IN_FOOT_M: Vector = Vector::new(0.035, 0.0, -0.035);

const SWING_KP_N_M_RAD: [f32; LEG_JOINT_COUNT] = [200.0, 200.0, 120.0, 200.0, 40.0, 40.0];
const SWING_KD_N_M_S_RAD: [f32; LEG_JOINT_COUNT] = [6.0, 6.0, 4.0, 6.0, 1.5, 1.5];
/// A leg that carries is driven by torque; the drives need some stiffness, around the measured angle.
const STANCE_KP_N_M_RAD: f32 = 1.0;
const STANCE_KD_N_M_S_RAD: f32 = 1.0;

/// A robot that steps; see the module's text.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Step {
    pub(super) heading_rad: f32,
    stance: Side,
    /// Both feet still carry: the capture point moves over the first stance foot.
    shifting: bool,
    time_s: f32,
    steps: u32,
    swing_from: Pose,
    swing_to: Pose,
    swing_q_rad: LegAngles,
    height_m: f32,
    /// Where the balance point should be by now, and what the velocity command lacked so far.
    reference_m: Vector,
    bias_m_s: [f32; 2],
}

impl Step {
    /// Starts stepping; the first foot to carry is the one nearer to the capture point.
    pub(super) fn start(body: &WholeBody, load: &Load, heading_rad: f32, left_carries: bool) -> Step {
        let stance = if left_carries { Side::Left } else { Side::Right };
        let ground_m = soles(body)[stance.index()].translation.z;
        let mut step = Step {
            heading_rad,
            stance,
            shifting: true,
            time_s: 0.0,
            steps: 0,
            swing_from: Pose::IDENTITY,
            swing_to: Pose::IDENTITY,
            swing_q_rad: [0.0; LEG_JOINT_COUNT],
            height_m: body.world_from_pelvis().translation.z - ground_m,
            reference_m: load.balance_point_m,
            bias_m_s: [0.0; 2],
        };
        step.lift_off(body);
        step
    }

    pub(super) fn steps(&self) -> u32 {
        self.steps
    }

    /// The swing foot touched down in the last physics step.
    pub(super) fn just_landed(&self) -> bool {
        self.time_s == 0.0 && !self.shifting
    }

    fn swing(&self) -> Side {
        if self.stance == Side::Left { Side::Right } else { Side::Left }
    }

    /// The swing foot starts from where it is.
    fn lift_off(&mut self, body: &WholeBody) {
        let swing = self.swing();
        self.time_s = 0.0;
        self.swing_from = body.world_from_link[body.model.joints[LEGS[swing.index()] + 5].link];
        self.swing_to = self.swing_from;
        self.swing_q_rad = std::array::from_fn(|i| body.q_rad[LEGS[swing.index()] + i]);
    }

    /// One physics step.
    pub(super) fn tick(
        &mut self,
        body: &WholeBody,
        load: &Load,
        velocity: [f32; 3],
        height_m: f32,
        dt_s: f32,
    ) -> LegCommand {
        let soles = soles(body);
        let ground_m = soles[self.stance.index()].translation.z;
        self.heading_rad += velocity[2] * dt_s;
        let heading = Rotation::from_rotation_z(self.heading_rad);
        let (ahead, left) = (heading * Vector::X, heading * Vector::Y);
        let balance_m = load.balance_point_m;
        let com_height_m = (balance_m.z - ground_m).max(0.4);
        let rate_1_s = (GRAVITY_M_S2 / com_height_m).sqrt();
        let capture_m = flat(balance_m + body.com_velocity_m_s / rate_1_s);
        let velocity_m_s = self.corrected_velocity(velocity, balance_m, ahead, left, dt_s);
        let growth = (rate_1_s * PERIOD_S).exp();
        let outwards = if self.stance == Side::Left { 1.0 } else { -1.0 };
        let stance_m = flat(soles[self.stance.index()].translation);
        let inside_m = WIDTH_M / (1.0 + growth);
        let mut pressure_m;
        if self.shifting {
            let target_m = stance_m - left * (outwards * inside_m);
            pressure_m = capture_m + (capture_m - target_m);
            if (capture_m - target_m).dot(left) * outwards > -0.012 {
                self.shifting = false;
                self.lift_off(body);
            }
        } else {
            self.time_s += dt_s;
            let remaining_s = (PERIOD_S - self.time_s).max(0.0);
            let along_m = (ahead * velocity_m_s[0] + left * velocity_m_s[1]) * (PERIOD_S / (growth - 1.0));
            let wanted_m =
                stance_m + (along_m - left * (outwards * inside_m)) * (rate_1_s * self.time_s).exp();
            let sole = soles[self.stance.index()].rotation;
            let correction_m = sole.inverse() * ((capture_m - wanted_m) * CAPTURE_GAIN);
            let correction_m =
                Vector::new(correction_m.x.clamp(-0.05, 0.06), correction_m.y.clamp(-0.018, 0.018), 0.0);
            pressure_m = flat(stance_m + sole * correction_m);
            let landing_capture_m = pressure_m + (capture_m - pressure_m) * (rate_1_s * remaining_s).exp();
            let from_stance_m = landing_capture_m - (along_m + left * (outwards * inside_m)) - stance_m;
            let reach_m = from_stance_m.dot(ahead).clamp(-0.35, 0.45);
            let spread_m = (from_stance_m.dot(left) * -outwards).clamp(LEAST_SPREAD_M, 0.45);
            let turned = Rotation::from_rotation_z(self.heading_rad + velocity[2] * remaining_s);
            let mut sole_m = stance_m + ahead * reach_m - left * (outwards * spread_m);
            sole_m.z = ground_m;
            if remaining_s > 0.04 {
                self.swing_to = Pose::from_parts(sole_m - turned * SOLE_IN_FOOT_M, turned);
            }
        }
        let gravity = body.gravity_torques_n_m();
        let mut legs = carrying_legs(body);
        if !self.shifting {
            self.drive_swing(body, &mut legs, dt_s);
            let swing = self.swing();
            let clear_m = clearance_m(&soles[swing.index()]) - ground_m;
            if self.time_s >= PERIOD_S * 1.1 || (self.time_s > 0.7 * PERIOD_S && clear_m < 0.002) {
                self.stance = swing;
                self.steps += 1;
                self.lift_off(body);
                pressure_m = flat(soles[self.stance.index()].translation);
                legs = carrying_legs(body);
            }
        }
        let rise = (height_m.clamp(HEIGHT_RANGE_M[0], HEIGHT_RANGE_M[1]) - self.height_m)
            .clamp(-HEIGHT_RATE_M_S * dt_s, HEIGHT_RATE_M_S * dt_s);
        self.height_m += rise;
        let torques = self.carry(body, load, pressure_m, &soles, com_height_m, heading);
        for (i, feedforward_n_m) in legs.feedforward_n_m.iter_mut().enumerate() {
            let (leg, own) = (i / LEG_JOINT_COUNT, i % LEG_JOINT_COUNT);
            *feedforward_n_m += gravity[LEGS[leg] + own] + torques[leg][own];
        }
        legs
    }

    /// Velocity to plan with: the command, plus what brings the balance point back to where it should be by now.
    fn corrected_velocity(
        &mut self,
        velocity: [f32; 3],
        balance_m: Vector,
        ahead: Vector,
        left: Vector,
        dt_s: f32,
    ) -> [f32; 2] {
        // A robot that is to stop stops where it can: the bias was learned in another direction of motion.
        let stopping = velocity == [0.0; 3];
        if self.steps == 0 || stopping {
            self.reference_m = balance_m;
        }
        if stopping {
            self.bias_m_s = [0.0; 2];
        }
        self.reference_m += (ahead * velocity[0] + left * velocity[1]) * dt_s;
        let mut error_m = flat(self.reference_m - balance_m);
        if error_m.length() > LEASH_M {
            error_m *= LEASH_M / error_m.length();
            self.reference_m = balance_m + error_m;
        }
        let error_m = [error_m.dot(ahead), error_m.dot(left)];
        std::array::from_fn(|i| {
            let most_m_s = [0.4, 0.25][i];
            if self.steps > 0 {
                self.bias_m_s[i] = (self.bias_m_s[i] + BIAS_GAIN_1_S2 * error_m[i].clamp(-0.3, 0.3) * dt_s)
                    .clamp(-most_m_s, most_m_s);
            }
            VELOCITY_GAIN * velocity[i] + (POSITION_GAIN_1_S * error_m[i]).clamp(-0.3, 0.3) + self.bias_m_s[i]
        })
    }

    fn drive_swing(&mut self, body: &WholeBody, legs: &mut LegCommand, dt_s: f32) {
        let air_s = PERIOD_S * 0.92;
        let phase = (self.time_s / air_s).clamp(0.0, 1.0);
        let smooth = phase * phase * phase * (10.0 - 15.0 * phase + 6.0 * phase * phase);
        let mut position_m =
            self.swing_from.translation + (self.swing_to.translation - self.swing_from.translation) * smooth;
        position_m.z += SWING_HEIGHT_M * (std::f32::consts::PI * phase).sin();
        // Push down until the ground answers.
        position_m.z -= 0.25 * (self.time_s - air_s).max(0.0);
        let foot =
            Pose::from_parts(position_m, self.swing_from.rotation.slerp(self.swing_to.rotation, smooth));
        let swing = self.swing();
        let before = self.swing_q_rad;
        self.swing_q_rad = inverse(body.model, swing, body.world_from_pelvis(), foot, &before, 3);
        for i in 0..LEG_JOINT_COUNT {
            let joint = swing.index() * LEG_JOINT_COUNT + i;
            legs.q_rad[joint] = self.swing_q_rad[i];
            legs.kp_n_m_rad[joint] = SWING_KP_N_M_RAD[i];
            legs.kd_n_m_s_rad[joint] = SWING_KD_N_M_S_RAD[i];
            if self.time_s > 2.0 * dt_s {
                let rate_rad_s = ((self.swing_q_rad[i] - before[i]) / dt_s).clamp(-15.0, 15.0);
                legs.feedforward_n_m[joint] = SWING_KD_N_M_S_RAD[i] * rate_rad_s;
            }
        }
    }

    /// Torques of the carrying leg or legs for a centre of pressure.
    fn carry(
        &self,
        body: &WholeBody,
        load: &Load,
        pressure_m: Vector,
        soles: &[Pose; 2],
        com_height_m: f32,
        heading: Rotation,
    ) -> [[f32; LEG_JOINT_COUNT]; 2] {
        let mass_kg = body.model.mass_kg;
        let pelvis = body.world_from_pelvis();
        let ground_m = soles[self.stance.index()].translation.z;
        let weight_n = mass_kg * GRAVITY_M_S2;
        let lift_m_s2 = LIFT_STIFFNESS_1_S2 * (self.height_m + ground_m - pelvis.translation.z)
            - LIFT_DAMPING_1_S * body.pelvis_velocity_m_s.z;
        let vertical_n =
            (weight_n - load.force_n.z + mass_kg * lift_m_s2).clamp(0.5 * weight_n, 1.8 * weight_n);
        let tilt_rad = rotation_vector_rad(heading * pelvis.rotation.inverse());
        let most = LARGEST_MOMENT_N_M;
        let moment =
            tilt_rad * TRUNK_STIFFNESS_N_M_RAD - body.pelvis_angular_velocity_rad_s * TRUNK_DAMPING_N_M_S_RAD;
        let moment_n_m =
            Vector::new(moment.x.clamp(-most, most), moment.y.clamp(-most, most), moment.z.clamp(-8.0, 8.0));
        let away_m = flat(load.balance_point_m) - pressure_m;
        let turn = Vector::new(0.0, 0.0, moment_n_m.z);
        if self.shifting {
            let force_n = friction(Vector::new(
                vertical_n / com_height_m * away_m.x,
                vertical_n / com_height_m * away_m.y,
                vertical_n,
            ));
            let feet = distribute(load.balance_point_m, force_n, moment_n_m, *soles);
            return Side::BOTH.map(|side| leg_torques_n_m(body, side, feet[side.index()], turn * 0.5));
        }
        let force_n = friction(Vector::new(
            (vertical_n * away_m.x - moment_n_m.y) / com_height_m,
            (vertical_n * away_m.y + moment_n_m.x) / com_height_m,
            vertical_n,
        ));
        let point_m = Vector::new(pressure_m.x, pressure_m.y, ground_m);
        let mut torques = [[0.0; LEG_JOINT_COUNT]; 2];
        torques[self.stance.index()] =
            leg_torques_n_m(body, self.stance, FootForce { force_n, point_m }, turn);
        torques
    }
}

fn flat(v: Vector) -> Vector {
    Vector::new(v.x, v.y, 0.0)
}

/// Horizontal force within what friction surely gives.
fn friction(force_n: Vector) -> Vector {
    let horizontal_n = force_n.x.hypot(force_n.y);
    let scale = (0.55 * force_n.z / horizontal_n.max(1e-3)).min(1.0);
    Vector::new(force_n.x * scale, force_n.y * scale, force_n.z)
}

/// Height of the lowest point of a sole.
fn clearance_m(sole: &Pose) -> f32 {
    let corner = |x: f32, y: f32| (*sole * Vector::new(x, y, 0.0)).z;
    corner(0.085, 0.03).min(corner(0.085, -0.03)).min(corner(-0.085, 0.025)).min(corner(-0.085, -0.025))
}

/// Both legs limp at their measured angles, to be driven by torque.
fn carrying_legs(body: &WholeBody) -> LegCommand {
    LegCommand {
        q_rad: std::array::from_fn(|i| body.q_rad[LEGS[i / LEG_JOINT_COUNT] + i % LEG_JOINT_COUNT]),
        kp_n_m_rad: [STANCE_KP_N_M_RAD; 12],
        kd_n_m_s_rad: [STANCE_KD_N_M_S_RAD; 12],
        feedforward_n_m: [0.0; 12],
    }
}
