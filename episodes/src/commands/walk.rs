//! `walk`: moves the base, and the waist if the command has a target for it; arms and hands keep their
//! joints.

use tandem_sim::{BaseCommand, CONTROL_HZ};
use tandem_tools_spec::WalkMove;

use super::columns::{self, Clamped};
use super::motion::{Compliance, Motion};

/// Maximum yaw rate of the trunk.
const WAIST_RAD_S: f64 = 1.0;

/// The same base command at every step, while the waist turns to its target.
pub struct WalkTrajectory {
    base: BaseCommand,
    /// Angle of the waist at the start, and its target, if it has one.
    from_rad: f64,
    to_rad: Option<f64>,
}

impl WalkTrajectory {
    /// Starts `entry` on `motion`.
    pub fn begin(entry: &WalkMove, motion: &mut Motion, clamped: &mut Clamped) -> WalkTrajectory {
        let velocity = [entry.vx_m_s, entry.vy_m_s, entry.yaw_rate_rad_s];
        let base =
            clamped.base(&motion.robot.base_limits, motion.base_asked(velocity, entry.pelvis_height_m));
        let yaw = columns::waist().start;
        let point_rad = entry.look_at_m.map(|[x_m, y_m, _]| y_m.atan2(x_m));
        let asked_rad = entry.waist_yaw_rad.or(point_rad);
        let to_rad = asked_rad.map(|asked_rad| clamped.joint(&motion.robot.model, yaw, asked_rad));
        motion.keep_joints();
        WalkTrajectory { base, from_rad: motion.state().upper_rad[yaw], to_rad }
    }

    /// Makes one control step.
    pub fn advance(&self, step: u32, motion: &mut Motion) {
        if let Some(to_rad) = self.to_rad {
            let most_rad = WAIST_RAD_S * f64::from(step) / CONTROL_HZ;
            motion.turn_waist(self.from_rad + (to_rad - self.from_rad).clamp(-most_rad, most_rad));
        }
        motion.give_way(Compliance::NONE);
        motion.walk(self.base);
    }
}
