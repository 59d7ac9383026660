//! Standing: both feet stay planted, the pelvis holds its place and follows the height command.
//!
//! Each physics step places the pelvis so that the centre of mass stays over the feet, and solves both legs'
//! inverse kinematics for it. It then adds the torques of a virtual spring and damper on centre of mass and
//! trunk, shared by the feet as ground reaction forces. PD and feedforward act through the leg joints alone.

mod ahead;
mod partner;
mod place;

use rapier3d::math::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::effort::ground_force_n;
use super::ground::{FootForce, couple_n, distribute, leg_torques_n_m, middle_m, supported_force_n};
use super::legs::{LegAngles, inverse, rotation_vector_rad};
use super::load::Load;
use crate::body::{BodyEstimate, BodyScale, JOINTS, JointDrive, LEG_JOINTS, LEGS};
use crate::locomotion::LegCommand;
use crate::plane::flat;
use crate::{GRAVITY_M_S2, Side, Sides};

pub(super) use ahead::Ahead;
pub(super) use partner::Partner;
pub(super) use place::StandingPlace;

/// Maximum distance of the centre of mass, loads included, from the middle of the feet before the pelvis
/// shifts.
const COM_ZONE_M: f32 = 0.0435;
/// The same distance for a robot that comes to rest after walking. It settles nearer to its present position.
const RESTING_ZONE_M: f32 = 0.01;
/// Maximum distance of the balance point from the middle of the feet that the feet hold alone; the
/// pelvis leans against the rest of a push. Hands that come down on a table push the robot back, and
/// harder the farther it leans into them: a robot that leaned against every push would run away.
const PUSH_ZONE_M: f32 = 0.03;
/// Extra distance to the sides for a pull that the robot leans ahead of.
const WIDER_ZONE_M: f32 = 0.01;
/// Share of a moment about the vertical that feet pushing in opposite directions hold, for a robot that
/// leans ahead. Each foot holds the rest on its own.
const COUPLE_SHARE: f32 = 0.5;
/// Prediction time for a growing pull, and the maximum extra lean.
const LEAD_S: f32 = 0.4;
const LARGEST_LEAD_M: f32 = 0.08;
const LEAN_RATE_1_S: f32 = 6.0;
/// Distance from the hip's roll axis to the ankle roll link of a sufficiently bent leg. A robot that
/// leans far is lower, because stretched legs cannot hold it.
const LEG_M: f32 = 0.595;
/// Maximum shift ahead and to the sides.
const LARGEST_SHIFT_M: [f32; 2] = [0.2, 0.1];
/// Extra shift to the sides for a robot that leans ahead of pulls.
const FARTHER_ASIDE_M: f32 = 0.025;
/// Dead zone of the lean. Following small changes of the push, the robot would sway forever because of
/// joint friction.
const LEAN_PLAY_M: f32 = 0.01;
const LEANING_TIME_S: f32 = 0.25;
/// Zone of the centre of mass of a robot that holds an object with partners. It is smaller, because the feet
/// have to hold the partners' pull.
const HELD_ZONE_M: f32 = 0.028;
/// Yielding to partners: minimum pull of a shared load on the hands at which a robot moves along the pull,
/// and its speed per newton. Its centre of mass stays in a zone. So pulls between standing robots decay.
const PULLED_N: f32 = 12.0;
const GIVING_WAY_M_S_N: f32 = 0.002;
const GIVING_WAY_ZONE_M: f32 = 0.035;
/// Pelvis height below which the trunk leans forward, so that the hips can go back.
const LEAN_BELOW_M: f32 = 0.70;
const LEAN_RAD_PER_M: f32 = 2.0;
const LARGEST_LEAN_RAD: f32 = 0.5;
const HEIGHT_RATE_M_S: f32 = 0.15;

/// Virtual spring and damper, per kg of robot: horizontal, vertical.
const HORIZONTAL_STIFFNESS_1_S2: f32 = 100.0;
const HORIZONTAL_DAMPING_1_S: f32 = 20.0;
const VERTICAL_STIFFNESS_1_S2: f32 = 80.0;
const VERTICAL_DAMPING_1_S: f32 = 15.0;
const TRUNK_STIFFNESS_N_M_RAD: f32 = 150.0;
const TRUNK_DAMPING_N_M_S_RAD: f32 = 15.0;
/// Maximum ratio of horizontal to vertical force, so that the feet do not slip.
const FRICTION_USED: f32 = 0.53;
const SMALLEST_LOAD_SHARE: f32 = 0.2;

/// Inverse kinematics is warm-started from the last step, so that two iterations are enough.
const IK_ITERATIONS: usize = 2;

/// Rate at which a robot that plants its feet while moving comes to rest over them.
const SETTLING_1_S: f32 = 5.0;
const TILT_SETTLING_TIME_S: f32 = 0.15;

/// A robot with both feet planted; see the module's text.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Stand {
    /// Poses of the ankle roll links at planting, world.
    feet: Sides<Pose>,
    soles: Sides<Pose>,
    /// Rest position of the pelvis; its remaining offset from there, and the rate of the offset, since
    /// planting.
    home_m: Vector,
    offset_m: Vector,
    offset_rate_m_s: Vector,
    tilt: Rotation,
    heading_rad: f32,
    /// Shift of the pelvis against a push, in the heading frame.
    lean_m: Vector,
    lean_rate_m_s: Vector,
    /// Goal of the shift.
    lean_goal_m: Vector,
    height_m: f32,
    q_rad: Sides<LegAngles>,
}

/// Rest posture of a robot that stepped.
pub(super) struct Resting<'a> {
    /// Pelvis relative to the middle of the soles, heading frame.
    pub rest_m: Vector,
    /// True if the pelvis keeps to `rest_m` as in standing, rather than to the middle of the feet.
    pub keeps: bool,
    /// Load against which the robot leans.
    pub load: &'a Load,
}

impl Stand {
    /// Plants the feet at their present poses. If `moving` is `None`, the pelvis stays at its present
    /// position.
    pub(super) fn plant(body: &BodyEstimate, heading_rad: f32, moving: Option<Resting>) -> Stand {
        let pelvis = body.world_from_pelvis();
        let soles = body.world_from_soles();
        let middle_m = middle_m(&soles);
        let heading = Rotation::from_rotation_z(heading_rad);
        let home_m =
            moving.as_ref().map_or(pelvis.translation, |resting| middle_m + heading * resting.rest_m);
        let mut stand = Stand {
            feet: Sides::from_fn(|side| body.world_from_foot(side)),
            soles,
            home_m,
            offset_m: Vector::ZERO,
            offset_rate_m_s: Vector::ZERO,
            tilt: heading.inverse() * pelvis.rotation,
            heading_rad,
            lean_m: Vector::ZERO,
            lean_rate_m_s: Vector::ZERO,
            lean_goal_m: Vector::ZERO,
            height_m: pelvis.translation.z - middle_m.z,
            q_rad: Sides::from_fn(|side| std::array::from_fn(|i| body.q_rad[LEGS[side] + i])),
        };
        if let Some(Resting { load, keeps, .. }) = moving {
            let scale = &body.model.scale;
            let zone_m = if keeps { com_zone_m(load) } else { RESTING_ZONE_M };
            let shift_m = heading * back_into_m(zone_m, scale, stand.weights_m(body, load));
            stand.home_m += shift_m;
            stand.lean_m = stand.against_push_m(scale, stand.weights_m(body, load), load);
            stand.lean_goal_m = stand.lean_m;
            stand.offset_m = flat(pelvis.translation - stand.home_m) - heading * stand.lean_m;
            if keeps {
                // The centre of mass of a robot that has stepped is farther ahead of its pelvis than that of
                // an upright robot. It shifts as the robot straightens.
                stand.home_m -= shift_m;
            }
            stand.offset_rate_m_s = flat(body.com_velocity_m_s);
        }
        stand
    }

    /// Returns the centre of mass, loads included, for a pelvis at its rest position. It is relative to the
    /// middle of the feet, in the heading frame.
    fn weights_m(&self, body: &BodyEstimate, load: &Load) -> Vector {
        let away_m = load.weights_point_m - body.world_from_pelvis().translation;
        Rotation::from_rotation_z(-self.heading_rad) * flat(self.home_m + away_m - middle_m(&self.soles))
    }

    /// Returns the shift of the pelvis against the part of a push that the feet do not hold, with the centre
    /// of mass at `weights_m`. Both are in the heading frame, relative to the middle of the feet.
    fn against_push_m(&self, scale: &BodyScale, weights_m: Vector, load: &Load) -> Vector {
        let push_m = flat(load.balance_point_m - load.weights_point_m);
        let coming_m = (load.balance_point_m_s * scale.time_s(LEAD_S))
            .clamp_length_max(scale.length_m(LARGEST_LEAD_M))
            * load.ahead;
        let balance_m = weights_m + Rotation::from_rotation_z(-self.heading_rad) * (push_m + coming_m);
        let [along_m, aside_m, wider_m] =
            [PUSH_ZONE_M, PUSH_ZONE_M, WIDER_ZONE_M].map(|g1_m| scale.length_m(g1_m));
        let zone_m = Vector::new(along_m, aside_m + wider_m * load.ahead, 0.0);
        let held_m = balance_m.clamp(weights_m.min(-zone_m), weights_m.max(zone_m));
        within_reach_m(held_m - balance_m, scale, load.ahead)
    }

    /// Runs one physics step towards a pelvis height over the soles.
    pub(super) fn tick(
        &mut self,
        body: &BodyEstimate,
        load: &Load,
        height_m: f32,
        dt_s: f32,
    ) -> (LegCommand, Vector) {
        let scale = &body.model.scale;
        let most_m = scale.speed_m_s(HEIGHT_RATE_M_S) * dt_s;
        let rise_m = (height_m - self.height_m).clamp(-most_m, most_m);
        self.height_m += rise_m;
        let settling_1_s = scale.rate_1_s(SETTLING_1_S);
        let pull_m_s2 =
            self.offset_m * (settling_1_s * settling_1_s) + self.offset_rate_m_s * (2.0 * settling_1_s);
        self.offset_rate_m_s -= pull_m_s2 * dt_s;
        self.offset_m += self.offset_rate_m_s * dt_s;
        self.tilt = self.tilt.slerp(Rotation::IDENTITY, dt_s / scale.time_s(TILT_SETTLING_TIME_S));
        let mut goal = self.pelvis_goal(body, load, dt_s);
        goal.velocity_m_s.z = rise_m / dt_s;
        for side in Side::BOTH {
            let leg = &mut self.q_rad[side];
            *leg = inverse(&body.model, side, goal.pose, self.feet[side], leg, IK_ITERATIONS);
        }
        let torques_n_m = balance_torques_n_m(body, load, &goal);
        let gravity_n_m = body.gravity_torques_n_m();
        let legs: LegCommand = Sides::from_fn(|side| {
            std::array::from_fn(|i| {
                let joint = LEGS[side] + i;
                let model = &body.model.joints[joint];
                JointDrive {
                    target_rad: self.q_rad[side][i],
                    kp_n_m_rad: model.kp_n_m_rad,
                    kd_n_m_s_rad: model.kd_n_m_s_rad,
                    feedforward_n_m: gravity_n_m[joint] + torques_n_m[side][i],
                }
            })
        });
        let push_n: Vector =
            Side::BOTH.map(|side| push_n(body, side, &legs[side], &gravity_n_m)).into_iter().sum();
        (legs, flat(push_n / body.model.mass_kg))
    }

    /// Returns the pelvis goal (world) that keeps the centre of mass within [`COM_ZONE_M`] of the middle of
    /// the planted feet. It is as near to the rest position as this and a push allow.
    fn pelvis_goal(&mut self, body: &BodyEstimate, load: &Load, dt_s: f32) -> PelvisGoal {
        let heading = Rotation::from_rotation_z(self.heading_rad);
        let weights_m = self.weights_m(body, load);
        let scale = &body.model.scale;
        let shift_m = back_into_m(com_zone_m(load), scale, weights_m);
        let against_m = self.against_push_m(scale, weights_m + shift_m, load);
        let leaning_m_s2 = self.lean(scale, against_m, load.ahead, dt_s);
        self.home_m += heading * self.giving_way_m(body, load, weights_m + shift_m, dt_s);
        let mut position_m = self.home_m + self.offset_m + heading * (shift_m + self.lean_m);
        position_m.z = middle_m(&self.soles).z + self.height_m;
        position_m.z -= (position_m.z - self.highest_m(body, position_m)).max(0.0) * load.ahead;
        let lower_m = scale.height_m(LEAN_BELOW_M) - self.height_m;
        let lean_rad = (lower_m * scale.per_length(LEAN_RAD_PER_M)).clamp(0.0, LARGEST_LEAN_RAD);
        PelvisGoal {
            pose: Pose::from_parts(position_m, heading * Rotation::from_rotation_y(lean_rad) * self.tilt),
            velocity_m_s: flat(self.offset_rate_m_s + heading * self.lean_rate_m_s),
            acceleration_m_s2: heading * leaning_m_s2,
        }
    }

    /// Returns the displacement, in one physics step, of a robot that yields to its partners along the pull
    /// on its hands. `weights_m` is its centre of mass. Both are in the heading frame.
    fn giving_way_m(&self, body: &BodyEstimate, load: &Load, weights_m: Vector, dt_s: f32) -> Vector {
        let scale = &body.model.scale;
        let pull_n = flat(body.hand_reaction_n.left + body.hand_reaction_n.right);
        let rate_m_s_n = scale.speed_m_s(GIVING_WAY_M_S_N) / scale.force_n(1.0) * load.yield_share;
        let pull_n = pull_n - pull_n.clamp_length_max(scale.force_n(PULLED_N));
        let way_m = Rotation::from_rotation_z(-self.heading_rad) * pull_n * (rate_m_s_n * dt_s);
        let most_m = scale.length_m(GIVING_WAY_ZONE_M);
        let within = |way_m: f32, at_m: f32| {
            let there_m = (at_m + way_m).abs();
            if there_m < most_m || there_m < at_m.abs() { way_m } else { 0.0 }
        };
        Vector::new(within(way_m.x, weights_m.x), within(way_m.y, weights_m.y), 0.0)
    }

    /// Moves the lean towards `wanted_m` for one physics step, without a jerk if it leans ahead of
    /// pulls. Returns its acceleration.
    fn lean(&mut self, scale: &BodyScale, wanted_m: Vector, ahead: f32, dt_s: f32) -> Vector {
        let play_m = scale.length_m(LEAN_PLAY_M);
        if ahead == 0.0 {
            let change_m = wanted_m - self.lean_m;
            self.lean_m +=
                (change_m - change_m.clamp_length_max(play_m)) * (dt_s / scale.time_s(LEANING_TIME_S));
            (self.lean_goal_m, self.lean_rate_m_s) = (self.lean_m, Vector::ZERO);
            return Vector::ZERO;
        }
        let change_m = wanted_m - self.lean_goal_m;
        self.lean_goal_m += change_m - change_m.clamp_length_max(play_m);
        let rate_1_s = scale.rate_1_s(LEAN_RATE_1_S);
        let leaning_m_s2 =
            (self.lean_goal_m - self.lean_m) * (rate_1_s * rate_1_s) - self.lean_rate_m_s * (2.0 * rate_1_s);
        self.lean_rate_m_s += leaning_m_s2 * dt_s;
        self.lean_m += self.lean_rate_m_s * dt_s;
        leaning_m_s2
    }

    /// Returns the height up to which both legs reach with the pelvis over `position_m`.
    fn highest_m(&self, body: &BodyEstimate, position_m: Vector) -> f32 {
        let leg_m = body.model.scale.length_m(LEG_M);
        let pelvis_m = body.world_from_pelvis().translation;
        let height_m = |side: Side| {
            let hip_m = body.joint_axis(body.model.hip(side)).0 - pelvis_m;
            let foot_m = self.feet[side].translation;
            let away_m = flat(position_m + hip_m - foot_m).length().min(0.8 * leg_m);
            foot_m.z - hip_m.z + (leg_m * leg_m - away_m * away_m).sqrt()
        };
        height_m(Side::Left).min(height_m(Side::Right))
    }
}

/// Returns the maximum distance of the centre of mass from the middle of the feet under a load, on a G1.
fn com_zone_m(load: &Load) -> f32 {
    COM_ZONE_M + (HELD_ZONE_M - COM_ZONE_M) * load.yield_share
}

/// Returns the shift that brings a point back into a zone round the middle of the feet.
fn back_into_m(g1_zone_m: f32, scale: &BodyScale, point_m: Vector) -> Vector {
    let zone_m = scale.length_m(g1_zone_m);
    let zone_m = Vector::new(zone_m, zone_m, 0.0);
    within_reach_m(point_m.clamp(-zone_m, zone_m) - point_m, scale, 0.0)
}

fn within_reach_m(shift_m: Vector, scale: &BodyScale, ahead: f32) -> Vector {
    let [forward_m, aside_m] = LARGEST_SHIFT_M.map(|g1_m| scale.length_m(g1_m));
    let most_m = Vector::new(forward_m, aside_m + scale.length_m(FARTHER_ASIDE_M) * ahead, 0.0);
    shift_m.clamp(-most_m, most_m)
}

/// Returns the reaction force of the ground to the drives of one leg.
fn push_n(
    body: &BodyEstimate,
    side: Side,
    drives: &[JointDrive; LEG_JOINTS],
    gravity_n_m: &[f32; JOINTS],
) -> Vector {
    let applied_n_m = std::array::from_fn(|i| {
        let (joint, drive) = (LEGS[side] + i, &drives[i]);
        drive.kp_n_m_rad * (drive.target_rad - body.q_rad[joint]) - drive.kd_n_m_s_rad * body.qd_rad_s[joint]
            + drive.feedforward_n_m
    });
    ground_force_n(body, side, gravity_n_m, &applied_n_m)
}

/// Target pose and motion of the pelvis.
struct PelvisGoal {
    pose: Pose,
    velocity_m_s: Vector,
    acceleration_m_s2: Vector,
}

/// Returns the leg torques of the ground forces that accelerate the centre of mass and right the trunk
/// towards `goal`.
fn balance_torques_n_m(body: &BodyEstimate, load: &Load, goal: &PelvisGoal) -> Sides<[f32; LEG_JOINTS]> {
    let mass_kg = body.model.mass_kg;
    let pelvis = body.world_from_pelvis();
    let error_m = goal.pose.translation - pelvis.translation;
    // The velocity is that of the pelvis, which stays still while arms swing.
    let rate_m_s = goal.velocity_m_s - body.pelvis_velocity_m_s;
    let scale = &body.model.scale;
    let [level_1_s2, upright_1_s2] =
        [HORIZONTAL_STIFFNESS_1_S2, VERTICAL_STIFFNESS_1_S2].map(|g1_1_s2| scale.rate_1_s2(g1_1_s2));
    let [level_1_s, upright_1_s] =
        [HORIZONTAL_DAMPING_1_S, VERTICAL_DAMPING_1_S].map(|g1_1_s| scale.rate_1_s(g1_1_s));
    let acceleration_m_s2 = Vector::new(
        level_1_s2 * error_m.x + level_1_s * rate_m_s.x,
        level_1_s2 * error_m.y + level_1_s * rate_m_s.y,
        upright_1_s2 * error_m.z + upright_1_s * rate_m_s.z,
    );
    let weight_n = mass_kg * GRAVITY_M_S2;
    let mut force_n = (acceleration_m_s2 + goal.acceleration_m_s2) * mass_kg;
    force_n.z = (force_n.z + weight_n).max(SMALLEST_LOAD_SHARE * weight_n);
    let horizontal_n = force_n.x.hypot(force_n.y);
    if horizontal_n > FRICTION_USED * force_n.z {
        let scale = FRICTION_USED * force_n.z / horizontal_n;
        force_n.x *= scale;
        force_n.y *= scale;
    }
    let tilt_rad = rotation_vector_rad(goal.pose.rotation * pelvis.rotation.inverse());
    let moment_n_m = tilt_rad * scale.moment_n_m(TRUNK_STIFFNESS_N_M_RAD)
        - body.pelvis_angular_velocity_rad_s * scale.damping_n_m_s(TRUNK_DAMPING_N_M_S_RAD);
    let soles = body.world_from_soles();
    let ground_force_n =
        supported_force_n(scale, body.com_m, force_n - load.force_n, moment_n_m - load.moment_n_m, soles);
    let feet = distribute(scale, body.com_m, ground_force_n, moment_n_m - load.moment_n_m, soles);
    let turn_n_m = moment_n_m.z - load.moment_n_m.z;
    let couple_share = COUPLE_SHARE * load.ahead;
    let couple_n = couple_n(turn_n_m * couple_share, soles);
    let turning_n_m = Vector::new(0.0, 0.0, turn_n_m * (1.0 - couple_share) * 0.5);
    Sides::from_fn(|side| {
        let foot = FootForce { force_n: feet[side].force_n + couple_n * side.sign(), ..feet[side] };
        leg_torques_n_m(body, side, foot, turning_n_m)
    })
}

#[cfg(test)]
mod tests {
    use super::super::load::LadenRobot;
    use super::super::observer::ObservedPush;
    use super::*;
    use crate::body::posed::Posed;

    #[test]
    fn feet_hold_a_small_push_and_the_pelvis_leans_against_the_rest() {
        let body = Posed::standing().body();
        let stand = Stand::plant(&body, 0.0, None);
        for push_m_s2 in [0.0, 0.2, -0.2, 1.0, -1.0] {
            let push = ObservedPush { acceleration_m_s2: Vector::Y * push_m_s2, ..ObservedPush::default() };
            let load = Load::of(&body, &LadenRobot::of(&body), 0.0, push, 0.0);
            let moved_m = (load.balance_point_m - load.weights_point_m).y;
            let beyond_m = (moved_m.abs() - PUSH_ZONE_M).max(0.0);
            assert_eq!(beyond_m > 0.0, push_m_s2.abs() == 1.0, "{moved_m}");
            let lean_m = stand.against_push_m(&BodyScale::G1, stand.weights_m(&body, &load), &load);
            let expected_m = -moved_m.signum() * beyond_m;
            assert!((lean_m.y - expected_m).abs() < 1e-4 && lean_m.x == 0.0, "{lean_m}, not {expected_m}");
        }
    }

    /// A pull grows by 2 x 25 N in a second. A held object reacts to the lean, so nothing is predicted there.
    #[test]
    fn a_growing_pull_is_leant_against_before_it_is_there() {
        let body = Posed::standing().body();
        let stand = Stand::plant(&body, 0.0, None);
        let lean_m = |ahead: f32, acceleration_m_s2: f32, growth_m_s3: f32| {
            let along = |size: f32| Vector::Y * size;
            let push =
                ObservedPush { acceleration_m_s2: along(acceleration_m_s2), growth_m_s3: along(growth_m_s3) };
            let load = Load::of(&body, &LadenRobot::of(&body), 0.0, push, ahead);
            stand.against_push_m(&BodyScale::G1, stand.weights_m(&body, &load), &load).y
        };
        assert_eq!(lean_m(1.0, 0.3, 0.0), 0.0);
        let earlier_m = lean_m(1.0, 0.3, 1.45);
        assert!((-0.05..-0.03).contains(&earlier_m), "{earlier_m} m");
        assert_eq!(lean_m(0.0, 0.1, 1.45), 0.0);
    }

    /// While a hand holds an object, the lean follows with a delay, and its prediction has no effect.
    #[test]
    fn a_robot_that_holds_something_leans_as_far_as_it_is_pushed_now() {
        let mut stand = Stand::plant(&Posed::standing().body(), 0.0, None);
        let wanted_m = Vector::Y * 0.08;
        for _ in 0..400 {
            assert_eq!(stand.lean(&BodyScale::G1, wanted_m, 0.0, 0.005), Vector::ZERO);
        }
        assert!((stand.lean_m.y - (0.08 - LEAN_PLAY_M)).abs() < 1e-4, "{}", stand.lean_m);
        // When the hand opens, the robot continues from its present lean, at rest.
        let held_m = stand.lean_m;
        let started_m_s2 = stand.lean(&BodyScale::G1, wanted_m, 1.0, 0.005);
        assert!(started_m_s2.length() < 0.01, "{started_m_s2}");
        assert!((stand.lean_m - held_m).length() < 1e-5, "{}, not {held_m}", stand.lean_m);
    }
}
