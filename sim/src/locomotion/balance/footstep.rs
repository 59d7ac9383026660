//! Planning of the remaining part of a step: the present centre of pressure, the foothold of the swinging
//! foot, and the pace.

#[cfg(test)]
mod tests;

use rapier3d::math::{Pose, Vector};

use super::gait::{Gait, PERIOD_S, TRANSFER_S};
use super::swing::Swing;
use crate::body::BodyScale;
use crate::plane::flat;

/// Range of footholds relative to the stance foot, along the heading and to the inside: the feet never cross.
const REACH_M: [f32; 2] = [-0.4, 0.48];
const SPREAD_M: [f32; 2] = [0.08, 0.52];
/// Range of footholds without strain; footholds of sideways walking are within it.
const EASY_REACH_M: [f32; 2] = [-0.22, 0.3];
const EASY_SPREAD_M: [f32; 2] = [0.12, 0.46];
/// Paces to choose from, in addition to the gait's own pace. The capture point diverges exponentially, so a
/// robot that was hit hurries to need a nearer foothold. At twice the pace of the gait the hips saturate as
/// the foot lifts, and it meets the ground 15 cm before its foothold. Tuned on punches at shoulders and
/// elbows, seeds 2000-2159.
const FASTER: [f32; 4] = [1.175, 1.35, 1.525, 1.7];
/// Strain per unit of the pace factor above 1. `MISS` is the strain per distance between the needed foothold
/// and the nearest one within reach.
const HURRY_M: f32 = 0.01;
const MISS: f32 = 0.1;
/// Maximum distance of the centre of pressure from the sole's centre: along and across the foot.
const PRESSURE_M: [f32; 2] = [0.075, 0.018];

/// Inputs of the plan. Vectors are horizontal, in the world frame.
pub(super) struct FootstepInputs<'a> {
    pub scale: &'a BodyScale,
    pub gait: &'a Gait,
    pub swing: &'a Swing,
    pub capture_m: Vector,
    /// Pose of the stance sole, and the centre of the previous stance sole.
    pub stance: Pose,
    pub old_m: Vector,
    pub ahead_axis: Vector,
    pub outside_axis: Vector,
    /// Time since the stance foot landed, at the pace of the G1's gait.
    pub time_s: f32,
}

/// The plan: centre of pressure now, centre of the sole at landing, and pace relative to a G1's gait.
pub(super) struct Footstep {
    pub pressure_m: Vector,
    pub foothold_m: Vector,
    pub pace: f32,
    strain_m: f32,
}

impl FootstepInputs<'_> {
    /// Returns the footstep of the pace with the least strain. A step hurries from its first instant on:
    /// while the pressure moves to the stance foot, the capture point already diverges.
    pub(super) fn plan(&self, dt_s: f32) -> Footstep {
        let faster = if self.time_s < PERIOD_S { &FASTER[..] } else { &[] };
        let gait = self.at_pace(1.0, dt_s);
        faster
            .iter()
            .map(|pace_factor| self.at_pace(*pace_factor, dt_s))
            .fold(gait, |best, next| if next.strain_m < best.strain_m { next } else { best })
    }

    /// Returns the capture point of the steady gait, `remaining_s` before the swinging foot lands.
    pub(super) fn steady_capture_m(&self, remaining_s: f32) -> Vector {
        let gait = self.gait;
        flat(self.stance.translation) + (gait.step_m + gait.offset_m) * (-gait.rate_1_s * remaining_s).exp()
    }

    /// Plans the footstep at `pace_factor` times the pace of this robot's gait.
    fn at_pace(&self, pace_factor: f32, dt_s: f32) -> Footstep {
        let (gait, scale) = (self.gait, self.scale);
        let pace = scale.rate_1_s(pace_factor);
        let stance_m = flat(self.stance.translation);
        let time_s = self.time_s + dt_s * pace;
        let remaining_s = (PERIOD_S - time_s).max(0.0) / pace;
        let [along_m, across_m] = [scale.along_sole_m(PRESSURE_M[0]), scale.across_sole_m(PRESSURE_M[1])];
        let [most_along_m, most_across_m] = scale.ankle_reach_m;
        let most_m = Vector::new(along_m.min(most_along_m), across_m.min(most_across_m), 0.0);
        let correction_m =
            flat(self.stance.rotation.inverse() * (self.capture_m - self.steady_capture_m(remaining_s)));
        let carrying_m = flat(stance_m + self.stance.rotation * correction_m.clamp(-most_m, most_m));
        let pressure_m = self.old_m + (carrying_m - self.old_m) * (time_s / TRANSFER_S).min(1.0);
        let ramp_s = (TRANSFER_S - time_s).max(0.0) / pace;
        let needed_m =
            gait.predict(self.capture_m, pressure_m, carrying_m, ramp_s, remaining_s) - gait.offset_m;
        let possible_m = self.swing.reachable_m(
            scale,
            self.nearest_m(needed_m, REACH_M, SPREAD_M),
            time_s - TRANSFER_S,
            pace,
        );
        let foothold_m = flat(possible_m);
        let easy_m = self.nearest_m(needed_m, EASY_REACH_M, EASY_SPREAD_M);
        let strain_m = (needed_m - easy_m).length()
            + (needed_m - foothold_m).length() * MISS
            + (pace_factor - 1.0) * scale.length_m(HURRY_M);
        Footstep { pressure_m, foothold_m, pace, strain_m }
    }

    /// Returns the foothold nearest to `point_m` within a reach along the heading and a spread to the inside.
    fn nearest_m(&self, point_m: Vector, reach_m: [f32; 2], spread_m: [f32; 2]) -> Vector {
        let reach_m = reach_m.map(|g1_m| self.scale.length_m(g1_m));
        let spread_m = [self.scale.apart_m(spread_m[0]), self.scale.length_m(spread_m[1])];
        let stance_m = flat(self.stance.translation);
        let away_m = point_m - stance_m;
        stance_m + self.ahead_axis * away_m.dot(self.ahead_axis).clamp(reach_m[0], reach_m[1])
            - self.outside_axis * (-away_m.dot(self.outside_axis)).clamp(spread_m[0], spread_m[1])
    }
}
