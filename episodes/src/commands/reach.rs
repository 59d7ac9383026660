//! Whether a robot's wrists would reach the poses asked for.

use tandem_ik::FrameError;
use tandem_sim::{Side, Sides};
use tandem_tools_spec::{CheckReach, HandReach, ReachReply};

use super::motion::Motion;
use super::orders::wrist_target;
use super::upper_body::REACH_TOLERANCE;
use crate::convert::rounded;

/// The reply to `check_reach`.
pub fn check_reach(args: &CheckReach, motion: &Motion) -> ReachReply {
    let present = motion.targets();
    let left = wrist_target(args.left_position_m, args.left_quaternion_wxyz, &present.left);
    let right = wrist_target(args.right_position_m, args.right_quaternion_wxyz, &present.right);
    let targets = Sides { left: left.unwrap_or(present.left), right: right.unwrap_or(present.right) };
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
