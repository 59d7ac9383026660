//! Heading of stepping: where a robot should face, how far it stays behind, and what holds it there when it is pulled.
//!
//! Hands that are pulled sideways turn a robot about the vertical, with up to 9 N m for 15 N at each. A foot that stands alone
//! holds little more against that, and loses some to the leg that swings. Two things help: what the robot stays behind is
//! integrated to an acceleration, so that the feet hold all that they can; and the feet stand staggered. With the foot of one side
//! ahead by d, half a width w from the middle, the ground pushes forward under one foot and back under the other, which turns by
//!   m g / h  d w / 2   in the mean.

use rapier3d::math::{Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::effort::TURN_INERTIA_KG_M2;
use crate::locomotion::plane::wrapped_rad;

/// One foot holds little against turning: a robot that is turned by force gives way, and turns back slowly.
const LEASH_RAD: f32 = 0.3;
const RETURN_RAD_S: f32 = 0.4;
/// The pelvis sways about the vertical with every step: it faces where it points in the mean of this time.
const FACING_TIME_S: f32 = 0.2;
const BIAS_GAIN_1_S3: f32 = 30.0;
const LARGEST_BIAS_RAD_S2: f32 = 12.0;
/// Feet are staggered for what lasts, and not for what arms in motion seem to feel.
const STAGGER_TIME_S: f32 = 0.5;
const DEAD_ZONE_N_M: f32 = 1.0;
const STAGGER_M_PER_N_M: f32 = 0.02;
const LARGEST_STAGGER_M: f32 = 0.12;

/// Angles about the vertical, world frame.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Heading {
    pub(super) wanted_rad: f32,
    /// Where the commands alone would have turned it.
    goal_rad: f32,
    /// How far where the pelvis faces stays behind.
    lag_rad: f32,
    bias_rad_s2: f32,
    /// Mean moment about the vertical that holds the robot.
    holding_n_m: f32,
}

impl Heading {
    pub(super) fn from(wanted_rad: f32) -> Heading {
        Heading { wanted_rad, goal_rad: wanted_rad, lag_rad: 0.0, bias_rad_s2: 0.0, holding_n_m: 0.0 }
    }

    /// One physics step: turns as commanded, within the leash of where the pelvis faces. `load_n_m` turns the robot.
    pub(super) fn turn(&mut self, facing_rad: f32, yaw_rate_rad_s: f32, load_n_m: f32, dt_s: f32) {
        self.goal_rad += yaw_rate_rad_s * dt_s;
        let most_rad = RETURN_RAD_S * dt_s;
        let return_rad = wrapped_rad(self.goal_rad - self.wanted_rad).clamp(-most_rad, most_rad);
        self.wanted_rad += yaw_rate_rad_s * dt_s + return_rad;
        let ahead_rad = wrapped_rad(self.wanted_rad - facing_rad);
        let leashed_rad = ahead_rad.clamp(-LEASH_RAD, LEASH_RAD);
        self.wanted_rad += leashed_rad - ahead_rad;
        self.lag_rad += (leashed_rad - self.lag_rad) * (dt_s / FACING_TIME_S);
        self.bias_rad_s2 = (self.bias_rad_s2 + BIAS_GAIN_1_S3 * leashed_rad * dt_s)
            .clamp(-LARGEST_BIAS_RAD_S2, LARGEST_BIAS_RAD_S2);
        let needed_n_m = TURN_INERTIA_KG_M2 * self.bias_rad_s2 - load_n_m;
        self.holding_n_m += (needed_n_m - self.holding_n_m) * (dt_s / STAGGER_TIME_S);
    }

    pub(super) fn rotation(&self) -> Rotation {
        Rotation::from_rotation_z(self.wanted_rad)
    }

    /// Ahead and left of where the pelvis faces: a velocity is meant along these, and it may stay behind the heading.
    pub(super) fn faced_axes(&self) -> [Vector; 2] {
        let facing = Rotation::from_rotation_z(self.wanted_rad - self.lag_rad);
        [facing * Vector::X, facing * Vector::Y]
    }

    /// Acceleration about the vertical that is asked for beside spring and damper.
    pub(super) fn bias_rad_s2(&self) -> f32 {
        self.bias_rad_s2
    }

    /// How far the left foot should be ahead of the right one.
    pub(super) fn left_ahead_m(&self) -> f32 {
        let lasting_n_m = self.holding_n_m - self.holding_n_m.clamp(-DEAD_ZONE_N_M, DEAD_ZONE_N_M);
        (STAGGER_M_PER_N_M * lasting_n_m).clamp(-LARGEST_STAGGER_M, LARGEST_STAGGER_M)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f32 = 1.0 / 200.0;

    /// A pull that spring and damper would give way to by 0.2 rad is held without a lag in the end, by bias and staggered feet.
    #[test]
    fn a_steady_pull_is_held_at_the_wanted_heading() {
        let (mut heading, mut facing_rad, mut spin_rad_s) = (Heading::from(0.5), 0.5, 0.0);
        let pulled_rad_s2 = -6.0;
        for _ in 0..2000 {
            heading.turn(facing_rad, 0.0, 0.0, DT_S);
            let wanted_rad_s2 = 29.0 * (heading.wanted_rad - facing_rad) - 6.0 * spin_rad_s;
            spin_rad_s += (wanted_rad_s2 + heading.bias_rad_s2() + pulled_rad_s2) * DT_S;
            facing_rad += spin_rad_s * DT_S;
        }
        assert!((facing_rad - 0.5_f32).abs() < 1e-2, "{facing_rad}");
        assert!((heading.bias_rad_s2() + pulled_rad_s2).abs() < 0.1, "{}", heading.bias_rad_s2());
        // A moment to the left is wanted: the left foot goes ahead.
        assert!(heading.left_ahead_m() > 0.05, "{}", heading.left_ahead_m());
    }

    #[test]
    fn who_is_turned_by_force_gives_way_and_knows_where_it_faces() {
        let mut heading = Heading::from(0.0);
        for step in 0..400 {
            heading.turn(-0.002 * step as f32, 0.0, 0.0, DT_S);
        }
        let facing_rad = -0.002 * 399.0_f32;
        assert!((heading.wanted_rad - facing_rad - LEASH_RAD).abs() < 1e-4, "{}", heading.wanted_rad);
        let [ahead, left] = heading.faced_axes();
        assert!(
            (ahead.y.atan2(ahead.x) - facing_rad).abs() < 0.05 && ahead.dot(left).abs() < 1e-6,
            "{ahead}"
        );
    }

    /// What the hands feel is held against before the robot has turned; what is small or soon over moves no foot.
    #[test]
    fn feet_are_staggered_against_what_lasts() {
        let after = |load_n_m: f32, steps: usize| {
            let mut heading = Heading::from(0.0);
            (0..steps).for_each(|_| heading.turn(0.0, 0.0, load_n_m, DT_S));
            heading.left_ahead_m()
        };
        assert_eq!(after(-0.9, 2000), 0.0);
        assert!(after(-4.0, 5) == 0.0 && after(-4.0, 2000) > 0.05 && after(4.0, 2000) < -0.05);
        assert_eq!(after(-50.0, 2000), LARGEST_STAGGER_M);
    }
}
