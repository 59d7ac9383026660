//! Position loop around a velocity policy: keeps the robot at the place to which its commands would have
//! moved it.
//!
//! A velocity policy ignores commands below 0.1 m/s, walks slower than commanded and creeps while it
//! settles. A reference place moves with the command. While the robot is commanded to move, or has
//! strayed, the policy receives
//!   v = v_command + k e + k/2 int(e dt),   e: reference minus pelvis, in the pelvis's heading frame [m].

use std::f32::consts::PI;

use rapier3d::math::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

use crate::plane::{heading_rad, wrapped_rad};

const GAIN_1_S: f32 = 1.5;
const INTEGRAL_1_S: f32 = 0.5 * GAIN_1_S;
/// Errors above which a standing robot begins to correct, and (`BACK_M`, `BACK_RAD`) below which it stops.
const STRAYED_M: f32 = 0.10;
const STRAYED_RAD: f32 = 0.15;
const BACK_M: f32 = 0.04;
const BACK_RAD: f32 = 0.06;
/// Maximum distance of the reference ahead of the robot, so that a robot that was held up does not rush
/// once free.
const LEASH_M: f32 = 0.3;
const LEASH_RAD: f32 = 0.5;
/// Maximum contribution of the integral, forward and left.
const LARGEST_INTEGRAL_M_S: [f32; 2] = [0.5, 0.3];
/// Limits of the velocity sent to the policy: forward, left, turning.
const SMALLEST_COMMAND: [f32; 3] = [-0.6, -0.4, -0.8];
const LARGEST_COMMAND: [f32; 3] = [0.8, 0.4, 0.8];

/// Reference pose, which the commands move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ReferencePlace {
    position_m: [f32; 2],
    heading_rad: f32,
    integral_m_s: [f32; 2],
    moving: bool,
    correcting: bool,
}

impl ReferencePlace {
    /// Creates a reference at the pelvis.
    pub(super) fn of(world_from_pelvis: Pose) -> ReferencePlace {
        let at = world_from_pelvis.translation;
        ReferencePlace {
            position_m: [at.x, at.y],
            heading_rad: heading_rad(&world_from_pelvis),
            integral_m_s: [0.0; 2],
            moving: false,
            correcting: false,
        }
    }

    /// Moves the reference by a command (forward m/s, left m/s, turning rad/s). Returns the velocity at which
    /// the robot keeps up with the reference.
    pub(super) fn follow(&mut self, world_from_pelvis: Pose, command: [f32; 3], dt_s: f32) -> [f32; 3] {
        let moving = command != [0.0; 3];
        let (leash_m, leash_rad) = if moving { (LEASH_M, LEASH_RAD) } else { (f32::MAX, PI) };
        let heading_now_rad = heading_rad(&world_from_pelvis);
        self.heading_rad += command[2] * dt_s;
        let turned_rad = wrapped_rad(self.heading_rad - heading_now_rad).clamp(-leash_rad, leash_rad);
        self.heading_rad = heading_now_rad + turned_rad;
        let along = Rotation::from_rotation_z(self.heading_rad) * Vector::new(command[0], command[1], 0.0);
        let [x, y] = self.position_m;
        let here = world_from_pelvis.translation;
        let away_m = Vector::new(x + along.x * dt_s - here.x, y + along.y * dt_s - here.y, 0.0)
            .clamp_length_max(leash_m);
        self.position_m = [here.x + away_m.x, here.y + away_m.y];

        let distance_m = away_m.length();
        if moving {
            self.correcting = false;
        } else if distance_m > STRAYED_M || turned_rad.abs() > STRAYED_RAD {
            self.correcting = true;
        } else if distance_m < BACK_M && turned_rad.abs() < BACK_RAD {
            self.correcting = false;
        }
        // The integral that compensated slow walking would carry a robot past its stop.
        if moving != self.moving || !(moving || self.correcting) {
            self.integral_m_s = [0.0; 2];
        }
        self.moving = moving;
        if !(moving || self.correcting) {
            return command;
        }
        let error_m = Rotation::from_rotation_z(-heading_now_rad) * away_m;
        let mut told = command;
        for (i, error_m) in [error_m.x, error_m.y].into_iter().enumerate() {
            let most = LARGEST_INTEGRAL_M_S[i];
            self.integral_m_s[i] = (self.integral_m_s[i] + INTEGRAL_1_S * error_m * dt_s).clamp(-most, most);
            told[i] += GAIN_1_S * error_m + self.integral_m_s[i];
        }
        told[2] += GAIN_1_S * turned_rad;
        std::array::from_fn(|i| told[i].clamp(SMALLEST_COMMAND[i], LARGEST_COMMAND[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f32 = 0.02;

    fn at(x: f32, y: f32, heading_rad: f32) -> Pose {
        Pose::from_parts(Vector::new(x, y, 0.75), Rotation::from_rotation_z(heading_rad))
    }

    #[test]
    fn a_standing_robot_corrects_only_what_is_far() {
        let mut place = ReferencePlace::of(at(0.0, 0.0, 0.0));
        for (pose, [forward, left, turning]) in [
            (at(0.08, 0.0, 0.0), [0.0, 0.0, 0.0]),
            (at(0.12, 0.0, 0.0), [-1.0, 0.0, 0.0]),
            (at(0.06, 0.0, 0.0), [-1.0, 0.0, 0.0]),
            (at(0.03, 0.0, 0.0), [0.0, 0.0, 0.0]),
            (at(0.0, -0.12, PI / 2.0), [1.0, 0.0, -1.0]),
        ] {
            let told = place
                .follow(pose, [0.0; 3], DT_S)
                .map(|part| if part.abs() < 1e-3 { 0.0 } else { part.signum() });
            assert_eq!(told, [forward, left, turning], "at {pose:?}");
        }
    }

    #[test]
    fn a_slow_robot_is_told_to_hurry_but_the_reference_stays_near() {
        let mut place = ReferencePlace::of(at(0.0, 0.0, 0.0));
        let mut told = [0.0; 3];
        for _ in 0..200 {
            told = place.follow(at(0.0, 0.0, 0.0), [0.3, 0.0, 0.0], DT_S);
        }
        assert_eq!(told[0], LARGEST_COMMAND[0]);
        assert!((place.position_m[0] - LEASH_M).abs() < 1e-5, "{place:?}");
        // A robot pushed away while it stands comes back from any distance.
        let told = place.follow(at(2.0, 0.0, 0.0), [0.0; 3], DT_S);
        assert_eq!(told[0], SMALLEST_COMMAND[0]);
        assert!((place.position_m[0] - LEASH_M).abs() < 1e-5, "{place:?}");
    }
}
