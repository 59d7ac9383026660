//! The swing foot: a minimum-jerk path, replanned at each instant to the present foothold.

#[cfg(test)]
mod tests;

use rapier3d::math::{Pose, Vector};
use serde::{Deserialize, Serialize};

use super::legs::rotation_vector_rad;
use crate::Side;
use crate::body::{Acceleration, BodyEstimate, BodyScale, LEG_JOINTS, LEGS};

pub(super) const SWING_S: f32 = 0.25;
/// Time in the air: the foot is down a little before the step ends.
pub(super) const AIR_S: f32 = 0.93 * SWING_S;
const HEIGHT_M: f32 = 0.044;
/// Downward speed of a foot that has not yet met the ground.
const PROBING_M_S: f32 = 0.25;
/// Remaining time below which the goal is fixed.
const MIN_REMAINING_S: f32 = 0.03;
const LARGEST_ACCELERATION_M_S2: f32 = 60.0;
/// Maximum displacement of a foot at rest in the time T, divided by T^2.
const REACH_M_S2: f32 = 14.0;
const STIFFNESS_1_S2: f32 = 300.0;
const DAMPING_1_S: f32 = 35.0;

/// Path of the ankle roll link, world frame.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct Swing {
    from: Pose,
    to: Pose,
    /// The path along the ground, without the lift.
    position_m: Vector,
    velocity_m_s: Vector,
    acceleration_m_s2: Vector,
    /// Pace relative to the gait.
    pace: f32,
}

impl Swing {
    /// Plants the foot; its next swing starts from the present pose.
    pub(super) fn plant(&mut self, body: &BodyEstimate, side: Side) {
        *self = Swing::at(body.world_from_foot(side));
    }

    /// Creates the state of a planted foot.
    pub(super) fn at(foot: Pose) -> Swing {
        Swing { from: foot, to: foot, position_m: foot.translation, pace: 1.0, ..Swing::default() }
    }

    /// Moves one physics step along the path to `goal`, `time_s` (at the pace of the gait) after
    /// lift-off. The minimum-jerk path leads from position x, velocity v, acceleration a to rest at x1
    /// in T. Its jerk is  60 (x1 - x) / T^3 - 36 v / T^2 - 9 a / T.
    pub(super) fn advance(&mut self, goal: Pose, time_s: f32, pace: f32, dt_s: f32) {
        if time_s <= 0.0 {
            return;
        }
        self.pace = pace;
        let remaining_s = (AIR_S - time_s) / pace;
        if remaining_s > MIN_REMAINING_S {
            self.to = goal;
        }
        let remaining_s = remaining_s.max(MIN_REMAINING_S);
        let jerk_m_s3 = (self.to.translation - self.position_m) * (60.0 / remaining_s.powi(3))
            - self.velocity_m_s * (36.0 / (remaining_s * remaining_s))
            - self.acceleration_m_s2 * (9.0 / remaining_s);
        self.acceleration_m_s2 =
            (self.acceleration_m_s2 + jerk_m_s3 * dt_s).clamp_length_max(LARGEST_ACCELERATION_M_S2);
        self.velocity_m_s += self.acceleration_m_s2 * dt_s;
        self.position_m += self.velocity_m_s * dt_s;
    }

    /// Returns the point nearest to `sole_m` where the sole can come to rest in time. The minimum-jerk path
    /// starts without jerk if it ends at
    ///   x + 0.6 v T + 0.15 a T^2.
    pub(super) fn reachable_m(&self, scale: &BodyScale, sole_m: Vector, time_s: f32, pace: f32) -> Vector {
        let remaining_s = ((AIR_S - time_s) / pace).max(0.0);
        let resting_m = self.sole_m(scale)
            + self.velocity_m_s * (0.6 * remaining_s)
            + self.acceleration_m_s2 * (0.15 * remaining_s * remaining_s);
        let mut change_m = sole_m - resting_m;
        change_m.z = 0.0;
        sole_m - change_m + change_m.clamp_length_max(REACH_M_S2 * remaining_s * remaining_s)
    }

    /// Returns the sole's centre on its path, without the lift.
    pub(super) fn sole_m(&self, scale: &BodyScale) -> Vector {
        self.position_m + self.from.rotation * scale.sole_in_foot_m
    }

    /// Returns the goal of the ankle roll link.
    pub(super) fn goal_m(&self) -> Vector {
        self.to.translation
    }

    /// Returns the acceleration of the foot that keeps it on its path.
    pub(super) fn wanted(&self, body: &BodyEstimate, side: Side, time_s: f32) -> Acceleration {
        let (foot, speed_m_s, spin_rad_s) = foot_motion(body, side);
        let p = (time_s / AIR_S).clamp(0.0, 1.0);
        let scale = &body.model.scale;
        let [lift_m, lift_m_s, lift_m_s2] = lift(time_s).map(|g1_m| scale.length_m(g1_m));
        let lift_m_s = lift_m_s * self.pace;
        let lift_m_s2 = lift_m_s2 * (self.pace * self.pace);
        let position_m = self.position_m + Vector::Z * lift_m;
        let velocity_m_s = self.velocity_m_s + Vector::Z * lift_m_s;
        let smooth = p * p * p * (10.0 - 15.0 * p + 6.0 * p * p);
        let rotation = self.from.rotation.slerp(self.to.rotation, smooth);
        let turn_rad = rotation_vector_rad(rotation * foot.rotation.inverse());
        let (stiffness_1_s2, damping_1_s) = (scale.rate_1_s2(STIFFNESS_1_S2), scale.rate_1_s(DAMPING_1_S));
        Acceleration {
            linear_m_s2: self.acceleration_m_s2
                + Vector::Z * lift_m_s2
                + (position_m - foot.translation) * stiffness_1_s2
                + (velocity_m_s - speed_m_s) * damping_1_s,
            angular_rad_s2: turn_rad * stiffness_1_s2 - spin_rad_s * damping_1_s,
        }
    }
}

/// Returns the height over the path along the ground, `time_s` after lift-off, with its first and second
/// derivative:
///   16 h p^2 (1 - p)^2,   p = t / T;   after T downward, until the foot meets the ground.
fn lift(time_s: f32) -> [f32; 3] {
    if time_s > AIR_S {
        return [PROBING_M_S * (AIR_S - time_s), -PROBING_M_S, 0.0];
    }
    let p = (time_s / AIR_S).clamp(0.0, 1.0);
    [
        16.0 * HEIGHT_M * (p * (1.0 - p)).powi(2),
        32.0 * HEIGHT_M * p * (1.0 - p) * (1.0 - 2.0 * p) / AIR_S,
        HEIGHT_M * (32.0 - 192.0 * p + 192.0 * p * p) / (AIR_S * AIR_S),
    ]
}

/// Returns pose, velocity and angular velocity of an ankle roll link, world frame.
pub(super) fn foot_motion(body: &BodyEstimate, side: Side) -> (Pose, Vector, Vector) {
    let first = LEGS[side];
    let foot = body.world_from_foot(side);
    let mut spin_rad_s = body.pelvis_angular_velocity_rad_s;
    let from_pelvis_m = foot.translation - body.world_from_pelvis().translation;
    let mut speed_m_s = body.pelvis_velocity_m_s + spin_rad_s.cross(from_pelvis_m);
    for joint in first..first + LEG_JOINTS {
        let (origin, axis) = body.joint_axis(joint);
        let turn = axis * body.qd_rad_s[joint];
        speed_m_s += turn.cross(foot.translation - origin);
        spin_rad_s += turn;
    }
    (foot, speed_m_s, spin_rad_s)
}
