//! Short replies for language models. They leave out all values that are as expected.

use tandem_sim::CONTROL_HZ;
use tandem_tools_spec::{
    BaseMotion, BaseReport, BaseState, Budget, CommandReply, DepthReply, Grip, HandReport, HandState,
    LookReply, ManageReply, Observation, PlanReply, Pose, RobotReport, RobotState, StatusReply, Surface,
    TalkReply, ToolReply, Touch,
};

use crate::convert::coarse;

/// Minimum values that are reported: metres and radians, newtons, the fraction of a joint's effort limit.
const MOVED: f64 = 0.01;
const FELT_N: f64 = 1.0;
/// Force that the friction of a free arm may cause.
const HANGING_N: f64 = 6.0;
const HARD_SHARE: f64 = 0.8;
/// Difference between commanded and measured height above which the command is reported.
const SUNK_M: f64 = 0.02;

/// Removes from a reply the parts that its caller can do without.
pub fn shorten(reply: &mut ToolReply) {
    match reply {
        ToolReply::Act(reply) => shorten_command(reply),
        ToolReply::Plan(reply) => shorten_plan(reply),
        ToolReply::Look(LookReply::Observe(seen)) => shorten_observation(seen),
        ToolReply::Look(LookReply::GetRobotState(state)) => shorten_state(state),
        ToolReply::Look(LookReply::QueryDepth(depth)) => shorten_depth(depth),
        ToolReply::Manage(ManageReply::GetStatus(status)) | ToolReply::Talk(TalkReply::Say(status)) => {
            shorten_status(status);
        }
        ToolReply::Manage(ManageReply::Finish(result)) => result.extra_information_replies.clear(),
        ToolReply::Look(LookReply::CheckReach(_)) => {}
    }
}

fn shorten_observation(seen: &mut Observation) {
    seen.states.iter_mut().for_each(shorten_state);
    for camera in &mut seen.cameras {
        camera.camera_in_pelvis = coarsened(&camera.camera_in_pelvis);
        camera.camera_in_frame = camera.camera_in_frame.as_ref().map(coarsened);
        (camera.fx, camera.fy) = (coarse(camera.fx), coarse(camera.fy));
    }
}

fn shorten_state(state: &mut RobotState) {
    state.joint_positions_rad.0.clear();
    (state.joint_velocities_rad_s, state.joint_torques_n_m) = (None, None);
    let height_m = state.pelvis_in_start.as_ref().map(|pelvis| pelvis.position_m[2]);
    let stands_at = |command_m: f64| height_m.is_some_and(|height_m| (height_m - command_m).abs() < SUNK_M);
    state.base_command.take_if(|command| {
        let walks = [command.vx_m_s, command.vy_m_s, command.yaw_rate_rad_s].iter().any(|rate| *rate != 0.0);
        !walks && stands_at(command.pelvis_height_m)
    });
    state.gravity_in_pelvis.take_if(|[x, y, _]| x.hypot(*y) < MOVED);
    state.gravity_in_pelvis = state.gravity_in_pelvis.map(|down| down.map(coarse));
    state.fallen.take_if(|fallen| !*fallen);
    state.pelvis_in_start.take_if(|_| state.pelvis_in_room.is_some());
    for pose in [&mut state.left_wrist, &mut state.right_wrist] {
        *pose = coarsened(pose);
    }
    for pose in [
        &mut state.left_wrist_target,
        &mut state.right_wrist_target,
        &mut state.pelvis_in_start,
        &mut state.pelvis_in_room,
    ] {
        *pose = pose.as_ref().map(coarsened);
    }
}

fn coarsened(pose: &Pose) -> Pose {
    Pose { position_m: pose.position_m.map(coarse), quaternion_wxyz: pose.quaternion_wxyz.map(coarse) }
}

fn shorten_depth(depth: &mut DepthReply) {
    if depth.points.is_empty() {
        depth.columns.clear();
    }
    let is_plain = |surface: &&mut Surface| surface.axis.is_some() || surface.object.is_some();
    for surface in depth.surfaces.iter_mut().filter(is_plain) {
        surface.corners_m.clear();
    }
}

fn shorten_status(status: &mut StatusReply) {
    status.fallen.retain(|robot| robot.fallen);
    (status.seed, status.state_hash) = (None, None);
    shorten_budget(&mut status.budget);
}

fn shorten_budget(budget: &mut Budget) {
    budget.wall_clock_left_s = budget.wall_clock_left_s.map(f64::floor);
}

/// Shortens the reply to a plan or a walk like [`shorten`].
pub fn shorten_plan(reply: &mut PlanReply) {
    reply.tool_calls = None;
    // The lines of a plan state the walks of robots and their ends; a single walk has no lines.
    let tells_pelvises = reply.outcomes.is_empty();
    shorten_report(&mut reply.last, reply.executed_steps, tells_pelvises);
}

fn shorten_command(reply: &mut CommandReply) {
    shorten_report(reply, reply.executed_steps, false);
}

/// Shortens the reply to the last command of a call that took `executed_steps`. With `tells_pelvises`, it
/// keeps the pelvises of robots that have not moved during that command.
fn shorten_report(reply: &mut CommandReply, executed_steps: u32, tells_pelvises: bool) {
    reply.fallen.retain(|robot| robot.fallen);
    // Half a step before the first one, against rounding.
    let began_s = reply.time_s - (f64::from(executed_steps) - 0.5) / CONTROL_HZ;
    reply.phases.retain(|phase| phase.time_s > began_s);
    shorten_budget(&mut reply.budget);
    reply.robots.iter_mut().for_each(|report| shorten_robot(report, tells_pelvises));
    // A robot without an entry in the report has not moved.
    reply.robots.retain(|report| *report != still(report));
}

fn shorten_robot(report: &mut RobotReport, tells_pelvises: bool) {
    let RobotReport { left, right, base, pelvis_in_start, pelvis_in_room, base_motion, .. } = report;
    let has_moved = base_motion.take().is_some_and(|motion| !is_small(&motion));
    // A robot that has never moved is where it was when the episode began.
    let is_at_start = pelvis_in_start.as_ref().is_some_and(is_at_start);
    if is_at_start || !(has_moved || tells_pelvises) {
        (*pelvis_in_start, *pelvis_in_room) = (None, None);
    }
    pelvis_in_start.take_if(|_| pelvis_in_room.is_some());
    base.take_if(|base| stands(base));
    shorten_hand(left);
    shorten_hand(right);
}

/// Returns the report on the same robot with hands that have no target and sense no contact.
fn still(report: &RobotReport) -> RobotReport {
    let RobotReport { robot, frame, .. } = report;
    let hand = HandReport { state: Some(HandState::Idle), ..HandReport::default() };
    let (left, right) = (hand.clone(), hand);
    RobotReport { robot: robot.clone(), frame: *frame, left, right, ..RobotReport::default() }
}

/// Returns true for a base that stands as commanded, and did so throughout.
fn stands(base: &BaseReport) -> bool {
    let BaseReport { state, pelvis_height_m: _, commanded_height_m, comes_to_rest_m, displaced_m, stepped } =
        base;
    *state == Some(BaseState::Standing)
        && commanded_height_m.is_none()
        && comes_to_rest_m.is_none()
        && displaced_m.is_none()
        && !stepped
}

fn is_small(motion: &BaseMotion) -> bool {
    [motion.forward_m, motion.left_m, motion.up_m, motion.turned_rad].iter().all(|part| part.abs() < MOVED)
}

fn is_at_start(start_from_pelvis: &Pose) -> bool {
    let ([x_m, y_m, _], [w, .., z]) = (start_from_pelvis.position_m, start_from_pelvis.quaternion_wxyz);
    x_m.hypot(y_m) < MOVED && 2.0 * z.atan2(w).abs() < MOVED
}

fn shorten_hand(hand: &mut HandReport) {
    hand.target = None;
    hand.grip.take_if(|grip| *grip == Grip::None);
    let is_free = hand.state == Some(HandState::Idle) && hand.grip.is_none();
    let felt_n = if is_free { HANGING_N } else { FELT_N };
    if let Some(HandState::Arrived | HandState::Idle) = hand.state {
        hand.measured = None;
        (hand.position_error_m, hand.orientation_error_rad) = (None, None);
        hand.joints_at_limit.clear();
    }
    // Fingers around an object rest where it stops them, and all of them press.
    if hand.grip == Some(Grip::TwoSided) {
        hand.presses.clear();
    }
    hand.fingers.take_if(|fingers| {
        fingers.target_rad = None;
        fingers.state == Some(HandState::Arrived) || hand.grip == Some(Grip::TwoSided)
    });
    hand.touches.take_if(|touches| *touches == Touch::Something && hand.grip.is_some());
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
        // The pose is reported unless the state says that the hand is at its target.
        let untold = left(HandReport { state: None, ..hand("idle", 0.0) });
        assert!(untold["measured"].is_object() && untold["position_error_m"].is_number(), "{untold}");
    }

    fn reply(base: serde_json::Value, moved_m: f64) -> CommandReply {
        let pose = json!({ "position_m": [0.5, 0.1, 0.76], "quaternion_wxyz": [1, 0, 0, 0] });
        let phase = |number: &str, time_s: f64| json!({ "id": number, "number": number, "time_s": time_s });
        serde_json::from_value(json!({
            "executed_steps": 25, "stop_reason": "steps_done", "time_s": 9.0,
            "robots": [{
                "robot": "A", "left": { "state": "idle" }, "right": { "state": "idle" }, "base": base,
                "frame": "room", "pelvis_in_start": pose, "pelvis_in_room": pose,
                "base_motion": { "forward_m": moved_m, "left_m": 0, "up_m": 0, "turned_rad": 0 },
            }],
            "phases": [phase("p1", 7.0), phase("p2", 8.6), phase("p3", 8.8)],
            "budget": { "steps_left": 5, "wall_clock_left_s": 17.9, "steps_per_command": 25 },
        }))
        .unwrap()
    }

    #[test]
    fn a_robot_that_stands_where_it_stood_is_told_by_its_hands() {
        let left = |base: serde_json::Value, moved_m: f64| {
            let mut reply = ToolReply::Act(reply(base, moved_m));
            shorten(&mut reply);
            json!(reply)["robots"][0].clone()
        };
        let standing = json!({ "state": "standing", "pelvis_height_m": 0.76 });
        assert_eq!(left(standing.clone(), 0.004), json!(null));
        let moved = left(standing.clone(), 0.2);
        assert!(moved.get("base").is_none() && moved.get("pelvis_in_start").is_none(), "{moved}");
        assert!(moved["pelvis_in_room"].is_object() && moved.get("base_motion").is_none(), "{moved}");
        for (field, value) in [
            ("stepped", json!(true)),
            ("displaced_m", json!([0.0, 0.03])),
            ("commanded_height_m", json!(0.7)),
        ] {
            let mut base = standing.clone();
            base[field] = value;
            assert_eq!(left(base.clone(), 0.0)["base"], base);
        }
    }

    /// A walk reports the robot's position, and a plan does so in its lines.
    #[test]
    fn plans_tell_the_phases_of_all_their_commands() {
        let plan = |executed_steps: u32, outcomes: &[&str]| {
            let last = reply(json!({ "state": "stepping", "pelvis_height_m": 0.65 }), 0.0);
            let outcomes = outcomes.iter().map(|line| (*line).into()).collect();
            let (held, stopped, tool_calls) = (Vec::new(), None, Some(60));
            let mut plan =
                PlanReply { commands: 2, tool_calls, executed_steps, stopped, outcomes, held, last };
            shorten_plan(&mut plan);
            let numbers = plan.last.phases.iter().map(|phase| phase.number.clone());
            (numbers.collect::<Vec<_>>().join(" "), plan.last.robots[0].pelvis_in_room.is_some())
        };
        let lines = &["command 1 of 2, 25 steps", "command 2 of 2, 25 steps"];
        assert_eq!(plan(5, lines), (String::new(), false));
        assert_eq!(plan(25, &[]), ("p2 p3".into(), true));
        assert_eq!(plan(200, lines), ("p1 p2 p3".into(), false));
    }

    #[test]
    fn states_are_told_to_the_millimetre() {
        let pose =
            json!({ "position_m": [0.1234567, 0.2, 0.3], "quaternion_wxyz": [0.999999, 0.0005001, 0, 0] });
        let command = json!({ "vx_m_s": 0, "vy_m_s": 0, "yaw_rate_rad_s": 0, "pelvis_height_m": 0.31 });
        let told = |down: [f64; 3]| {
            let state = json!({
                "robot": "A", "time_s": 6.0, "joint_positions_rad": { "left_elbow_joint": 0.5 }, "fallen": false,
                "left_wrist": pose, "right_wrist": pose, "gravity_in_pelvis": down,
                "pelvis_in_start": pose, "base_command": command,
            });
            let mut reply = ToolReply::Look(LookReply::GetRobotState(serde_json::from_value(state).unwrap()));
            shorten(&mut reply);
            json!(reply)
        };
        let coarse = json!({ "position_m": [0.123, 0.2, 0.3], "quaternion_wxyz": [1.0, 0.001, 0.0, 0.0] });
        let expected = json!({
            "robot": "A", "time_s": 6.0, "left_wrist": coarse, "right_wrist": coarse, "pelvis_in_start": coarse,
        });
        assert_eq!(told([0.004, 0.0, -1.0]), expected);
        assert_eq!(told([0.10004, 0.0, -0.995])["gravity_in_pelvis"], json!([0.1, 0.0, -0.995]));
    }
}
