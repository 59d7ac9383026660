//! Tests of sessions with real physics: repeatability, effects of commands, and costs charged to a policy.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

use crate::common::*;
use tandem_episodes::stress::{Stress, StressAxis, StressLevel};
use tandem_episodes::{A, B, Clock, EpisodeError, EpisodeSpec, RendererKind, Session};
use tandem_sim::Vector;
use tandem_tools_spec::{
    Assistance, Call, CheckReach, DRIVE_ROW_LEN, DepthRow, EndReason, Finish, GetRobotState, JointChunk,
    JointDrives, LookReply, ManageReply, MoveWrists, Observe, PoseFrame, Protocol, QueryDepth,
    SendJointChunk, SendJointDrives, StopReason, ToolCall, ToolReply, Wait, Walk, WalkMove, WristMove,
};

#[test]
fn the_same_seed_and_calls_give_the_same_state_and_others_do_not() {
    let hash_after = |seed| {
        let mut session = handover(seed);
        play(&mut session);
        session.state_hash()
    };
    let first = hash_after(3);
    assert_eq!(first, hash_after(3));
    assert_ne!(first, hash_after(4));
}

#[test]
fn a_wrist_arrives_and_nobody_else_moves() {
    let mut session = handover(0);
    wait(&mut session, 25);
    let partner = state(&mut session, "B");
    command(&mut session, raise_hand(50));
    let reply = command(&mut session, raise_hand(25));
    let right = &reply.robots[0].right;
    assert!(right.position_error_m.unwrap() < 0.01, "{right:?}");
    assert!(right.orientation_error_rad.unwrap() < 0.05, "{right:?}");
    assert!(right.joints_clamped.is_empty() && right.joints_at_limit.is_empty(), "{right:?}");
    let left = &reply.robots[0].left;
    assert!(left.position_error_m.unwrap() < 0.01, "the other hand stays: {left:?}");
    assert_eq!(reply.robots.len(), 1, "only robots that the command names are reported on");
    let finger = state(&mut session, "A").joint_positions_rad.get("right_hand_middle_0_joint").unwrap();
    assert!((finger - 0.6).abs() < 0.05, "finger at {finger} rad");

    let moved = state(&mut session, "B");
    for (before, after) in [(partner.left_wrist, moved.left_wrist), (partner.right_wrist, moved.right_wrist)]
    {
        let apart = Vector::from_array(std::array::from_fn(|axis| {
            (before.position_m[axis] - after.position_m[axis]) as f32
        }));
        assert!(apart.length() < 0.005, "B's wrist moved by {} m", apart.length());
    }
}

/// Walks back from the counter while the right hand has a target in front of the chest.
#[test]
fn walking_leaves_a_hand_where_it_is_and_takes_a_carried_one_along() {
    for carried in [false, true] {
        let mut session = handover(0);
        command(&mut session, raise_hand(50));
        wait(&mut session, 25);
        let pelvis_and_hand_m = |session: &Session| {
            let robot = &session.facts().robots[A];
            let hand = robot.pelvis_in_world * robot.wrist_in_pelvis.right;
            [robot.pelvis_in_world.translation, hand.translation]
        };
        let before_m = pelvis_and_hand_m(&session);
        let back = WristMove { carried: Some(carried), vx_m_s: Some(-0.2), ..hand_up() };
        command(&mut session, MoveWrists { steps: 50, robots: vec![back] }.into());
        let after_m = pelvis_and_hand_m(&session);
        let [walked_m, moved_m] = [after_m[0] - before_m[0], after_m[1] - before_m[1]];
        assert!(walked_m.x < -0.06, "walked {walked_m} m");
        let expected_m = if carried { walked_m } else { Vector::ZERO };
        let off_m = (moved_m - expected_m).length();
        // The arm follows the walking pelvis with a delay of a few control steps.
        let late_m = walked_m.length() / 6.0;
        assert!(off_m < late_m, "carried {carried}: moved {moved_m} m, {off_m} m off; walked {walked_m} m");
    }
}

#[test]
fn a_wrist_that_cannot_arrive_is_reported_short() {
    let mut session = handover(0);
    // A target to the side, free of obstacles.
    let far_m = [0.2, -1.1, 0.2];
    let far = WristMove { right_position_m: Some(far_m), ..WristMove::hold("A") };
    let call = ToolCall::from(MoveWrists { steps: 50, robots: vec![far] });
    command(&mut session, call.clone());
    let reply = command(&mut session, call);
    let right = &reply.robots[0].right;
    assert!(right.position_error_m.unwrap() > 0.2, "{right:?}");
    for (target_m, asked_m) in right.target.unwrap().position_m.into_iter().zip(far_m) {
        assert!(
            (target_m - asked_m).abs() < 0.05,
            "read where the pelvis is now: {target_m} m, not {asked_m} m"
        );
    }
    assert!(!reply.fallen.iter().any(|robot| robot.fallen));
}

#[test]
fn checking_reach_tells_near_from_far_and_moves_nothing() {
    let mut session = handover(0);
    let before = session.state_hash();
    for (position_m, reachable) in [([0.28, -0.24, 0.22], true), ([0.9, -0.2, 0.2], false)] {
        let call = CheckReach {
            robot: "A".into(),
            left_position_m: None,
            left_quaternion_wxyz: None,
            right_position_m: Some(position_m),
            right_quaternion_wxyz: Some([1.0, 0.0, 0.0, 0.0]),
            frame: None,
            keep_waist: None,
        };
        let ToolReply::Look(LookReply::CheckReach(reply)) = session.call(call.into()).unwrap() else {
            panic!("no reach")
        };
        let right = reply.right.unwrap();
        assert_eq!((reply.reachable, right.reachable, reply.left), (reachable, reachable, None), "{reply:?}");
        assert!(reply.joints_at_limit.iter().all(|joint| !joint.starts_with("left")), "{reply:?}");
    }
    assert_eq!(session.state_hash(), before);
}

#[test]
fn height_persists_and_velocities_do_not() {
    let mut session = handover(0);
    let height_m = |session: &Session| f64::from(session.facts().robots[B].pelvis_in_world.translation.z);
    command(&mut session, squat(0.66));
    wait(&mut session, 50);
    wait(&mut session, 50);
    assert!((height_m(&session) - 0.66).abs() < 0.015, "pelvis at {} m", height_m(&session));
    let walk = WalkMove {
        robot: "B".into(),
        vx_m_s: 0.05,
        vy_m_s: 0.0,
        yaw_rate_rad_s: 0.0,
        pelvis_height_m: None,
        waist_yaw_rad: None,
        look_at_m: None,
    };
    command(&mut session, Walk { steps: 2, robots: vec![walk] }.into());
    wait(&mut session, 1);
    let base = state(&mut session, "B").base_command.expect("a command");
    assert_eq!((base.vx_m_s, base.vy_m_s, base.yaw_rate_rad_s), (0.0, 0.0, 0.0));
    assert!((base.pelvis_height_m - 0.66).abs() < 1e-6);
}

#[test]
fn depth_finds_the_bottle_where_it_is() {
    let mut session = handover(2);
    wait(&mut session, 25);
    let facts = session.facts();
    let robot = &facts.robots[A];
    let bottle = facts.object("bottle").pose_in_world;
    let pelvis_from_bottle = robot.pelvis_in_world.inverse() * bottle;
    let label = pelvis_from_bottle * Vector::new(0.0, 0.0, 0.09);

    let ToolReply::Look(LookReply::Observe(seen)) =
        session.call(Observe { robots: Some(vec!["A".into()]), ..Observe::of_all() }.into()).unwrap()
    else {
        panic!("no observation")
    };
    let camera = &seen.cameras[0];
    assert_eq!((camera.width, camera.height, seen.images.len()), (320, 240, 1));
    // Applies the pinhole formula from the reply's description, with the reply's numbers alone.
    let [w, i, j, k] = camera.camera_in_pelvis.quaternion_wxyz.map(|part| part as f32);
    let rotation = tandem_sim::Rotation::from_xyzw(i, j, k, w);
    let origin = Vector::from_array(camera.camera_in_pelvis.position_m.map(|part| part as f32));
    let in_camera = |in_pelvis: Vector| rotation.inverse() * (in_pelvis - origin);
    let aim = in_camera(label);
    let u = f64::from(aim.x / aim.z) * camera.fx + camera.cx;
    let v = f64::from(aim.y / aim.z) * camera.fy + camera.cy;

    let query = QueryDepth {
        robot: "A".into(),
        pixels: Some(vec![[u.round() as i64, v.round() as i64]]),
        region: None,
        fit: false,
        surface: None,
        frame: PoseFrame::Pelvis,
    };
    let ToolReply::Look(LookReply::QueryDepth(reply)) = session.call(query.into()).unwrap() else {
        panic!("no depth")
    };
    let point = Vector::from_array(reply.points[0].point_m().unwrap().map(|part| part as f32));
    let on_bottle = pelvis_from_bottle.inverse() * point;
    let radius_m = on_bottle.x.hypot(on_bottle.y);
    assert!((radius_m - 0.035).abs() < 0.002, "the glass is 3.5 cm from the axis, seen at {radius_m} m");
    assert!(on_bottle.z > 0.09 && on_bottle.z < 0.2, "seen {} m above the base", on_bottle.z);
    let ray = in_camera(point);
    let back =
        [f64::from(ray.x / ray.z) * camera.fx + camera.cx, f64::from(ray.y / ray.z) * camera.fy + camera.cy];
    let DepthRow(u, v, ..) = reply.points[0];
    let off_px = (back[0] - u as f64).hypot(back[1] - v as f64);
    assert!(off_px < 0.2, "point and pixel disagree by {off_px} pixels");
}

#[test]
fn steps_are_charged_and_their_end_ends_the_episode() {
    let mut session = handover(0);
    assert_eq!(status(&mut session).budget.steps_left, 1000);
    let refused = session.call(Wait { steps: 51 }.into()).unwrap_err();
    assert_eq!(refused.to_string(), "51 control steps in one command; the benchmark protocol allows 1 to 50");
    for done in 1..=19 {
        let reply = wait(&mut session, 50);
        assert_eq!((reply.executed_steps, reply.stop_reason), (50, StopReason::StepsDone));
        assert_eq!(reply.budget.steps_left, 1000 - 50 * done);
    }
    wait(&mut session, 30);
    let last = wait(&mut session, 50);
    assert_eq!((last.executed_steps, last.stop_reason), (20, StopReason::StepBudgetExhausted));
    let hash = session.state_hash();
    let refused = session.call(Wait { steps: 1 }.into()).unwrap_err();
    assert!(
        matches!(refused, EpisodeError::Ended { reason: EndReason::StepBudgetExhausted, .. }),
        "{refused}"
    );
    let ToolReply::Manage(ManageReply::Finish(result)) = session.call(Finish {}.into()).unwrap() else {
        panic!("no result")
    };
    assert_eq!((result.ended, result.env_steps), (EndReason::StepBudgetExhausted, 1000));
    assert!(result.phases.0.iter().all(|(_, time_s)| time_s.is_none()), "idling reaches no phase");
    assert_eq!(session.state_hash(), hash);
}

#[test]
fn the_wall_clock_charges_thinking_and_ends_the_episode() {
    let hands_s = Arc::new(AtomicU64::new(0));
    let read = hands_s.clone();
    let clock: Clock = Box::new(move || Duration::from_secs(read.load(Relaxed)));
    let mut session =
        Session::start_with_clock(&spec("handover", 0, Protocol::Agentic), None, clock).unwrap();
    let left = |session: &mut Session| status(session).budget;
    let budget = left(&mut session);
    assert_eq!((budget.steps_left, budget.wall_clock_left_s), (5700, Some(1800.0)), "after the initial hold");
    hands_s.fetch_add(1799, Relaxed);
    assert_eq!(wait(&mut session, 1).budget.wall_clock_left_s, Some(1.0));
    hands_s.fetch_add(1, Relaxed);
    let hash = session.state_hash();
    let refused = session.call(Wait { steps: 1 }.into()).unwrap_err();
    assert!(
        matches!(refused, EpisodeError::Ended { reason: EndReason::WallClockExhausted, .. }),
        "{refused}"
    );
    assert_eq!(status(&mut session).ended, Some(EndReason::WallClockExhausted));
    assert_eq!(session.state_hash(), hash);
}

#[test]
fn a_limit_of_its_own_takes_the_place_of_the_protocols() {
    let hands_s = Arc::new(AtomicU64::new(0));
    let read = hands_s.clone();
    let clock: Clock = Box::new(move || Duration::from_secs(read.load(Relaxed)));
    let own = EpisodeSpec { thinking_limit_s: Some(7200), ..spec("handover", 0, Protocol::Benchmark) };
    let mut session = Session::start_with_clock(&own, None, clock).unwrap();
    hands_s.fetch_add(7199, Relaxed);
    assert_eq!(wait(&mut session, 1).budget.wall_clock_left_s, Some(1.0));
    hands_s.fetch_add(1, Relaxed);
    let refused = session.call(Wait { steps: 1 }.into()).unwrap_err();
    assert!(
        matches!(refused, EpisodeError::Ended { reason: EndReason::WallClockExhausted, .. }),
        "{refused}"
    );
    let named = session.close().departures;
    assert!(named.contains(&"thinking limit: 7200 s".into()), "{named:?}");
}

#[test]
fn an_episode_ends_when_its_policy_has_gone() {
    let ended_after = |protocol: Protocol, thinking_s: u64, idle_s: u64| {
        let hands_s = Arc::new(AtomicU64::new(0));
        let read = hands_s.clone();
        let clock: Clock = Box::new(move || Duration::from_secs(read.load(Relaxed)));
        let mut session = Session::start_with_clock(&spec("handover", 0, protocol), None, clock).unwrap();
        hands_s.fetch_add(thinking_s, Relaxed);
        session.end_if_abandoned(Duration::from_secs(idle_s));
        let ended = session.ended();
        assert_eq!(session.close().ended, ended.unwrap_or(EndReason::Finished));
        ended
    };
    assert_eq!(ended_after(Protocol::Benchmark, 899, 900), None);
    assert_eq!(ended_after(Protocol::Benchmark, 900, 900), Some(EndReason::Abandoned));
    assert_eq!(ended_after(Protocol::Agentic, 1799, 3600), None);
    assert_eq!(ended_after(Protocol::Agentic, 1800, 3600), Some(EndReason::WallClockExhausted));
}

#[test]
fn episodes_go_the_same_way_whoever_draws() {
    let played = |renderer: RendererKind| {
        let spec = EpisodeSpec { renderer, ..spec("handover", 5, Protocol::Benchmark) };
        let mut session = Session::start(&spec, None).unwrap();
        for _ in 0..2 {
            session.call(Observe::of_all().into()).unwrap();
            command(&mut session, raise_hand(10));
        }
        session.close().state_hash
    };
    let hashes = RendererKind::ALL.map(played);
    assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");
}

/// The benchmark's wrist commands have neither `carried` targets nor compliance. Results name commands
/// that use them.
#[test]
fn what_wrist_commands_ask_beyond_the_benchmark_is_named() {
    let told = |entry: WristMove| {
        let mut session = Session::start(&spec("handover", 3, Protocol::Benchmark), None).unwrap();
        command(&mut session, MoveWrists { steps: 2, robots: vec![entry] }.into());
        let named = session.close().departures;
        named.into_iter().filter(|what| what.starts_with("wrist commands: ")).collect::<Vec<_>>()
    };
    assert_eq!(told(hand_up()), [""; 0]);
    assert_eq!(told(WristMove { carried: Some(false), ..hand_up() }), [""; 0]);
    assert_eq!(told(WristMove { carried: Some(true), ..hand_up() }), ["wrist commands: carried"]);
    let compliance = WristMove { compliance_n_s_m: Some(250.0), ..hand_up() };
    assert_eq!(told(compliance), ["wrist commands: compliance"]);
}

/// Degrees instead of radians are the usual mistake.
#[test]
fn joint_targets_beyond_their_limits_are_counted() {
    let told = |arm: f64| {
        let mut session = Session::start(&spec("handover", 3, Protocol::Benchmark), None).unwrap();
        let mut entry = row(&mut session, "A");
        entry[..31].fill(0.0);
        entry[..14].fill(arm);
        let chunk = JointChunk { robot: "A".into(), rows: vec![entry; 4] };
        command(&mut session, SendJointChunk { robots: vec![chunk] }.into());
        session.close().joints_clamped_share
    };
    assert_eq!(told(0.1), None);
    // The 14 arm joints among 31.
    let share = told(0.1_f64.to_degrees()).expect("a share");
    assert!((share - 14.0 / 31.0).abs() < 1e-3, "{share}");
}

/// Returns a command that drives A's motors at its present joints: with gains as LeRobot sends them, or limp.
fn drives(session: &mut Session, steps: usize, gain: f64) -> ToolCall {
    let told = state(session, "A").joint_positions_rad;
    let gains = |name: &str| match name {
        name if name.contains("hand") => [2.0, 0.06],
        name if name.contains("knee") => [300.0, 4.0],
        name if name.contains("shoulder") || name.contains("elbow") || name.contains("wrist") => [80.0, 3.0],
        _ => [250.0, 5.0],
    };
    let joints = || told.0.iter();
    let mut row: Vec<f64> = joints().map(|(_, q_rad)| *q_rad).collect();
    row.extend(joints().map(|_| 0.0));
    row.extend(joints().map(|(name, _)| gain * gains(name)[0]));
    row.extend(joints().map(|(name, _)| gain * gains(name)[1]));
    row.extend(joints().map(|_| 0.0));
    assert_eq!(row.len(), DRIVE_ROW_LEN);
    SendJointDrives { robots: vec![JointDrives { robot: "A".into(), rows: vec![row; steps] }] }.into()
}

/// A caller that drives the motors has to balance the robot. A limp robot falls while all wait. A robot that
/// is handed back in time stands. The partner is unaffected.
#[test]
fn a_robot_whose_motors_are_driven_is_balanced_by_nobody_until_it_is_handed_back() {
    let mut session = handover(2);
    let limp = drives(&mut session, 5, 0.0);
    command(&mut session, limp);
    wait(&mut session, 25);
    let reply = wait(&mut session, 50);
    assert_eq!(reply.fallen.iter().map(|of| of.fallen).collect::<Vec<_>>(), [true, false]);
    let mut session = handover(2);
    let held = drives(&mut session, 10, 1.0);
    let reply = command(&mut session, held);
    assert!(reply.robots[0].base.is_none(), "its controller stands by");
    for _ in 0..4 {
        let reply = command(&mut session, raise_hand(50));
        assert!(reply.fallen.iter().all(|of| !of.fallen) && reply.robots[0].base.is_some());
    }
    let departures = session.close().departures;
    assert!(departures.contains(&"control: joint (A)".to_owned()), "{departures:?}");
}

/// Setpoints cannot be delayed or disturbed as commands are.
#[test]
fn motors_are_not_driven_where_commands_are_executed_otherwise() {
    let stress = Some(Stress { axis: StressAxis::Latency, level: StressLevel::One });
    let spec = EpisodeSpec { stress, ..spec("handover", 2, Protocol::Agentic) };
    let mut session = Session::start(&spec, None).unwrap();
    let held = drives(&mut session, 1, 1.0);
    let refused = session.call(held).unwrap_err().to_string();
    assert!(refused.contains("use send_joint_chunk"), "{refused}");
}

#[test]
fn programs_are_told_the_readings_of_every_physics_step() {
    let read = |assistance: Assistance| {
        let spec = EpisodeSpec { assistance, ..spec("handover", 2, Protocol::Agentic) };
        let mut session = Session::start(&spec, None).unwrap();
        wait(&mut session, 2);
        let call = Call { samples: true, ..Call::from(ToolCall::from(GetRobotState::of("A"))) };
        let ToolReply::Look(LookReply::GetRobotState(state)) = session.ask(None, call).unwrap().reply else {
            panic!("no state")
        };
        (state, session.close().extra_information)
    };
    let (state, shown) = read(Assistance::Full);
    let samples = state.samples.unwrap();
    assert_eq!(samples.joint_positions_rad.len(), 4);
    for (told, (joint, q_rad)) in samples.joint_positions_rad[3].iter().zip(&state.joint_positions_rad.0) {
        assert!((told - q_rad).abs() < 1e-5, "{joint}: {told} {q_rad}");
    }
    assert!(samples.specific_force_m_s2.iter().all(|force| (force[2] - 9.81).abs() < 1.0), "{samples:?}");
    assert!(shown.contains(&"inertial_readings".to_owned()), "{shown:?}");
    let (state, shown) = read(Assistance::Paper);
    assert!(state.samples.is_none() && !shown.contains(&"inertial_readings".to_owned()));
}
