//! A steady gait: where the feet go and where the capture point is when they land.

use rapier3d::math::Vector;

use super::swing::SWING_S;

/// The pressure moves from the old foot to the new one.
pub(super) const TRANSFER_S: f32 = 0.05;
pub(super) const PERIOD_S: f32 = TRANSFER_S + SWING_S;
const WIDTH_M: f32 = 0.25;
/// Walking sideways brings the feet together at every other step.
const WIDENING: f32 = 0.4;
/// Angular momentum of a swinging leg per speed of its foot, over mass times height of the robot.
const SWING_INERTIA: f32 = 0.09;

/// Where the feet and the capture point of a steady gait are, one step ahead, relative to the stance foot.
pub(super) struct Gait {
    pub rate_1_s: f32,
    /// Next foothold.
    pub step_m: Vector,
    /// Capture point relative to that foothold when the foot lands.
    pub offset_m: Vector,
}

impl Gait {
    /// With E = e^{w t}, t the transfer, G = e^{w (T - t)} and K = G (E - 1) / (w t):
    ///   b = v T (1 - E G + K) / (E G - 1)  along the motion,   width (E G + 1 - K) / (E G + 1)  to the inside.
    pub(super) fn new(rate_1_s: f32, velocity_m_s: Vector, outside: Vector) -> Gait {
        let transfer = (rate_1_s * TRANSFER_S).exp();
        let whole = (rate_1_s * PERIOD_S).exp();
        let ramp = whole / transfer * (transfer - 1.0) / (rate_1_s * TRANSFER_S);
        let along_m = velocity_m_s * PERIOD_S;
        let width_m = WIDTH_M + WIDENING * along_m.dot(outside).abs();
        Gait {
            rate_1_s,
            step_m: along_m - outside * width_m,
            offset_m: along_m * ((1.0 - whole + ramp + 2.0 * recoil(rate_1_s, SWING_S)) / (whole - 1.0))
                + outside * (width_m * (whole + 1.0 - ramp) / (whole + 1.0)),
        }
    }

    /// Capture point after `time_s` for a pressure that moves from `now_m` to `then_m` within `ramp_s`.
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

/// A leg that swings by D throws the body back: until the foot lands after `time_s`, the capture point lags by this
/// part of D. From the leg's angular momentum H about the centre of mass,  xi' = w (xi - p) - H / (m h).
pub(super) fn recoil(rate_1_s: f32, time_s: f32) -> f32 {
    SWING_INERTIA * (0.5 * rate_1_s * time_s).exp()
}
