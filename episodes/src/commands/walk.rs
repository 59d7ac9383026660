//! `walk`: the base moves; arms and hands keep their joints.

use tandem_sim::BaseCommand;
use tandem_tools_spec::WalkMove;

use super::columns::Clamped;
use super::motion::{Compliance, Motion};

/// The same base command at every step.
pub struct WalkTrajectory {
    base: BaseCommand,
}

impl WalkTrajectory {
    /// Has `motion` take up what `entry` asks of it.
    pub fn begin(entry: &WalkMove, motion: &mut Motion, clamped: &mut Clamped) -> WalkTrajectory {
        let velocity = [entry.vx_m_s, entry.vy_m_s, entry.yaw_rate_rad_s];
        let base =
            clamped.base(&motion.robot.base_limits, motion.base_asked(velocity, entry.pelvis_height_m));
        motion.keep_joints();
        WalkTrajectory { base }
    }

    /// One control step.
    pub fn advance(&self, motion: &mut Motion) {
        motion.give_way(Compliance::NONE);
        motion.walk(self.base);
    }
}
