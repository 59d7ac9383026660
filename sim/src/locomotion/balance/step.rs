//! Stepping: one foot carries the robot, the other swings to the foothold that the capture point requires.
//!
//! With x the balance point, v its velocity, u the velocity of the swinging foot, s = [`SWING_INERTIA`] and w
//! = sqrt(g / h), the capture point  xi = x + (v - s u) / w  obeys
//!   xi' = w (xi - p) + s u,   p the centre of pressure,
//! which moves from the old foot to the new one within the transfer time and stays there. The remaining
//! contribution of s u until the foot lands is part of the steady gait's offset b. The plan of a step ignores
//! it: including it brought no gain. A foot put down at xi(T) - b  leaves the capture point the offset b from
//! the new foot; see [`Gait`]. The centre of mass moves along with a leg that swings, and stops with it: v -
//! s u is the lasting velocity, as given by the angular momentum about the ground. Without this term a robot
//! that was hit steps too far. The faster it steps, the larger is the error, and the next step is too far the
//! other way.
//! Source: Englsberger, Ott, Albu-Schaeffer 2015; Khadiv et al. 2016; angular momentum: Gong, Grizzle 2022.

use rapier3d::math::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::course::Course;
use super::effort::{GroundContact, LegTorques, WantedMotion, leg_torques_within_limits};
use super::footstep::{Footstep, FootstepInputs};
use super::gait::{Gait, PERIOD_S, SWING_INERTIA, TRANSFER_S};
use super::ground::nearest_support_m;
use super::legs::rotation_vector_rad;
use super::load::Load;
use super::swing::{SWING_S, Swing, foot_motion};
use crate::body::{Acceleration, BodyEstimate, BodyScale, JointDrive, LEGS};
use crate::locomotion::{BaseVelocity, LegCommand};
use crate::plane::{flat, heading_rad, wrapped_rad};
use crate::{GRAVITY_M_S2, Side, Sides};

const SHIFT_GAIN: f32 = 3.0;
/// Distance between the capture point and its position at the end of a step, below which the first foot
/// lifts. If a robot falls forward or backward beyond the second distance, there is no time to shift, and the
/// foot also lifts.
const SHIFTED_M: f32 = 0.012;
const LATEST_M: f32 = 0.1;
/// Maximum duration of the shift. A robot that leans against partners would otherwise shift forever:
/// they pull the more the farther it leans.
const LONGEST_SHIFT_S: f32 = 0.5;
/// Number of steps in which a robot gathers speed.
const STARTING_STEPS: u32 = 5;
/// Maximum heading error. One foot holds little against turning: a robot that is turned by force yields,
/// and turns back slowly.
const HEADING_LEASH_RAD: f32 = 0.35;
const RETURN_RAD_S: f32 = 0.4;
/// Spin (rad/s) above which footholds are planned for the heading at landing. A robot that a blow has
/// set spinning turns by a radian while its foot swings, and otherwise its legs would cross. A slower
/// spin is the normal sway of walking robots. Tuned on punches back at shoulders and elbows of walking
/// robots, seeds 2600-2799.
const SWAYING_RAD_S: f32 = 1.0;
const LARGEST_SPIN_TURN_RAD: f32 = 0.8;
/// Velocity error that indicates a blow. The robot then steps to come to a stand, not to walk on. Tuned on
/// the same punches as the spin.
const STRAYING_M_S: f32 = 0.6;
/// Averaging time of the pelvis's facing direction. The pelvis sways about the vertical with every step.
const FACING_TIME_S: f32 = 0.2;
const LIFT_STIFFNESS_1_S2: f32 = 90.0;
const LIFT_DAMPING_1_S: f32 = 15.0;
/// Range of the vertical acceleration, as shares of gravity.
const LIFT_RANGE: [f32; 2] = [-0.45, 0.6];
const TRUNK_STIFFNESS_1_S2: f32 = 90.0;
const TRUNK_DAMPING_1_S: f32 = 19.0;
const LARGEST_TURN_RAD_S2: f32 = 50.0;
/// Factor on the turning about the vertical: a stance foot holds less about that axis than about the others.
const YAW_PART: f32 = 0.6;
/// Range of the pelvis height: walking is neither stretched nor crouched.
const HIGHEST_M: f32 = 0.745;
const LOWEST_M: f32 = 0.62;
const RAISING_M_S: f32 = 0.15;
const LOWERING_M_S: f32 = 0.8;
/// Distance from the hip's roll axis to the ankle roll link of a sufficiently bent leg.
const LEG_M: f32 = 0.49;
const ANKLE_HEIGHT_M: f32 = 0.053;
/// Shares of the swing time at which a step may end at the earliest, by contact with the ground, and
/// must end at the latest.
const EARLIEST_LANDING: f32 = 0.65;
const LATEST_LANDING: f32 = 1.25;
const GROUND_M: f32 = 0.002;
/// Minimum height of the centre of mass over the ground: a lower robot has fallen.
const MIN_HEIGHT_M: f32 = 0.4;

/// Drive gains: a stance leg is driven by torque, but its drives need some stiffness around the measured
/// angle.
const KP_N_M_RAD: f32 = 1.0;
const KD_N_M_S_RAD: f32 = 1.0;

/// A robot that steps; see the module's text.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Stepping {
    pub(super) heading_rad: f32,
    /// Heading to which the commands alone would have turned the robot.
    goal_rad: f32,
    /// Yaw of the heading minus yaw of the pelvis.
    lag_rad: f32,
    stance: Side,
    /// Time for which the capture point has been moving over the first stance foot, before the first step.
    shifting_s: Option<f32>,
    /// Time since the stance foot landed.
    time_s: f32,
    steps: u32,
    swing: Swing,
    height_m: f32,
    course: Course,
}

impl Stepping {
    /// Starts stepping, and turns to the heading `goal_rad`. The first stance foot is the left one if
    /// `left_carries` is true.
    pub(super) fn start(
        body: &BodyEstimate,
        heading_rad: f32,
        goal_rad: f32,
        left_carries: bool,
    ) -> Stepping {
        let stance = if left_carries { Side::Left } else { Side::Right };
        let ground_m = body.world_from_soles()[stance].translation.z;
        let mut step = Stepping {
            heading_rad,
            goal_rad,
            lag_rad: 0.0,
            stance,
            shifting_s: Some(0.0),
            time_s: 0.0,
            steps: 0,
            swing: Swing::default(),
            height_m: body.world_from_pelvis().translation.z - ground_m,
            course: Course::from(body.world_from_pelvis().translation),
        };
        step.swing.plant(body, step.stance.other());
        step
    }

    /// Returns the angle between the heading and the heading to which the commands alone would have turned
    /// the robot.
    pub(super) fn to_turn_rad(&self) -> f32 {
        wrapped_rad(self.goal_rad - self.heading_rad).abs()
    }

    pub(super) fn steps(&self) -> u32 {
        self.steps
    }

    /// Returns true if the swing foot touched down in the last physics step.
    pub(super) fn just_landed(&self) -> bool {
        self.time_s == 0.0 && self.shifting_s.is_none()
    }

    /// Runs one physics step. Also returns the expected horizontal acceleration of the centre of mass.
    pub(super) fn tick(
        &mut self,
        body: &BodyEstimate,
        load: &Load,
        velocity: BaseVelocity,
        height_m: f32,
        dt_s: f32,
    ) -> (LegCommand, Vector) {
        let soles = body.world_from_soles();
        let ground_m = soles[self.stance].translation.z;
        self.turn(body, velocity.yaw_rate_rad_s, dt_s);
        let heading = Rotation::from_rotation_z(self.heading_rad);
        let scale = &body.model.scale;
        let [ahead, left] = self.landing_axes(body, velocity.yaw_rate_rad_s);
        let rate_1_s = (GRAVITY_M_S2 / (body.com_m.z - ground_m).max(scale.length_m(MIN_HEIGHT_M))).sqrt();
        let pelvis_m = body.world_from_pelvis().translation;
        let faced = self.faced_axes(body, dt_s);
        let starts = self.steps < STARTING_STEPS;
        let velocity_m_s = self.course.corrected_velocity(scale, velocity, starts, pelvis_m, faced, dt_s);
        let outside = left * self.stance.sign();
        let commanded_m_s = faced[0] * velocity.vx_m_s + faced[1] * velocity.vy_m_s;
        let strays = flat(body.com_velocity_m_s - commanded_m_s).length() > scale.speed_m_s(STRAYING_M_S);
        let course_m_s =
            if strays { Vector::ZERO } else { faced[0] * velocity_m_s[0] + faced[1] * velocity_m_s[1] };
        // A robot that turns while it walks takes the coming step in the direction that it will face by then.
        let coming = Rotation::from_rotation_z(velocity.yaw_rate_rad_s * scale.time_s(PERIOD_S));
        let gait = Gait::new(scale, rate_1_s, coming * course_m_s, outside);
        let (_, foot_m_s, _) = foot_motion(body, self.stance.other());
        let lasting_m_s = load.velocity_m_s - foot_m_s * SWING_INERTIA;
        let situation = FootstepInputs {
            scale,
            gait: &gait,
            swing: &self.swing,
            capture_m: flat(load.balance_point_m + lasting_m_s / rate_1_s),
            stance: soles[self.stance],
            old_m: flat(soles[self.stance.other()].translation),
            ahead_axis: ahead,
            outside_axis: outside,
            time_s: self.time_s,
        };
        let pressure_m = if let Some(shifting_s) = self.shifting_s {
            let (target_m, shifted) = shift(&situation);
            let ends = shifted || shifting_s + dt_s > scale.time_s(LONGEST_SHIFT_S);
            self.shifting_s = (!ends).then_some(shifting_s + dt_s);
            let shifted_m = situation.capture_m + (situation.capture_m - target_m) * SHIFT_GAIN;
            nearest_support_m(scale, shifted_m, soles)
        } else {
            let footstep = situation.plan(dt_s);
            self.advance(scale, &footstep, velocity.yaw_rate_rad_s, ground_m, dt_s);
            footstep.pressure_m
        };
        self.rise(body, height_m, dt_s);
        let torques = self.carry(body, load, pressure_m, ground_m, heading, velocity.yaw_rate_rad_s);
        self.land(body, &soles, ground_m);
        (drives(body, &torques), torques.acceleration_m_s2)
    }

    /// Moves the pelvis height towards `height_m`, within the range of walking and the reach of both legs.
    fn rise(&mut self, body: &BodyEstimate, height_m: f32, dt_s: f32) {
        let scale = &body.model.scale;
        let wanted_m = height_m
            .min(scale.height_m(HIGHEST_M))
            .min(self.within_reach_m(body))
            .max(scale.height_m(LOWEST_M));
        let [lowering_m, raising_m] =
            [LOWERING_M_S, RAISING_M_S].map(|g1_m_s| scale.speed_m_s(g1_m_s) * dt_s);
        self.height_m += (wanted_m - self.height_m).clamp(-lowering_m, raising_m);
    }

    /// Turns the heading as commanded, within the leash of the robot's facing direction.
    fn turn(&mut self, body: &BodyEstimate, yaw_rate_rad_s: f32, dt_s: f32) {
        self.goal_rad += yaw_rate_rad_s * dt_s;
        let most_rad = body.model.scale.rate_1_s(RETURN_RAD_S) * dt_s;
        let return_rad = wrapped_rad(self.goal_rad - self.heading_rad).clamp(-most_rad, most_rad);
        self.heading_rad += yaw_rate_rad_s * dt_s + return_rad;
        let ahead_rad = wrapped_rad(self.heading_rad - heading_rad(&body.world_from_pelvis()));
        self.heading_rad += ahead_rad.clamp(-HEADING_LEASH_RAD, HEADING_LEASH_RAD) - ahead_rad;
    }

    /// Returns the axes ahead and left at the landing of the swinging foot for a robot that was set spinning.
    /// For other robots it returns the axes of the heading.
    fn landing_axes(&self, body: &BodyEstimate, yaw_rate_rad_s: f32) -> [Vector; 2] {
        let scale = &body.model.scale;
        let swaying_rad_s = scale.rate_1_s(SWAYING_RAD_S);
        let spin_rad_s = body.pelvis_angular_velocity_rad_s.z - yaw_rate_rad_s;
        let excess_rad_s = spin_rad_s - spin_rad_s.clamp(-swaying_rad_s, swaying_rad_s);
        let turn_rad = excess_rad_s * scale.time_s((PERIOD_S - self.time_s).max(0.0));
        let turn_rad = turn_rad.clamp(-LARGEST_SPIN_TURN_RAD, LARGEST_SPIN_TURN_RAD);
        let facing = Rotation::from_rotation_z(self.heading_rad + turn_rad);
        [facing * Vector::X, facing * Vector::Y]
    }

    /// Returns the axes ahead and left of the pelvis's facing direction. A velocity command refers to
    /// these; they may lag behind the heading.
    fn faced_axes(&mut self, body: &BodyEstimate, dt_s: f32) -> [Vector; 2] {
        let lag_rad = wrapped_rad(self.heading_rad - heading_rad(&body.world_from_pelvis()));
        self.lag_rad += (lag_rad - self.lag_rad) * (dt_s / body.model.scale.time_s(FACING_TIME_S));
        let facing = Rotation::from_rotation_z(self.heading_rad - self.lag_rad);
        [facing * Vector::X, facing * Vector::Y]
    }

    /// Runs one physics step of the swinging foot.
    fn advance(
        &mut self,
        scale: &BodyScale,
        footstep: &Footstep,
        yaw_rate_rad_s: f32,
        ground_m: f32,
        dt_s: f32,
    ) {
        self.time_s += dt_s * footstep.pace;
        let remaining_s = (PERIOD_S - self.time_s).max(0.0) / footstep.pace;
        let turned = Rotation::from_rotation_z(self.heading_rad + yaw_rate_rad_s * remaining_s);
        let sole_m = footstep.foothold_m + Vector::Z * ground_m;
        let goal = Pose::from_parts(sole_m - turned * scale.sole_in_foot_m, turned);
        self.swing.advance(goal, self.time_s - TRANSFER_S, footstep.pace, dt_s);
    }

    /// Returns the maximum height of the pelvis at which both legs reach, now and at the swinging foot's
    /// landing. A straight leg can neither lift its foot nor lower the pelvis.
    fn within_reach_m(&self, body: &BodyEstimate) -> f32 {
        let scale = &body.model.scale;
        let (leg_m, ankle_height_m) = (scale.length_m(LEG_M), scale.length_m(ANKLE_HEIGHT_M));
        let pelvis_m = body.world_from_pelvis().translation;
        let remaining_s = scale.time_s((PERIOD_S - self.time_s).max(0.0));
        let height_m = |side: Side| {
            let (hip_m, _) = body.joint_axis(body.model.hip(side));
            let now_m = flat(body.world_from_foot(side).translation - hip_m).length();
            let landing_m = if side == self.stance || self.shifting_s.is_some() {
                0.0
            } else {
                flat(self.swing.goal_m() - hip_m - body.com_velocity_m_s * remaining_s).length()
            };
            let away_m = now_m.max(landing_m).min(0.8 * leg_m);
            pelvis_m.z - hip_m.z + ankle_height_m + (leg_m * leg_m - away_m * away_m).sqrt()
        };
        height_m(Side::Left).min(height_m(Side::Right))
    }

    /// Swaps stance foot and swing foot when the swing foot has met the ground.
    fn land(&mut self, body: &BodyEstimate, soles: &Sides<Pose>, ground_m: f32) {
        let swinging_s = self.time_s - TRANSFER_S;
        let swing = self.stance.other();
        if self.shifting_s.is_some() || swinging_s < 0.0 {
            self.swing.plant(body, swing);
            return;
        }
        let clear_m = clearance_m(&body.model.scale, &soles[swing]) - ground_m;
        let met = swinging_s > EARLIEST_LANDING * SWING_S && clear_m < GROUND_M;
        if met || swinging_s >= LATEST_LANDING * SWING_S {
            self.stance = swing;
            self.steps += 1;
            self.time_s = 0.0;
            self.swing.plant(body, self.stance.other());
        }
    }

    /// Returns the torques of both legs for a centre of pressure, an upright trunk and the swinging
    /// foot's path.
    fn carry(
        &self,
        body: &BodyEstimate,
        load: &Load,
        pressure_m: Vector,
        ground_m: f32,
        heading: Rotation,
        yaw_rate_rad_s: f32,
    ) -> LegTorques {
        let pelvis = body.world_from_pelvis();
        let scale = &body.model.scale;
        let lift_m_s2 = (scale.rate_1_s2(LIFT_STIFFNESS_1_S2)
            * (self.height_m + ground_m - pelvis.translation.z)
            - scale.rate_1_s(LIFT_DAMPING_1_S) * body.pelvis_velocity_m_s.z)
            .clamp(LIFT_RANGE[0] * GRAVITY_M_S2, LIFT_RANGE[1] * GRAVITY_M_S2);
        let tilt_rad = rotation_vector_rad(heading * pelvis.rotation.inverse());
        let spin_rad_s = Vector::Z * yaw_rate_rad_s - body.pelvis_angular_velocity_rad_s;
        let turn =
            tilt_rad * scale.rate_1_s2(TRUNK_STIFFNESS_1_S2) + spin_rad_s * scale.rate_1_s(TRUNK_DAMPING_1_S);
        let turn = turn * Vector::new(1.0, 1.0, YAW_PART);
        let most = Vector::splat(scale.rate_1_s2(LARGEST_TURN_RAD_S2));
        let both = self.shifting_s.is_some() || self.time_s < TRANSFER_S;
        let mut feet = Sides::<Acceleration>::default();
        if !both {
            let swing = self.stance.other();
            feet[swing] = self.swing.wanted(body, swing, self.time_s - TRANSFER_S);
        }
        let motion = WantedMotion { lift_m_s2, turn_rad_s2: turn.clamp(-most, most), feet };
        let contact = GroundContact {
            pressure_m: Vector::new(pressure_m.x, pressure_m.y, ground_m),
            foot: (!both).then_some(self.stance),
        };
        leg_torques_within_limits(body, load, &motion, &contact)
    }
}

/// Converts torques to drives, whose springs and dampers add nothing at the measured angle and velocity.
fn drives(body: &BodyEstimate, torques: &LegTorques) -> LegCommand {
    let kd_n_m_s_rad = body.model.scale.damping_n_m_s(KD_N_M_S_RAD);
    Sides::from_fn(|side| {
        std::array::from_fn(|i| {
            let joint = LEGS[side] + i;
            JointDrive {
                target_rad: body.q_rad[joint],
                kp_n_m_rad: body.model.scale.moment_n_m(KP_N_M_RAD),
                kd_n_m_s_rad,
                feedforward_n_m: torques.torque_n_m[side][i] + kd_n_m_s_rad * body.qd_rad_s[joint],
            }
        })
    })
}

/// Returns the required capture point at lift-off of the first foot, as a step that just ended would leave
/// it. Also returns true if the foot lifts now.
fn shift(now: &FootstepInputs) -> (Vector, bool) {
    let scale = now.scale;
    let target_m = now.steady_capture_m(scale.time_s(SWING_S));
    let middle_m = (flat(now.stance.translation) + now.old_m) * 0.5;
    let late = (now.capture_m - middle_m).dot(now.ahead_axis).abs() > scale.along_sole_m(LATEST_M);
    (target_m, late || (target_m - now.capture_m).dot(now.outside_axis) < scale.length_m(SHIFTED_M))
}

/// Returns the height of the lowest point of a sole.
fn clearance_m(scale: &BodyScale, sole: &Pose) -> f32 {
    let corner = |x: f32, y: f32| (*sole * Vector::new(scale.along_sole_m(x), scale.across_sole_m(y), 0.0)).z;
    corner(0.085, 0.03).min(corner(0.085, -0.03)).min(corner(-0.085, 0.025)).min(corner(-0.085, -0.025))
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;
    use crate::body::posed::Posed;

    /// Returns the future facing direction, relative to the heading, of a robot with this spin when the
    /// present swing foot lands.
    fn turn_rad(spin_rad_s: f32, yaw_rate_rad_s: f32, time_s: f32) -> f32 {
        let mut posed = Posed::standing();
        posed.pelvis_angular_velocity_rad_s = Vector::Z * spin_rad_s;
        let body = posed.body();
        let step = Stepping { time_s, ..Stepping::start(&body, 0.3, 0.3, true) };
        let [ahead, left] = step.landing_axes(&body, yaw_rate_rad_s);
        assert!((left - Rotation::from_rotation_z(PI / 2.0) * ahead).length() < 1e-6);
        wrapped_rad(ahead.y.atan2(ahead.x) - 0.3)
    }

    #[test]
    fn a_robot_that_spins_puts_its_foot_where_it_will_face() {
        for (spin_rad_s, yaw_rate_rad_s, time_s, expected_rad) in [
            (0.0, 0.0, 0.0, 0.0),
            (0.9, 0.0, 0.0, 0.0),
            (-0.9, 0.0, 0.0, 0.0),
            (1.4, 0.5, 0.0, 0.0),
            (3.0, 0.0, 0.0, 0.6),
            (-3.0, 0.0, 0.1, -0.4),
            (-3.0, -0.5, 0.1, -0.3),
            (9.0, 0.0, 0.0, LARGEST_SPIN_TURN_RAD),
            (-9.0, 0.0, PERIOD_S, 0.0),
            (-9.0, 0.0, PERIOD_S + 0.05, 0.0),
        ] {
            let turn_rad = turn_rad(spin_rad_s, yaw_rate_rad_s, time_s);
            assert!((turn_rad - expected_rad).abs() < 1e-3, "{spin_rad_s} rad/s, {time_s} s: {turn_rad} rad");
        }
    }
}
