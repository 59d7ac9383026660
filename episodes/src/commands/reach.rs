//! Whether a robot's wrists would reach the poses asked for.

use tandem_ik::FrameError;
use tandem_sim::Side;
use tandem_tools_spec::{CheckReach, HandReach, ReachReply};

use super::motion::Motion;
use super::orders::wrist_target;
use super::upper_body::REACH_TOLERANCE;
use crate::convert::rounded;

/// The reply to `check_reach`.
pub fn check_reach(args: &CheckReach, motion: &Motion) -> ReachReply {
    let [left, right] = motion.targets();
    let targets = [
        wrist_target(args.left_position_m, args.left_quaternion_wxyz, left).unwrap_or(*left),
        wrist_target(args.right_position_m, args.right_quaternion_wxyz, right).unwrap_or(*right),
    ];
    let (report, joints_at_limit) = motion.reach(&targets);
    let hand = |side: Side| {
        let error = report.errors.get(side.index()).copied().unwrap_or_default();
        HandReach {
            reachable: is_within_reach(&error),
            position_error_m: rounded(error.position_m),
            orientation_error_rad: rounded(error.orientation_rad),
        }
    };
    let (left, right) = (hand(Side::Left), hand(Side::Right));
    let reachable = left.reachable && right.reachable;
    ReachReply { robot: args.robot.clone(), reachable, left, right, joints_at_limit }
}

fn is_within_reach(error: &FrameError) -> bool {
    error.position_m <= REACH_TOLERANCE.position_m && error.orientation_rad <= REACH_TOLERANCE.orientation_rad
}
