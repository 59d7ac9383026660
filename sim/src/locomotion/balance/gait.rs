//! A steady gait: its footholds, and the capture point when a foot lands.

use rapier3d::math::Vector;

use super::swing::{AIR_S, SWING_S};
use crate::body::BodyScale;

/// Time in which the pressure moves from the old foot to the new one.
pub(super) const TRANSFER_S: f32 = 0.05;
pub(super) const PERIOD_S: f32 = TRANSFER_S + SWING_S;
const WIDTH_M: f32 = 0.24;
/// Extra width per length of a sideways step: walking sideways brings the feet together at every other step.
const WIDENING: f32 = 0.3;
/// Angular momentum of a swinging leg per speed of its foot, divided by mass and height of the robot; tuned
/// on punches, seeds 2000-3149.
pub(super) const SWING_INERTIA: f32 = 0.09;

/// Feet and capture point of a steady gait, one step ahead, relative to the stance foot.
pub(super) struct Gait {
    pub rate_1_s: f32,
    /// Next foothold.
    pub step_m: Vector,
    /// Capture point relative to that foothold when the foot lands.
    pub offset_m: Vector,
}

impl Gait {
    /// Computes the gait. With E = e^{w t}, t the transfer, G = e^{w (T - t)} and K = G (E - 1) / (w t):
    ///   b = v T (1 - E G + K) / (E G - 1)  along the motion,
    ///   width (E G + 1 - K) / (E G + 1)  to the inside.
    /// The foot that swings 2 v T ahead adds the remainder of s u to the capture point when it lands.
    /// This is 2 v T s e^{w a} with a the time from the middle of its flight: b is smaller by that over
    /// E G - 1. To the sides b is unchanged, because robots that start to walk sideways have no room for
    /// the narrower step.
    pub(super) fn new(scale: &BodyScale, rate_1_s: f32, velocity_m_s: Vector, outside_axis: Vector) -> Gait {
        let [transfer_s, period_s] = [TRANSFER_S, PERIOD_S].map(|g1_s| scale.time_s(g1_s));
        let transfer = (rate_1_s * transfer_s).exp();
        let whole = (rate_1_s * period_s).exp();
        let ramp = whole / transfer * (transfer - 1.0) / (rate_1_s * transfer_s);
        let along_m = velocity_m_s * period_s;
        let ahead_m = along_m - outside_axis * along_m.dot(outside_axis);
        let swung = 2.0 * SWING_INERTIA * (rate_1_s * scale.time_s(SWING_S - 0.5 * AIR_S)).exp();
        let width_m = scale.stance_width_m(WIDTH_M) + WIDENING * along_m.dot(outside_axis).abs();
        Gait {
            rate_1_s,
            step_m: along_m - outside_axis * width_m,
            offset_m: along_m * ((1.0 - whole + ramp) / (whole - 1.0)) - ahead_m * (swung / (whole - 1.0))
                + outside_axis * (width_m * (whole + 1.0 - ramp) / (whole + 1.0)),
        }
    }

    /// Returns the capture point after `time_s` for a pressure that moves from `now_m` to `then_m`
    /// within `ramp_s`. Without a ramp the pressure is at `then_m` already.
    pub(super) fn predict(
        &self,
        capture_m: Vector,
        now_m: Vector,
        then_m: Vector,
        ramp_s: f32,
        time_s: f32,
    ) -> Vector {
        let growth = (self.rate_1_s * ramp_s).exp();
        let mut away_m = (capture_m - now_m) * growth;
        if ramp_s > 1e-4 {
            away_m -= (then_m - now_m) * ((growth - 1.0) / (self.rate_1_s * ramp_s));
        }
        then_m + away_m * (self.rate_1_s * (time_s - ramp_s)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_1_S: f32 = 3.7;

    /// The pressure moves from `now` to `then` within the ramp, in small steps:  xi' = w (xi - p).
    #[test]
    fn prediction_solves_the_capture_point_equation() {
        let gait = Gait::new(&BodyScale::G1, RATE_1_S, Vector::ZERO, Vector::Y);
        let (old_m, then_m) = (Vector::new(-0.1, 0.05, 0.0), Vector::new(0.1, -0.02, 0.0));
        for (now_m, ramp_s, time_s) in [(old_m, 0.05, 0.3), (then_m, 0.0, 0.2), (old_m, 0.02, 0.02)] {
            let mut capture_m = Vector::new(0.03, 0.01, 0.0);
            let predicted_m = gait.predict(capture_m, now_m, then_m, ramp_s, time_s);
            const STEPS: usize = 20_000;
            let dt_s = time_s / STEPS as f32;
            for i in 0..STEPS {
                let part = if ramp_s > 0.0 { ((i as f32 + 0.5) * dt_s / ramp_s).min(1.0) } else { 1.0 };
                let pressure_m = now_m + (then_m - now_m) * part;
                capture_m += (capture_m - pressure_m) * (RATE_1_S * dt_s);
            }
            assert!((capture_m - predicted_m).length() < 1e-3, "{capture_m} {predicted_m}");
        }
    }

    /// If the capture point has the offset of the steady gait at landing, it has it again one step
    /// later, at any velocity.
    #[test]
    fn a_steady_gait_repeats() {
        for (x, y) in [(0.0, 0.0), (0.4, 0.0), (-0.3, 0.0), (0.0, 0.3), (0.2, -0.25)] {
            for outside in [Vector::Y, -Vector::Y] {
                let velocity_m_s = Vector::new(x, y, 0.0);
                let before = Gait::new(&BodyScale::G1, RATE_1_S, velocity_m_s, -outside);
                let gait = Gait::new(&BodyScale::G1, RATE_1_S, velocity_m_s, outside);
                // The stance foot is the origin; the old one is a step behind.
                let old_m = -before.step_m;
                let swung = 2.0 * SWING_INERTIA * (RATE_1_S * (SWING_S - 0.5 * AIR_S)).exp();
                let landing_m = gait.predict(before.offset_m, old_m, Vector::ZERO, TRANSFER_S, PERIOD_S)
                    + Vector::X * (swung * x * PERIOD_S);
                let expected_m = gait.step_m + gait.offset_m;
                assert!((landing_m - expected_m).length() < 1e-4, "{velocity_m_s}: {landing_m} {expected_m}");
                let pace_m_s = (before.step_m + gait.step_m) / (2.0 * PERIOD_S);
                assert!((pace_m_s - velocity_m_s).length() < 1e-5, "two steps go as far as the command");
            }
        }
    }

    #[test]
    fn feet_stay_apart_when_walking_sideways() {
        let inside_m =
            |y: f32| -Gait::new(&BodyScale::G1, RATE_1_S, Vector::new(0.0, y, 0.0), Vector::Y).step_m.y;
        assert!((inside_m(0.0) - WIDTH_M).abs() < 1e-6);
        let narrow_m = inside_m(0.3).min(inside_m(-0.3));
        assert!((narrow_m - (WIDTH_M + (WIDENING - 1.0) * 0.3 * PERIOD_S)).abs() < 1e-6, "{narrow_m}");
    }
}
