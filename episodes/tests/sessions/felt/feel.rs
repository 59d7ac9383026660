//! Tests of the sensed states of hands and base in replies, against the simulator.

use crate::common::*;
use tandem_episodes::players::{self, Episode, PlayerError, PrivilegedEpisode};
use tandem_episodes::{A, B, Facts, Grip as Truth, Session};
use tandem_sim::{Side, Vector};
use tandem_tools_spec::{
    Assistance, BaseState, Call, GetRobotState, Grip, HandState, LookReply, MoveWrists, Observe, PoseFrame,
    Protocol, ToolCall, ToolReply, Touch, Walk, WalkMove, WristMove,
};

/// An episode that compares each hand's reported grip with its contacts.
struct Gripping {
    session: Session,
    /// Number of reports by case: holding and reported; holding but not reported; reported but not
    /// holding; neither.
    counts: [u32; 4],
    wrong: Vec<String>,
}

impl Episode for Gripping {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let reply = self.session.call(call).map_err(|_| PlayerError::EpisodeOver)?;
        let facts = self.session.facts();
        let ToolReply::Act(command) = &reply else { return Ok(reply) };
        for report in &command.robots {
            let robot = ["A", "B", "C"].iter().position(|name| *name == report.robot).expect("a robot");
            for (side, hand) in [(Side::Left, &report.left), (Side::Right, &report.right)] {
                let holds = facts.objects.iter().any(|object| object.hands[robot][side] == Truth::Holding);
                let told = hand.grip == Some(Grip::TwoSided);
                let case = match (holds, told) {
                    (true, true) => 0,
                    (true, false) => 1,
                    (false, true) => 2,
                    (false, false) => 3,
                };
                self.counts[case] += 1;
                if holds != told {
                    let object = facts.objects.iter().map(|object| (&object.name, object.hands[robot][side]));
                    self.wrong.push(format!(
                        "{} {side:?} {:?}: {hand:?}",
                        report.robot,
                        object.collect::<Vec<_>>()
                    ));
                }
            }
        }
        Ok(reply)
    }
}

impl PrivilegedEpisode for Gripping {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        Ok(self.session.facts())
    }
}

/// Tasks with a different grip each. A report matches the contacts, except for moments in which a hand
/// closes or opens.
#[test]
fn hands_feel_that_they_hold() {
    for task in ["handover", "co_carry", "big_table", "trash_collection", "cart_service"] {
        let spec = spec(task, 2011, Protocol::Benchmark);
        let session = Session::start(&spec, None).unwrap();
        let mut episode = Gripping { session, counts: [0; 4], wrong: Vec::new() };
        players::find("expert").unwrap().play(&spec, &mut episode).unwrap();
        let [both, silent, only_told, neither] = episode.counts;
        let wrong = || episode.wrong.join("\n");
        println!("{task}: {:?}\n{}", episode.counts, wrong());
        assert!(both >= 8 && neither >= 8, "{task}: {:?}", episode.counts);
        assert!(f64::from(silent + only_told) < 0.06 * f64::from(both + neither), "{task}: {}", wrong());
    }
}

fn right_hand(session: &mut Session, entry: WristMove) -> tandem_tools_spec::RobotReport {
    let call = MoveWrists { steps: 50, robots: vec![entry] };
    command(session, call.clone().into());
    command(session, call.into()).robots.remove(0)
}

#[test]
fn a_thumb_on_its_own_palm_holds_nothing() {
    let mut session = handover(2011);
    let shaped = |fingers_rad: [f64; 7]| WristMove {
        right_position_m: Some([0.15, -0.3, 0.25]),
        right_fingers_rad: Some(fingers_rad),
        ..WristMove::hold("A")
    };
    let open = right_hand(&mut session, shaped([0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0]));
    assert_eq!((open.right.grip, open.right.touches), (Some(Grip::None), None), "{open:?}");
    let closed = right_hand(&mut session, shaped([0.0, -1.04, -1.74, 0.3, 0.2, 0.3, 0.2]));
    assert_eq!(
        (closed.right.grip, closed.right.touches),
        (Some(Grip::None), Some(Touch::Itself)),
        "{closed:?}"
    );
    assert_eq!(
        (closed.left.state, closed.left.grip),
        (Some(HandState::Idle), Some(Grip::None)),
        "{closed:?}"
    );
}

#[test]
fn a_base_says_what_it_does_and_where_it_will_rest() {
    let mut session = handover(2011);
    let back = |v: f64| Walk {
        steps: 50,
        robots: vec![WalkMove {
            robot: "B".into(),
            vx_m_s: v,
            vy_m_s: 0.0,
            yaw_rate_rad_s: 0.0,
            pelvis_height_m: None,
            waist_yaw_rad: None,
            look_at_m: None,
        }],
    };
    let standing = wait(&mut session, 5).robots[B].base.unwrap();
    assert_eq!((standing.state, standing.comes_to_rest_m), (Some(BaseState::Standing), None));
    assert!((standing.pelvis_height_m - 0.76).abs() < 0.005 && standing.commanded_height_m.is_none());
    command(&mut session, back(-0.2).into());
    let walking = command(&mut session, back(-0.2).into()).robots[0].base.unwrap();
    assert_eq!(walking.state, Some(BaseState::Stepping));
    assert!(walking.pelvis_height_m < 0.69 && walking.commanded_height_m.is_some(), "{walking:?}");
    let settling = wait(&mut session, 5).robots[B].base.unwrap();
    assert_eq!(settling.state, Some(BaseState::Settling));
    let mut stands_after = 0;
    loop {
        let base = wait(&mut session, 2).robots[B].base.unwrap();
        stands_after += 1;
        assert!(stands_after < 75, "it never stands: {base:?}");
        if base.state == Some(BaseState::Standing) {
            // An observation at this moment is not taken from a rising pelvis.
            assert!((base.pelvis_height_m - 0.76).abs() < 0.021, "{base:?}");
            break;
        }
        assert_eq!(base.state, Some(BaseState::Settling));
    }
    for _ in 0..4 {
        wait(&mut session, 50);
    }
    let rested = wait(&mut session, 1).robots.remove(B);
    assert_eq!(rested.base.unwrap().state, Some(BaseState::Standing));
    let rests_m = rested.pelvis_in_start.unwrap().position_m;
    for told in [walking, settling] {
        let [x_m, y_m] = told.comes_to_rest_m.unwrap();
        let off_m = (x_m - rests_m[0]).hypot(y_m - rests_m[1]);
        assert!(off_m < 0.03, "{off_m} m off: {told:?}, and it rests at {rests_m:?}");
    }
    assert_eq!(session.facts().robots.len(), 2);
}

/// Both arms far ahead make a robot step by their weight; one arm does not. `check_reach` predicts the
/// step, and the reply reports it.
#[test]
fn a_reach_says_whether_it_takes_a_step() {
    for (reach_m, height_m, hands, steps) in [
        (0.30, 0.15, 2, false),
        (0.40, 0.15, 1, false),
        (0.45, 0.35, 1, false),
        (0.40, 0.15, 2, true),
        (0.36, 0.35, 2, true),
    ] {
        let mut session = start("co_carry", 2012, Protocol::Agentic);
        let pose = serde_json::json!({
            "robot": "B", "right_position_m": [reach_m, -0.15, height_m], "right_quaternion_wxyz": [1, 0, 0, 0],
            "left_position_m": if hands == 2 { Some([reach_m, 0.15, height_m]) } else { None },
            "left_quaternion_wxyz": if hands == 2 { Some([1, 0, 0, 0]) } else { None },
        });
        let ask = |session: &mut Session, tool: &str, args: serde_json::Value| {
            serde_json::json!(session.ask(None, Call::parse(tool, args).unwrap()).unwrap().reply)
        };
        let reach = ask(&mut session, "check_reach", pose.clone());
        let mut stepped = false;
        for _ in 0..3 {
            let args = serde_json::json!({ "steps": 25, "robots": [pose.clone()] });
            stepped |= ask(&mut session, "move_wrists", args)["robots"][0]["base"]["stepped"] == true;
        }
        let case = format!("{hands} hands at {reach_m} m: {reach}");
        assert_eq!(reach["needs_a_step"] == true, steps, "{case}");
        assert_eq!(stepped, steps, "{case}");
    }
}

/// With `stand_fast`, hands that reach too far stop before the robot has to step.
#[test]
fn a_robot_that_is_to_stand_fast_stops_before_it_has_to_step() {
    for stands_fast in [false, true] {
        let mut session = start("co_carry", 2012, Protocol::Agentic);
        let mut last = serde_json::Value::Null;
        let mut stepped = false;
        for _ in 0..4 {
            let args = serde_json::json!({ "steps": 25, "robots": [{
                "robot": "B", "stand_fast": stands_fast,
                "right_position_m": [0.42, -0.15, 0.15], "right_quaternion_wxyz": [1, 0, 0, 0],
                "left_position_m": [0.42, 0.15, 0.15], "left_quaternion_wxyz": [1, 0, 0, 0],
            }] });
            let reply = session.ask(None, Call::parse("move_wrists", args).unwrap()).unwrap().reply;
            last = serde_json::json!(reply)["robots"][0].clone();
            stepped |= last["base"]["stepped"] == true;
        }
        assert_eq!(stepped, !stands_fast, "{last}");
        assert_eq!(last["right"]["state"] == "out_of_reach", stands_fast, "{last}");
    }
}

/// A hand target far across needs the waist. With `keep_waist`, the hand moves as far as the arm allows.
#[test]
fn a_waist_that_is_to_stay_does_not_turn() {
    for keep_waist in [false, true] {
        let mut session = handover(2011);
        let args = serde_json::json!({ "steps": 25, "robots": [{
            "robot": "A", "keep_waist": keep_waist,
            "right_position_m": [0.25, 0.30, 0.15], "right_quaternion_wxyz": [1, 0, 0, 0],
        }] });
        let mut ask = |tool: &str, args: serde_json::Value| {
            serde_json::json!(session.ask(None, Call::parse(tool, args).unwrap()).unwrap().reply)
        };
        let before = ask("get_robot_state", serde_json::json!({ "robot": "A" }));
        (0..2).for_each(|_| drop(ask("move_wrists", args.clone())));
        ask("wait", serde_json::json!({ "steps": 25 }));
        let after = ask("get_robot_state", serde_json::json!({ "robot": "A" }));
        let waist_rad =
            |state: &serde_json::Value| state["joint_positions_rad"]["waist_yaw_joint"].as_f64().unwrap();
        let turned_rad = (waist_rad(&after) - waist_rad(&before)).abs();
        assert_eq!(turned_rad < 0.02, keep_waist, "{turned_rad} rad");
    }
}

/// An observation gives wrists and camera in the requested frame.
#[test]
fn an_observation_is_told_in_the_frame_that_it_names() {
    let mut session = handover(2011);
    let mut look = |frame: Option<&str>| {
        let call =
            Call::parse("observe", serde_json::json!({ "robots": ["A"], "short": true, "frame": frame }))
                .unwrap();
        serde_json::json!(session.ask(None, call).unwrap().reply)
    };
    let (pelvis, start) = (look(None), look(Some("start")));
    let part = |reply: &serde_json::Value, of: &str, pose: &str| {
        let position_m = &reply[of][0][pose]["position_m"];
        std::array::from_fn::<f64, 3, _>(|i| position_m[i].as_f64().unwrap())
    };
    assert_eq!((pelvis["states"][0].get("frame"), &start["states"][0]["frame"]), (None, &"start".into()));
    assert!(pelvis["states"][0].get("joint_positions_rad").is_none(), "a short one has no joints");
    let (own, room) = (part(&pelvis, "states", "right_wrist"), part(&start, "states", "right_wrist"));
    assert!((room[2] - own[2] - 0.76).abs() < 0.02 && (room[0] - own[0]).abs() < 0.05, "{own:?} {room:?}");
    let (own, room) =
        (part(&start, "cameras", "camera_in_pelvis"), part(&start, "cameras", "camera_in_frame"));
    assert!((room[2] - own[2] - 0.76).abs() < 0.02, "{own:?} {room:?}");
    assert!(pelvis["cameras"][0].get("camera_in_frame").is_none());
}

/// A target in the start frame stays in place while its robot walks and turns. A target in the level frame
/// depends on gravity and the robot's heading.
#[test]
fn targets_are_read_in_the_frame_that_they_name() {
    let mut session = handover(2011);
    let back = WalkMove {
        robot: "A".into(),
        vx_m_s: -0.2,
        vy_m_s: 0.0,
        yaw_rate_rad_s: 0.3,
        pelvis_height_m: None,
        waist_yaw_rad: None,
        look_at_m: None,
    };
    command(&mut session, Walk { steps: 50, robots: vec![back] }.into());
    for _ in 0..4 {
        wait(&mut session, 50);
    }
    let now = wait(&mut session, 1).robots.remove(A);
    let start_from_pelvis = now.pelvis_in_start.unwrap();
    let held = now.right.measured.unwrap();
    // The hand's current position in the start frame, as a target in that frame, keeps the hand in place.
    let [w, x, y, z] = start_from_pelvis.quaternion_wxyz.map(|part| part as f32);
    let turned = tandem_sim::Rotation::from_xyzw(x, y, z, w).normalize();
    let at = Vector::from_array(held.position_m.map(|part| part as f32));
    let origin = Vector::from_array(start_from_pelvis.position_m.map(|part| part as f32));
    let in_start_m = (origin + turned * at).to_array().map(f64::from);
    let entry = WristMove {
        right_position_m: Some(in_start_m),
        frame: Some(PoseFrame::Start),
        ..WristMove::hold("A")
    };
    let report = right_hand(&mut session, entry);
    assert_eq!(report.frame, Some(PoseFrame::Start));
    let measured_m = report.right.measured.unwrap().position_m;
    for (asked_m, measured_m) in in_start_m.into_iter().zip(measured_m) {
        assert!((asked_m - measured_m).abs() < 0.008, "{measured_m} for {asked_m}: {report:?}");
    }
    let upright = WristMove {
        frame: Some(PoseFrame::Level),
        right_quaternion_wxyz: Some([1.0, 0.0, 0.0, 0.0]),
        right_position_m: Some([0.15, -0.25, 0.2]),
        ..WristMove::hold("A")
    };
    let report = right_hand(&mut session, upright);
    let facts = session.facts();
    let robot = &facts.robots[A];
    let ahead = (robot.pelvis_in_world * robot.wrist_in_pelvis.right).rotation * Vector::X;
    assert!(ahead.z.abs() < 0.03, "level fingers: {ahead}, {report:?}");
}

/// B faces A across the counter. A place in the room has the same coordinates for both.
#[test]
fn the_room_frame_is_the_same_for_all_robots() {
    let mut session = handover(2011);
    let mut wrist_m = |robot: usize, frame: PoseFrame| {
        let look = Observe { frame: Some(frame), ..Observe::of_all() };
        let ToolReply::Look(LookReply::Observe(seen)) = session.call(look.into()).unwrap() else { panic!() };
        assert_eq!(seen.states[robot].frame, Some(frame));
        seen.states[robot].right_wrist.position_m
    };
    assert_eq!(wrist_m(A, PoseFrame::Room), wrist_m(A, PoseFrame::Start));
    let (own_m, found_m) = (wrist_m(B, PoseFrame::Start), wrist_m(B, PoseFrame::Room));
    let facts = session.facts();
    let task = tandem_episodes::tasks::find("handover").unwrap();
    let in_world = facts.robots[B].pelvis_in_world * facts.robots[B].wrist_in_pelvis.right.translation;
    let [x_m, y_m] = task.robots[A].position_m;
    assert_eq!(task.robots[A].yaw_rad, 0.0);
    let expected_m = [in_world.x - x_m, in_world.y - y_m, in_world.z].map(f64::from);
    for (found_m, expected_m) in found_m.iter().zip(expected_m) {
        assert!((found_m - expected_m).abs() < 0.01, "{found_m} m, {expected_m} m");
    }
    assert!((own_m[0] - found_m[0]).abs() > 0.1, "{own_m:?}");
    let in_frame = |session: &mut Session, frame: PoseFrame| {
        let ask = GetRobotState { frame, ..GetRobotState::of("B") };
        let ToolReply::Look(LookReply::GetRobotState(state)) = session.call(ask.into()).unwrap() else {
            panic!()
        };
        state
    };
    let own = in_frame(&mut session, PoseFrame::Pelvis);
    assert_eq!((own.frame, own.pelvis_in_room), (None, None));
    let start = in_frame(&mut session, PoseFrame::Start);
    assert_eq!((start.right_wrist.position_m, start.pelvis_in_room), (own_m, None));
    let room = in_frame(&mut session, PoseFrame::Room);
    assert_eq!((room.frame, room.right_wrist.position_m), (Some(PoseFrame::Room), found_m));
    let pelvis = facts.robots[B].pelvis_in_world.translation;
    let found_m = room.pelvis_in_room.unwrap().position_m;
    for (found_m, expected_m) in found_m.iter().zip([pelvis.x - x_m, pelvis.y - y_m, pelvis.z]) {
        assert!((found_m - f64::from(expected_m)).abs() < 0.01, "{found_m} m, {expected_m} m");
    }
}

#[test]
fn other_frames_are_not_for_paper() {
    let spec = spec("handover", 2011, Protocol::Benchmark).assisted(Assistance::Paper);
    let mut session = Session::start(&spec, None).unwrap();
    let args = serde_json::json!({ "robot": "A", "pixels": [[160, 120]], "frame": "start" });
    let call = Call::parse("query_depth", args).unwrap();
    let refused = session.call(call.tool).unwrap_err().to_string();
    assert!(refused.contains("leave frame out"), "{refused}");
}

/// The waist turns the camera: a point to the side moves to the middle of the image.
#[test]
fn a_robot_looks_where_it_is_told_to() {
    let mut session = handover(2011);
    let look = |look_at_m: Option<[f64; 3]>, waist_yaw_rad: Option<f64>| Walk {
        steps: 50,
        robots: vec![WalkMove {
            robot: "A".into(),
            vx_m_s: 0.0,
            vy_m_s: 0.0,
            yaw_rate_rad_s: 0.0,
            pelvis_height_m: None,
            waist_yaw_rad,
            look_at_m,
        }],
    };
    let yaw_rad = |session: &mut Session| {
        wait(session, 25);
        state(session, "A").joint_positions_rad.get("waist_yaw_joint").unwrap()
    };
    command(&mut session, look(Some([1.0, 0.7, 0.0]), None).into());
    assert!((yaw_rad(&mut session) - 0.7f64.atan2(1.0)).abs() < 0.03);
    // The yaw rate is limited to 1 rad/s, and the yaw to the joint's range.
    command(&mut session, look(None, Some(-0.9)).into());
    let turned_rad = yaw_rad(&mut session);
    assert!((turned_rad - (0.7f64.atan2(1.0) - 1.0)).abs() < 0.03, "{turned_rad}");
    let report = command(&mut session, look(None, Some(-9.0)).into()).robots.remove(0);
    assert_eq!(report.waist_joints_clamped, ["waist_yaw_joint"]);
    assert_eq!(report.base.unwrap().state, Some(BaseState::Standing), "it turns on the spot");
    // A near low point enters the image by a bend, and a far high one by standing upright again.
    let pitch_rad = |session: &mut Session| {
        wait(session, 25);
        state(session, "A").joint_positions_rad.get("waist_pitch_joint").unwrap()
    };
    command(&mut session, look(Some([0.5, 0.0, -0.6]), None).into());
    let bent_rad = pitch_rad(&mut session);
    assert!((0.25..0.47).contains(&bent_rad), "{bent_rad}");
    let report = command(&mut session, look(Some([3.0, 0.0, 0.4]), None).into()).robots.remove(0);
    let upright_rad = pitch_rad(&mut session);
    assert!(upright_rad.abs() < 0.03, "{upright_rad}");
    assert!(!report.base.unwrap().stepped, "it looks on the spot");
}
