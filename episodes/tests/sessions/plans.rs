//! Tests of plans. Several commands in one call have the same effect as separate calls, also in a replay.

use serde_json::json;
use tandem_episodes::{A, B, Session};
use tandem_tools_spec::{
    Assistance, BaseState, Call, HandState, LookReply, PlanReply, PoseFrame, Protocol, ToolCall, ToolReply,
};

use crate::common::*;

fn plan(session: &mut Session, tool: &str, args: serde_json::Value) -> Result<PlanReply, String> {
    let call = Call::parse(tool, args).map_err(|error| error.to_string())?;
    match session.ask(None, call).map_err(|error| error.to_string())?.reply {
        ToolReply::Plan(reply) => Ok(reply),
        other => panic!("{other:?}"),
    }
}

fn agentic() -> Session {
    start("handover", 2011, Protocol::Agentic)
}

#[test]
fn a_plan_does_what_its_commands_do() {
    let up = json!({ "steps": 25, "robots": [{ "robot": "A", "right_position_m": [0.28, -0.24, 0.22] }] });
    let commands = [("move_wrists", up.clone()), ("wait", json!({ "steps": 20 })), ("move_wrists", up)];
    let mut one_by_one = agentic();
    for (tool, args) in commands.clone() {
        one_by_one.call(ToolCall::parse(tool, args).unwrap()).unwrap();
    }
    let mut planned = agentic();
    let listed = commands.map(|(tool, arguments)| json!({ "tool": tool, "arguments": arguments }));
    let reply = plan(&mut planned, "send_plan", json!({ "commands": listed })).unwrap();
    assert_eq!((reply.commands, reply.executed_steps, reply.stopped), (3, 70, None));
    let [first, second, third] = &reply.outcomes[..] else { panic!("{:?}", reply.outcomes) };
    assert!(first.starts_with("1. 25 steps: A right "), "{first}");
    assert!(second.starts_with("2. 20 steps: A right arrived"), "{second}");
    assert!(third.starts_with("3. 25 steps: A right "), "{third}");
    assert_eq!(planned.state_hash(), one_by_one.state_hash());
    let (one, other) = (planned.result(), one_by_one.result());
    assert_eq!((one.tool_calls, one.env_steps), (other.tool_calls, other.env_steps), "every command counts");
}

#[test]
fn a_plan_stops_where_something_is_not_as_it_expects() {
    let mut session = agentic();
    let far = json!({ "steps": 5, "robots": [{ "robot": "A", "right_position_m": [0.28, -0.24, 0.22] }] });
    let wait = |expects: serde_json::Value| json!({ "tool": "wait", "arguments": { "steps": 2 }, "expects": expects });
    let commands = json!([
        { "tool": "move_wrists", "arguments": far, "expects": { "base_stepping": false, "force_below_n": 20 } },
        wait(json!({ "blocked": false })),
        wait(json!({ "arrived": true })),
        wait(json!({})),
    ]);
    let reply = plan(&mut session, "send_plan", json!({ "commands": commands })).unwrap();
    assert_eq!((reply.commands, reply.executed_steps), (3, 9));
    let why = reply.stopped.unwrap();
    assert!(
        why.contains("command 3 of ") && why.contains("arrived is false, not true (A's right wrist"),
        "{why}"
    );
    let hash = session.state_hash();
    for (expects, says) in [
        (json!({ "phase_reached": "p1" }), "p1 has not been reached"),
        (json!({ "force_above_n": 30 }), "not above 30"),
        (json!({ "base_stepping": true }), "base_stepping is false, not true"),
    ] {
        let reply =
            plan(&mut session, "send_plan", json!({ "commands": [wait(expects), wait(json!({}))] })).unwrap();
        assert!(reply.commands == 1 && reply.stopped.as_ref().unwrap().contains(says), "{reply:?}");
    }
    assert_ne!(session.state_hash(), hash);
}

#[test]
fn a_plan_that_cannot_be_carried_out_moves_nothing() {
    let mut session = agentic();
    let hash = session.state_hash();
    let wait = json!({ "tool": "wait", "arguments": { "steps": 5 } });
    for (command, says) in [
        (
            json!({ "tool": "finish", "arguments": {} }),
            "command 2 of 2: \"finish\" is no command; have: move_wrists",
        ),
        (json!({ "tool": "wait", "arguments": { "steps": 0 } }), "command 2 of 2: wait: steps is 0"),
        (json!({ "tool": "wait", "arguments": { "steps": 26 } }), "allows 1 to 25"),
        (
            json!({ "tool": "walk", "arguments": { "steps": 5, "robots": [{ "robot": "C", "vx_m_s": 0, "vy_m_s": 0, "yaw_rate_rad_s": 0 }] } }),
            "no robot \"C\"",
        ),
    ] {
        let refused = plan(&mut session, "send_plan", json!({ "commands": [wait, command] })).unwrap_err();
        assert!(refused.contains(says), "{refused}");
    }
    let many = vec![wait.clone(); 21];
    assert!(plan(&mut session, "send_plan", json!({ "commands": many })).unwrap_err().contains("at most 20"));
    assert_eq!(session.state_hash(), hash);
    let spec = spec("handover", 2011, Protocol::Agentic).assisted(Assistance::Paper);
    let mut paper = Session::start(&spec, None).unwrap();
    let refused = plan(&mut paper, "send_plan", json!({ "commands": [wait] })).unwrap_err();
    assert!(refused.contains("this episode has no plans"), "{refused}");
}

#[test]
fn a_wait_ends_where_one_of_several_conditions_holds() {
    let mut session = agentic();
    let either = |force_n: f64| {
        let any_of = json!([{ "phase_reached": "p3" }, { "force_below_n": force_n }]);
        json!({ "tool": "wait", "arguments": { "steps": 12 }, "expects": { "any_of": any_of }, "until": true })
    };
    let reply = plan(&mut session, "send_plan", json!({ "commands": [either(1e3)] })).unwrap();
    assert_eq!((reply.stopped, reply.executed_steps), (None, 5), "one of two suffices");
    let reply = plan(&mut session, "send_plan", json!({ "commands": [either(-1.0)] })).unwrap();
    let stopped = reply.stopped.unwrap();
    assert!(stopped.contains("none of any_of holds: p3 has not been reached; get_status"), "{stopped}");
    assert!(stopped.contains("what p1, the next phase, lacks; a hand feels"), "{stopped}");
}

/// A hand goes down at one speed until it touches, and a wait ends once its condition holds.
#[test]
fn a_command_lasts_until_what_it_expects_holds() {
    let mut session = agentic();
    let to = |position_m: [f64; 3], steps: u32| {
        let palm_down = [0.707, -0.707, 0.0, 0.0];
        let wrist =
            json!({ "robot": "A", "right_position_m": position_m, "right_quaternion_wxyz": palm_down });
        json!({ "steps": steps, "robots": [wrist] })
    };
    let over = json!({ "tool": "move_wrists", "arguments": to([0.33, -0.33, 0.32], 25) });
    let settle = json!({ "tool": "wait", "arguments": { "steps": 25 } });
    let lower = json!({
        "tool": "move_wrists", "arguments": to([0.33, -0.33, -0.05], 300),
        "expects": { "force_above_n": 12 }, "until": true,
    });
    let reply = plan(&mut session, "send_plan", json!({ "commands": [over, settle, lower] })).unwrap();
    assert_eq!(reply.stopped, None, "{reply:?}");
    let lowering_steps = reply.executed_steps - 50;
    assert!((100..300).contains(&lowering_steps) && lowering_steps.is_multiple_of(5), "{reply:?}");
    let still = json!({
        "tool": "wait", "arguments": { "steps": 12 }, "expects": { "phase_reached": "p1" }, "until": true,
    });
    let reply = plan(&mut session, "send_plan", json!({ "commands": [still] })).unwrap();
    assert_eq!(reply.executed_steps, 12);
    assert!(reply.stopped.unwrap().contains("its steps are done and p1 has not been reached"));
    let until = |command: serde_json::Value| {
        let mut command = command;
        (command["expects"], command["until"]) = (json!({ "arrived": true }), json!(true));
        command
    };
    // A wrist at an intermediate target has not reached its last target.
    let back = until(json!({ "tool": "move_wrists", "arguments": to([0.3, -0.3, 0.3], 60) }));
    let reply = plan(&mut session, "send_plan", json!({ "commands": [back] })).unwrap();
    assert_eq!((reply.stopped, reply.commands), (None, 1));
    assert!((60..=85).contains(&reply.executed_steps), "{}", reply.executed_steps);
    for (command, says) in [
        (json!({ "tool": "wait", "arguments": { "steps": 5 }, "until": true }), "needs a condition"),
        (until(json!({ "tool": "wait", "arguments": { "steps": 1501 } })), "at most 1500"),
        (
            json!({ "tool": "wait", "arguments": { "steps": 5 }, "expects": { "any_of": [{ "heard": true }] } }),
            "for operators",
        ),
        (
            json!({ "tool": "wait", "arguments": { "steps": 5 }, "expects": { "any_of": [{}] } }),
            "any_of has no condition, or an entry without one",
        ),
        (until(json!({ "tool": "send_joint_chunk", "arguments": { "robots": [] } })), "cannot have `until`"),
    ] {
        let refused = plan(&mut session, "send_plan", json!({ "commands": [command] })).unwrap_err();
        assert!(refused.contains(says), "{refused}");
    }
}

#[test]
fn one_policy_has_nobody_to_hear() {
    let mut session = agentic();
    let walk = json!({ "steps": 5, "robots": [{ "robot": "A", "to_m": [0, 0] }], "until_heard": true });
    let wait = json!({ "tool": "wait", "arguments": { "steps": 5 } });
    let from_b = json!({ "tool": "wait", "arguments": { "steps": 5 }, "expects": { "heard_from": "B" } });
    for (tool, args, says) in [
        ("walk_to", walk.clone(), "`until_heard` is for operators"),
        (
            "send_plan",
            json!({ "commands": [{ "tool": "walk_to", "arguments": walk }] }),
            "`until_heard` is for",
        ),
        ("send_plan", json!({ "commands": [wait], "until_heard": true }), "`until_heard` is for operators"),
        ("send_plan", json!({ "commands": [from_b] }), "`heard_from` is for operators"),
    ] {
        let refused = plan(&mut session, tool, args).unwrap_err();
        assert!(refused.contains(says), "{refused}");
    }
}

#[test]
fn a_plan_walks_and_goes_on() {
    let mut session = agentic();
    let commands = json!([
        { "tool": "walk_to", "arguments": { "steps": 500, "robots": [{ "robot": "A", "to_m": [-0.2, 0.0] }] } },
        { "tool": "wait", "arguments": { "steps": 5 }, "expects": { "base_stepping": false } },
    ]);
    let reply = plan(&mut session, "send_plan", json!({ "commands": commands })).unwrap();
    assert_eq!(reply.stopped, None, "{reply:?}");
    let [walk, wait] = &reply.outcomes[..] else { panic!("{:?}", reply.outcomes) };
    assert!(walk.contains("A pelvis at [-0.") && walk.ends_with("m in start"), "{walk}");
    assert_eq!(wait, "2. 5 steps");
    let [x_m, ..] = reply.last.robots[A].pelvis_in_start.unwrap().position_m;
    assert!((x_m + 0.2).abs() < 0.02, "{x_m}");
    let nobody = json!([{ "robot": "C", "to_m": [0, 0] }]);
    let nowhere = json!({ "tool": "walk_to", "arguments": { "steps": 500, "robots": nobody } });
    let refused = plan(&mut session, "send_plan", json!({ "commands": [nowhere] })).unwrap_err();
    assert!(refused.contains("no robot \"C\""), "{refused}");
}

/// A plan's commands have the arguments of the tools, including `short`. The reply is short if the last
/// command asks for that.
#[test]
fn commands_of_a_plan_may_ask_for_short_replies() {
    let mut session = agentic();
    let wait =
        |short: serde_json::Value| json!({ "tool": "wait", "arguments": { "steps": 2, "short": short } });
    let robots = |reply: &PlanReply| reply.last.robots.len();
    let full =
        plan(&mut session, "send_plan", json!({ "commands": [wait(json!(true)), wait(json!(false))] }))
            .unwrap();
    let short =
        plan(&mut session, "send_plan", json!({ "commands": [wait(json!(null)), wait(json!(true))] }))
            .unwrap();
    assert_eq!((robots(&full), robots(&short)), (2, 0), "both stand: {short:?}");
    // Each command counts as a call, and the reply includes the count.
    assert_eq!((full.commands, full.tool_calls, short.tool_calls), (2, Some(2), None));
    assert_eq!(session.result().tool_calls, 4);
    let refused = plan(&mut session, "send_plan", json!({ "commands": [wait(json!("yes"))] })).unwrap_err();
    assert!(refused.contains("command 1 of ") && refused.contains("short"), "{refused}");
}

/// Two robots stand. The report on one of them is empty.
#[test]
fn a_robot_that_did_nothing_is_not_told_of() {
    let mut session = agentic();
    let back = json!({ "steps": 400, "short": true, "robots": [{ "robot": "A", "to_m": [-0.3, 0.0] }] });
    let reply = plan(&mut session, "walk_to", back).unwrap();
    let [a] = &reply.last.robots[..] else { panic!("{reply:?}") };
    assert!(a.robot == "A" && a.pelvis_in_start.is_some(), "{a:?}");
}

/// B faces A, and walks away from it along A's x axis.
#[test]
fn a_place_in_the_room_is_the_same_for_every_robot() {
    let mut session = agentic();
    let task = tandem_episodes::tasks::find("handover").unwrap();
    let [[a_x_m, a_y_m], [b_x_m, b_y_m]] = [A, B].map(|robot| task.robots[robot].position_m);
    let to_m = [b_x_m - a_x_m + 0.25, b_y_m - a_y_m];
    let heading_rad = std::f64::consts::PI;
    let destination = json!({ "robot": "B", "to_m": to_m, "heading_rad": heading_rad });
    let to = json!({ "steps": 800, "frame": "room", "robots": [destination] });
    let reply = plan(&mut session, "walk_to", to).unwrap();
    assert_eq!(reply.stopped, None, "{reply:?}");
    let stands = session.facts().robots[B].pelvis_in_world;
    let off_m = stands.translation - tandem_sim::Vector::new(b_x_m + 0.25, b_y_m, stands.translation.z);
    assert!(off_m.length() < 0.04, "{off_m}");
    assert!((stands.rotation * tandem_sim::Vector::X).x < -0.99, "{stands:?}");
    let told = &reply.last.robots[B];
    assert_eq!(told.frame, Some(PoseFrame::Room));
    let pelvis_m = told.pelvis_in_room.expect("the place that was asked for").position_m;
    assert!((0..2).all(|axis| (pelvis_m[axis] - f64::from(to_m[axis])).abs() < 0.02), "{told:?}");
    let wrist_m = told.right.measured.expect("a full reply").position_m;
    assert!(wrist_m[0] < pelvis_m[0] && wrist_m[1] > pelvis_m[1], "it faces A: {told:?}");
}

/// Replies to a walk are in the frame of its places, whatever frame its commands are in.
#[test]
fn a_walk_replies_in_the_frame_that_it_was_asked_in() {
    for (frame, carry) in [("room", true), ("start", false), ("level", true), ("pelvis", false)] {
        let mut session = agentic();
        let raise = json!({ "robot": "A", "right_position_m": [0.28, -0.24, 0.22] });
        let raise = Call::parse("move_wrists", json!({ "steps": 25, "robots": [raise] })).unwrap();
        session.call(raise.tool).unwrap();
        let walk = json!({
            "steps": 400, "frame": frame, "robots": [{ "robot": "A", "to_m": [-0.2, 0.0], "carry": carry }],
        });
        let walk = json!({ "tool": "walk_to", "arguments": walk });
        let wait = json!({ "tool": "wait", "arguments": { "steps": 1 } });
        let listed = json!({ "commands": [wait, walk] });
        let reply = plan(&mut session, "send_plan", listed).unwrap();
        let told = &reply.last.robots[A];
        let named = told.frame.map(|frame| json!(frame)).unwrap_or(json!("pelvis"));
        assert_eq!((named, told.pelvis_in_room.is_some()), (json!(frame), frame == "room"));
        let pelvis_in = if frame == "room" { "m in room" } else { "m in start" };
        assert!(reply.outcomes[1].ends_with(pelvis_in), "{:?}", reply.outcomes);
        let ask = json!({ "robot": "A", "frame": frame });
        let ToolReply::Look(LookReply::GetRobotState(state)) =
            session.call(ToolCall::parse("get_robot_state", ask).unwrap()).unwrap()
        else {
            panic!("no state")
        };
        let found_m = told.right.measured.unwrap().position_m;
        let off_m = |axis: usize| (found_m[axis] - state.right_wrist.position_m[axis]).abs();
        assert!((0..3).all(|axis| off_m(axis) < 1e-3), "{frame}: {found_m:?}, {state:?}");
    }
}

/// Walks back from the counter via a waypoint, then sideways with a turn. The odometry and the simulator
/// agree on the result.
#[test]
fn a_robot_walks_to_a_place() {
    let mut session = agentic();
    let began = session.facts().robots[A].pelvis_in_world;
    let waypoints = json!([{ "at_m": [-0.6, 0.0], "heading_rad": 0.4 }]);
    let to = json!({ "steps": 1200, "robots": [
        { "robot": "A", "to_m": [-0.5, 0.3], "heading_rad": 0.8, "waypoints": waypoints },
    ] });
    let reply = plan(&mut session, "walk_to", to).unwrap();
    assert_eq!(reply.stopped, None, "{reply:?}");
    let base = reply.last.robots[A].base.unwrap();
    assert!(base.commanded_height_m.is_none(), "it stands as high as it was told: {base:?}");
    assert!(reply.executed_steps < 900 && reply.commands > 10, "{reply:?}");
    let moved = began.inverse() * session.facts().robots[A].pelvis_in_world;
    let off_m = (moved.translation.x + 0.5).hypot(moved.translation.y - 0.3);
    let ahead = moved.rotation * tandem_sim::Vector::X;
    let off_rad = (ahead.y.atan2(ahead.x) - 0.8).abs();
    assert!(off_m < 0.02 && off_rad < 0.03, "{off_m} m and {off_rad} rad off: {:?}", reply.last.robots);
    // The counter blocks this target.
    let to = json!({ "steps": 1200, "robots": [{ "robot": "A", "to_m": [0.6, 0.0], "heading_rad": 0.0 }] });
    let reply = plan(&mut session, "walk_to", to).unwrap();
    assert!(reply.stopped.as_ref().is_some_and(|why| why.contains("A")), "{reply:?}");
    let few = json!({ "steps": 20, "robots": [{ "robot": "A", "to_m": [-0.5, 0.0] }] });
    let reply = plan(&mut session, "walk_to", few).unwrap();
    assert_eq!(reply.executed_steps, 20);
    assert!(reply.stopped.unwrap().contains("the steps are used up; A is"), "its place is half a metre off");
}

/// Arms without a target keep their joints, also where the place of the hand would be out of reach.
#[test]
fn an_empty_hand_without_a_target_is_not_carried() {
    let mut session = agentic();
    let turn = json!({ "steps": 1500, "robots": [
        { "robot": "A", "to_m": [-0.6, 0.0], "heading_rad": 3.0, "carry": true },
    ] });
    let reply = plan(&mut session, "walk_to", turn).unwrap();
    assert_eq!(reply.stopped, None);
    let right = &reply.last.robots[A].right;
    assert_eq!(right.state, Some(HandState::Idle), "{right:?}");
}

/// A robot that carries, with a wrist target out of reach, stops at once and reports the reason.
#[test]
fn a_robot_that_does_not_reach_what_it_carries_stops() {
    let mut session = agentic();
    let far = json!({ "robot": "A", "right_position_m": [0.9, -0.2, 0.2] });
    for _ in 0..3 {
        let call = Call::parse("move_wrists", json!({ "steps": 25, "robots": [far] })).unwrap();
        session.call(call.tool).unwrap();
    }
    let to = json!({ "steps": 1200, "robots": [{ "robot": "A", "to_m": [-1.0, 0.0], "carry": true }] });
    let reply = plan(&mut session, "walk_to", to).unwrap();
    let why = reply.stopped.unwrap_or_default();
    assert!(why.contains("wrist is out of reach"), "{why}");
    let told = &reply.last.robots[A];
    assert_eq!(told.base.and_then(|base| base.state), Some(BaseState::Standing), "{told:?}");
    assert!(reply.executed_steps < 300, "{}", reply.executed_steps);
}
