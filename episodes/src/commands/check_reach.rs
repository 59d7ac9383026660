//! `check_reach`: a test of whether a robot's wrists would reach given poses.

use tandem_ik::{FrameError, Tolerance};
use tandem_sim::Sides;
use tandem_tools_spec::{CheckReach, HandReach, ReachReply};

use super::motion::{Motion, Reach};
use super::move_wrists::wrist_targets;
use crate::convert::coarse;

/// Returns the reply to `check_reach`.
pub fn check_reach(args: &CheckReach, motion: &Motion) -> ReachReply {
    let halves = Sides {
        left: (args.left_position_m, args.left_quaternion_wxyz),
        right: (args.right_position_m, args.right_quaternion_wxyz),
    };
    let targets = wrist_targets(halves, args.frame.unwrap_or_default(), motion);
    let Reach { errors, joints_at_limit, has_to_step } =
        motion.reach(&targets, args.keep_waist.unwrap_or(false));
    let hands = Sides::from_fn(|side| errors[side].map(|error| hand_reach(error, &motion.tolerance(side))));
    ReachReply {
        robot: args.robot.clone(),
        reachable: hands.iter().flatten().all(|hand| hand.reachable),
        left: hands.left,
        right: hands.right,
        needs_a_step: has_to_step,
        joints_at_limit,
    }
}

fn hand_reach(error: FrameError, tolerance: &Tolerance) -> HandReach {
    HandReach {
        reachable: tolerance.accepts(&error),
        position_error_m: coarse(error.position_m),
        orientation_error_rad: coarse(error.orientation_rad),
    }
}
