//! Short replies for language models: without everything that is as expected.

use tandem_tools_spec::{
    BaseMotion, CommandReply, FingerReport, Grip, HandReport, HandState, LookReply, ManageReply, Pose,
    RobotReport, RobotState, StatusReply, ToolReply,
};

/// Minimum values that are reported: metres and radians, newtons, the fraction of a joint's effort limit.
const MOVED: f64 = 0.01;
const FELT_N: f64 = 1.0;
/// Force that the friction of a free arm may cause.
const HANGING_N: f64 = 6.0;
const HARD_SHARE: f64 = 0.8;

/// Removes from a reply the parts that its caller can do without.
pub fn shorten(reply: &mut ToolReply) {
    match reply {
        ToolReply::Act(reply) => shorten_report(reply),
        ToolReply::Plan(reply) => shorten_report(&mut reply.last),
        ToolReply::Look(LookReply::GetRobotState(state)) => shorten_state(state),
        ToolReply::Manage(ManageReply::GetStatus(StatusReply { fallen, .. })) => {
            fallen.retain(|robot| robot.fallen);
        }
        ToolReply::Look(LookReply::Observe(_) | LookReply::QueryDepth(_) | LookReply::CheckReach(_))
        | ToolReply::Manage(ManageReply::Finish(_))
        | ToolReply::Talk(_) => {}
    }
}

fn shorten_state(state: &mut RobotState) {
    state.joint_positions_rad.0.clear();
    (state.joint_velocities_rad_s, state.joint_torques_n_m) = (None, None);
}

/// Shortens the reply to a command like [`shorten`].
pub fn shorten_report(reply: &mut CommandReply) {
    reply.fallen.retain(|robot| robot.fallen);
    for RobotReport { left, right, base_motion, pelvis_in_start, .. } in &mut reply.robots {
        let is_small = |motion: &BaseMotion| {
            [motion.forward_m, motion.left_m, motion.up_m, motion.turned_rad]
                .iter()
                .all(|part| part.abs() < MOVED)
        };
        *base_motion = base_motion.filter(|motion| !is_small(motion));
        // A robot that has not moved is where it was when the episode began.
        pelvis_in_start.take_if(|pelvis| is_at_start(pelvis));
        shorten_hand(left);
        shorten_hand(right);
    }
}

fn is_at_start(start_from_pelvis: &Pose) -> bool {
    let ([x_m, y_m, _], [w, .., z]) = (start_from_pelvis.position_m, start_from_pelvis.quaternion_wxyz);
    x_m.hypot(y_m) < MOVED && 2.0 * z.atan2(w).abs() < MOVED
}

fn shorten_hand(hand: &mut HandReport) {
    hand.target = None;
    let is_free = hand.state == Some(HandState::Idle) && hand.grip.is_none_or(|grip| grip == Grip::None);
    let felt_n = if is_free { HANGING_N } else { FELT_N };
    if let Some(HandState::Arrived | HandState::Idle) = hand.state {
        hand.measured = None;
        (hand.position_error_m, hand.orientation_error_rad) = (None, None);
        hand.joints_at_limit.clear();
    }
    if let Some(FingerReport { state, target_rad, .. }) = &mut hand.fingers {
        *target_rad = None;
        if *state == Some(HandState::Arrived) {
            hand.fingers = None;
        }
    }
    hand.grip = hand.grip.filter(|grip| *grip != Grip::None);
    hand.largest_effort.take_if(|effort| effort.share < HARD_SHARE || effort.joint.contains("_hand_"));
    hand.force_n.take_if(|force_n| force_n.iter().map(|part| part * part).sum::<f64>().sqrt() < felt_n);
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use tandem_tools_spec::Effort;

    use super::*;

    fn hand(state: &str, force_n: f64) -> HandReport {
        let pose = json!({ "position_m": [0.3, 0.2, 0.1], "quaternion_wxyz": [1, 0, 0, 0] });
        let rad = [0.0; 7];
        let hand = json!({
            "state": state, "grip": "none", "target": pose, "measured": pose, "position_error_m": 0.02,
            "orientation_error_rad": 0.1, "force_n": [0.0, 0.0, force_n],
            "fingers": { "state": "arrived", "target_rad": rad, "measured_rad": rad },
            "largest_effort": { "joint": "right_elbow_joint", "share": 0.3 },
        });
        serde_json::from_value(hand).unwrap()
    }

    #[test]
    fn what_is_as_it_should_be_is_left_out() {
        let left = |mut hand: HandReport| {
            shorten_hand(&mut hand);
            json!(hand)
        };
        for hangs_n in [0.4, 5.0] {
            assert_eq!(left(hand("idle", hangs_n)), json!({ "state": "idle" }));
        }
        assert_eq!(left(hand("idle", 7.0))["force_n"], json!([0.0, 0.0, 7.0]));
        let at_limit = HandReport { joints_at_limit: vec!["right_elbow_joint".into()], ..hand("idle", 0.0) };
        assert_eq!(left(at_limit), json!({ "state": "idle" }));
        assert_eq!(left(hand("arrived", -4.9)), json!({ "state": "arrived", "force_n": [0.0, 0.0, -4.9] }));
        let presses = Effort { joint: "right_hand_thumb_1_joint".into(), share: 1.0 };
        let presses = left(HandReport { largest_effort: Some(presses), ..hand("arrived", -4.9) });
        assert!(presses.get("largest_effort").is_none(), "{presses}");
        let blocked = left(hand("blocked", 9.0));
        assert_eq!((&blocked["position_error_m"], &blocked["target"]), (&json!(0.02), &json!(null)));
        // Without a state that says that the hand is at its target, its pose is reported.
        let untold = left(HandReport { state: None, ..hand("idle", 0.0) });
        assert!(untold["measured"].is_object() && untold["position_error_m"].is_number(), "{untold}");
    }
}
