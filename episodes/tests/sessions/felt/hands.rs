//! Tests of replies on hands and base motion, and of the hand forces during an expert's episode.

use crate::common::*;
use tandem_episodes::players::{self, Episode, InProcess, PlayerError, PrivilegedEpisode};
use tandem_episodes::{A, B, Facts, Session};
use tandem_sim::{Pose, Side, Sides, Vector};
use tandem_tools_spec::{
    Grip, HandReport, HandState, MoveWrists, Pose as WirePose, Protocol, RobotState, ToolCall, ToolReply,
    Walk, WalkMove, WristMove,
};

/// Moves A's right hand in 25 steps, waits `still` steps, and returns the report on it.
fn moved_to(session: &mut Session, position_m: [f64; 3], still: u32) -> HandReport {
    let goal = WristMove { right_position_m: Some(position_m), ..hand_up() };
    let mut reply = command(session, MoveWrists { steps: 25, robots: vec![goal] }.into());
    for _ in 0..still / 50 {
        reply = wait(session, 50);
    }
    reply.robots[0].right.clone()
}

#[test]
fn a_wrist_says_how_it_stands_to_its_target() {
    let mut session = handover(0);
    let up_m = [0.28, -0.24, 0.22];
    let right = moved_to(&mut session, up_m, 0);
    assert_eq!(right.state, Some(HandState::Moving), "{right:?}");
    let right = moved_to(&mut session, up_m, 50);
    let there = Some(HandState::Arrived);
    let fingers = right.fingers.unwrap();
    assert_eq!((right.state, fingers.state), (there, there), "{right:?}");
    assert_eq!(fingers.target_rad, hand_up().right_fingers_rad);
    for (target_rad, measured_rad) in fingers.target_rad.unwrap().into_iter().zip(fingers.measured_rad) {
        assert!((target_rad - measured_rad).abs() < 0.06, "{right:?}");
    }
    let effort = right.largest_effort.as_ref().unwrap();
    assert!(effort.joint.starts_with("right_"), "{right:?}");
    assert!((0.05..0.5).contains(&effort.share), "arms are not weightless: {right:?}");
    assert!(right.force_n.unwrap().iter().all(|part_n| part_n.abs() < 1.5), "it touches nothing: {right:?}");

    // A target inside the counter: its top is 4 cm above the pelvis, as high as half a hand.
    let right = moved_to(&mut session, [0.30, -0.24, 0.05], 100);
    assert_eq!(right.state, Some(HandState::Blocked), "{right:?}");
    assert!(right.force_n.unwrap()[2] > 5.0, "the counter holds it: {right:?}");

    moved_to(&mut session, up_m, 50);
    let right = moved_to(&mut session, [0.2, -1.1, 0.2], 150);
    assert_eq!(right.state, Some(HandState::OutOfReach), "{right:?}");
}

/// Sends `resent` of A's state eight times to its right hand, which holds a bottle of 0.5 kg aloft. Returns by
/// how much the hand has sunk, in metres.
fn sunk_m(resent: impl Fn(&RobotState) -> WirePose) -> f64 {
    let own = spec("handover", 2000, Protocol::Benchmark);
    let mut episode = InProcess::until(1, Session::start(&own, None).unwrap());
    let _ = players::find("expert").unwrap().play(&own, &mut episode);
    let mut session = episode.session;
    let height_m = |session: &Session| {
        let robot = &session.facts().robots[A];
        (robot.pelvis_in_world * robot.wrist_in_pelvis.right).translation.z
    };
    assert!(session.facts().holds(A, Side::Right, "bottle"));
    wait(&mut session, 50);
    let before_m = height_m(&session);
    for _ in 0..8 {
        let WirePose { position_m, quaternion_wxyz } = resent(&state(&mut session, "A"));
        let again = WristMove {
            right_position_m: Some(position_m),
            right_quaternion_wxyz: Some(quaternion_wxyz),
            ..WristMove::hold("A")
        };
        command(&mut session, MoveWrists { steps: 25, robots: vec![again] }.into());
    }
    f64::from(before_m - height_m(&session))
}

#[test]
fn a_hand_is_held_by_its_target_and_sinks_by_its_measured_pose() {
    assert_eq!(
        state(&mut handover(0), "A").right_wrist_target,
        None,
        "an arm without a target keeps its joints"
    );
    let by_target_m = sunk_m(|state| state.right_wrist_target.expect("it has a target"));
    let by_measured_m = sunk_m(|state| state.right_wrist);
    assert!(by_target_m.abs() < 0.003, "{by_target_m} m");
    assert!(by_measured_m > 0.01, "{by_measured_m} m");
}

#[test]
fn those_who_wait_are_told_of_every_robot() {
    let mut session = handover(0);
    let robots: Vec<String> = wait(&mut session, 1).robots.into_iter().map(|robot| robot.robot).collect();
    assert_eq!(robots, ["A", "B"]);
}

#[test]
fn the_way_of_the_base_is_told_by_its_own_odometry() {
    let mut session = handover(0);
    let pelvis = |session: &Session| session.facts().robots[B].pelvis_in_world;
    let heading = |pelvis: &Pose| {
        let ahead = pelvis.rotation * Vector::X;
        Vector::new(ahead.x, ahead.y, 0.0).normalize()
    };
    let began = pelvis(&session);
    let back = WalkMove {
        robot: "B".into(),
        vx_m_s: -0.2,
        vy_m_s: 0.1,
        yaw_rate_rad_s: 0.3,
        pelvis_height_m: None,
        waist_yaw_rad: None,
        look_at_m: None,
    };
    command(&mut session, Walk { steps: 50, robots: vec![back.clone()] }.into());
    let before = pelvis(&session);
    let reply = command(&mut session, Walk { steps: 50, robots: vec![back] }.into());
    let after = pelvis(&session);
    let moved_m = after.translation - before.translation;
    let ahead = heading(&before);
    let expected = [
        moved_m.dot(ahead),
        moved_m.dot(Vector::Z.cross(ahead)),
        moved_m.z,
        ahead.cross(heading(&after)).z.asin(),
    ];
    assert!(expected[0] < -0.05 && expected[3] > 0.1, "it has walked: {expected:?}");
    let told = reply.robots[0].base_motion.unwrap();
    let told = [told.forward_m, told.left_m, told.up_m, told.turned_rad];
    for (told, expected) in told.into_iter().zip(expected) {
        assert!((told - f64::from(expected)).abs() < 0.01, "{told}, not {expected}");
    }
    let in_start = reply.robots[0].pelvis_in_start.unwrap();
    let way_m = heading(&began).dot(after.translation - began.translation);
    assert!((in_start.position_m[0] - f64::from(way_m)).abs() < 0.01, "{in_start:?}, not {way_m} m along x");
    let in_state = state(&mut session, "B").pelvis_in_start.unwrap();
    for (coarse_m, fine_m) in in_start.position_m.iter().zip(in_state.position_m) {
        assert!((coarse_m - fine_m).abs() < 6e-4, "{in_start:?} and {in_state:?}");
    }
}

/// An episode that records the hand forces while A alone holds the bottle in the air.
struct Lifting {
    session: Session,
    /// Forces on the robots' hands at each of these moments.
    felt_n: Vec<Vec<Sides<Vector>>>,
    /// Reports on A's right hand at these moments.
    told: Vec<HandReport>,
}

impl Episode for Lifting {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let reply = self.session.call(call).map_err(|_| PlayerError::EpisodeOver)?;
        let facts = self.session.facts();
        let by_a_alone = facts.holds(A, Side::Right, "bottle") && facts.hands_off(B, "bottle");
        if by_a_alone && facts.lift_m("bottle") > 0.03 {
            self.felt_n.push(facts.robots.iter().map(|robot| robot.hand_force_n).collect());
            if let ToolReply::Act(reply) = &reply {
                self.told.extend(
                    reply.robots.iter().filter(|robot| robot.robot == "A").map(|robot| robot.right.clone()),
                );
            }
        }
        Ok(reply)
    }
}

impl PrivilegedEpisode for Lifting {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        Ok(self.session.facts())
    }
}

/// Forces are estimated from the arm's torques alone, so the bottle's weight must appear on the hand that
/// holds it, and only there.
#[test]
fn a_hand_that_lifts_the_bottle_feels_its_weight() {
    const BOTTLE_N: f32 = 0.5 * 9.81;
    let mut lifting = Lifting { session: handover(1), felt_n: Vec::new(), told: Vec::new() };
    let spec = spec("handover", 1, Protocol::Benchmark);
    players::find("expert").unwrap().play(&spec, &mut lifting).unwrap();
    assert!(lifting.felt_n.len() >= 5, "A held the bottle after {} commands", lifting.felt_n.len());
    for felt_n in &lifting.felt_n {
        let Sides { left: left_n, right: right_n } = felt_n[A];
        assert!((right_n.z + BOTTLE_N).abs() < 0.15 * BOTTLE_N, "the right hand feels {right_n} N");
        assert!(left_n.z.abs() < 0.1 * BOTTLE_N, "the left hand feels {left_n} N");
    }
    assert!(lifting.told.len() >= 5, "A was told of its hand {} times", lifting.told.len());
    for right in &lifting.told {
        assert!((right.force_n.unwrap()[2] + f64::from(BOTTLE_N)).abs() < 0.75, "{right:?}");
        let fingers = right.fingers.and_then(|fingers| fingers.state);
        assert_eq!(fingers, Some(HandState::Blocked), "the bottle is between them: {right:?}");
        assert_eq!(right.grip, Some(Grip::TwoSided), "{right:?}");
    }
    // Only the first moment is checked: later B moves its arms, and their inertia adds to the estimate.
    for force_n in lifting.felt_n[0][B] {
        assert!(force_n.length() < 0.05, "B's hands touch nothing and feel {force_n} N");
    }
}
