//! Tests of the fields in replies: under `paper` those that the benchmark gives its agents, in every
//! reply of a whole episode, and under `full` the rest.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;
use tandem_episodes::players::{self, Episode, InProcess, PlayerError, PrivilegedEpisode};
use tandem_episodes::{Facts, Session};
use tandem_tools_spec::{
    Assistance, CheckReach, EndReason, Finish, GetRobotState, GetStatus, Observe, Protocol, QueryDepth,
    Tool as _, ToolCall, ToolReply, Wait,
};

use crate::common::*;

/// Fields of replies under `paper`, by tool. All commands have the same fields. `*` is the name of a joint.
const PAPER: &[(&str, &str)] = &[
    (
        "command",
        "executed_steps stop_reason time_s phases budget.steps_left budget.wall_clock_left_s budget.steps_per_command \
         robots.robot robots.SIDE.target.position_m robots.SIDE.target.quaternion_wxyz robots.SIDE.measured.position_m \
         robots.SIDE.measured.quaternion_wxyz robots.SIDE.position_error_m robots.SIDE.orientation_error_rad \
         robots.SIDE.fingers.target_rad robots.SIDE.fingers.measured_rad",
    ),
    (
        "get_robot_state",
        "robot time_s joint_positions_rad.* SIDE_wrist.position_m SIDE_wrist.quaternion_wxyz base_command.vx_m_s \
         base_command.vy_m_s base_command.yaw_rate_rad_s base_command.pelvis_height_m",
    ),
    (
        "observe",
        "time_s states.robot states.time_s states.joint_positions_rad.* states.SIDE_wrist.position_m \
         states.SIDE_wrist.quaternion_wxyz states.base_command.vx_m_s states.base_command.vy_m_s \
         states.base_command.yaw_rate_rad_s states.base_command.pelvis_height_m cameras.robot cameras.width cameras.height \
         cameras.fx cameras.fy cameras.cx cameras.cy cameras.camera_in_pelvis.position_m \
         cameras.camera_in_pelvis.quaternion_wxyz images.robot images.png_base64",
    ),
    ("query_depth", "robot columns points"),
    (
        "check_reach",
        "robot reachable left right.reachable right.position_error_m right.orientation_error_rad joints_at_limit",
    ),
    (
        "get_status",
        "task protocol time_s env_steps ended assistance phases budget.steps_left budget.wall_clock_left_s \
         budget.steps_per_command",
    ),
    (
        "finish",
        "task protocol assistance phases.p1 phases.p2 phases.p3 success ended env_steps tool_calls requests thinking_s falls realtime_factor \
         departures",
    ),
];

/// Further fields that only some replies have.
const PAPER_AT_TIMES: &[(&str, &str)] = &[(
    "command",
    "robots.SIDE.joints_clamped robots.SIDE.joints_at_limit robots.waist_joints_clamped robots.waist_joints_at_limit \
     robots.base_command_clamped",
)];

/// Further fields under `full`.
const FULL: &[(&str, &str)] = &[
    (
        "command",
        "fallen.robot fallen.fallen phases.id phases.number phases.time_s robots.SIDE.state robots.SIDE.fingers.state \
         robots.SIDE.grip robots.base.state robots.base.pelvis_height_m \
         robots.SIDE.largest_effort.joint robots.SIDE.largest_effort.share robots.SIDE.force_n \
         robots.pelvis_in_start.position_m robots.pelvis_in_start.quaternion_wxyz robots.base_motion.forward_m \
         robots.base_motion.left_m robots.base_motion.up_m robots.base_motion.turned_rad",
    ),
    (
        "get_robot_state",
        "joint_velocities_rad_s.* joint_torques_n_m.* gravity_in_pelvis pelvis_in_start.position_m \
         pelvis_in_start.quaternion_wxyz fallen",
    ),
    (
        "observe",
        "states.joint_velocities_rad_s.* states.joint_torques_n_m.* states.gravity_in_pelvis \
         states.pelvis_in_start.position_m states.pelvis_in_start.quaternion_wxyz states.fallen",
    ),
    ("get_status", "seed state_hash fallen.robot fallen.fallen phases.id phases.number phases.time_s"),
    // The additional information is counted, too.
    (
        "finish",
        "seed state_hash extra_information extra_information_replies.joint_velocities.* \
         extra_information_replies.joint_torques.* extra_information_replies.hand_forces.* \
         extra_information_replies.odometry.* extra_information_replies.gravity.*",
    ),
];

/// Further fields under `full` that only some replies have.
const FULL_AT_TIMES: &[(&str, &str)] = &[
    (
        "command",
        "robots.frame robots.SIDE.presses robots.SIDE.touches robots.SIDE.given_way_m robots.base.commanded_height_m \
         robots.base.comes_to_rest_m robots.base.displaced_m robots.base.stepped",
    ),
    ("check_reach", "needs_a_step"),
    ("get_robot_state", "SIDE_wrist_target.position_m SIDE_wrist_target.quaternion_wxyz"),
    ("observe", "states.SIDE_wrist_target.position_m states.SIDE_wrist_target.quaternion_wxyz"),
];

/// Fields by tool.
type Told = BTreeMap<String, BTreeSet<String>>;

fn listed(lists: &[&[(&str, &str)]]) -> Told {
    let mut told = Told::new();
    for (tool, fields) in lists.iter().copied().flatten() {
        for field in fields.split_whitespace() {
            let names = match field.contains("SIDE") {
                true => ["left", "right"].map(|side| field.replace("SIDE", side)).to_vec(),
                false => vec![field.to_owned()],
            };
            told.entry((*tool).to_owned()).or_default().extend(names);
        }
    }
    told
}

/// Removes the fields that are present only at times.
fn without(mut told: Told, at_times: &[(&str, &str)]) -> Told {
    for (tool, fields) in listed(&[at_times]) {
        if let Some(told) = told.get_mut(&tool) {
            told.retain(|field| !fields.contains(field));
        }
    }
    told
}

/// Collects the field paths of a reply. Names of joints and robots are not fields.
fn collect(reply: &Value, path: &str, fields: &mut BTreeSet<String>) {
    match reply {
        Value::Object(object) => {
            for (name, value) in object {
                let name = if name.ends_with("_joint") || name.len() == 1 { "*" } else { name };
                let path = if path.is_empty() { name.into() } else { format!("{path}.{name}") };
                collect(value, &path, fields);
            }
        }
        Value::Array(items) if items.first().is_some_and(Value::is_object) => {
            items.iter().for_each(|item| collect(item, path, fields));
        }
        Value::Array(_) | Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {
            fields.insert(path.into());
        }
    }
}

/// An episode played by an expert that also calls every tool, and collects the fields of the replies.
struct Listening {
    session: Session,
    told: Told,
    commands: u32,
}

impl Listening {
    fn ask(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let name = call.name();
        let reply = self.session.call(call).map_err(|_| PlayerError::EpisodeOver)?;
        let tool = if matches!(reply, ToolReply::Act(_)) { "command" } else { name };
        collect(&serde_json::json!(reply), "", self.told.entry(tool.into()).or_default());
        Ok(reply)
    }
}

impl Episode for Listening {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        self.commands += 1;
        if self.commands % 8 == 1 {
            let looks: [ToolCall; 5] = [
                GetRobotState::of("A").into(),
                Observe::of_all().into(),
                QueryDepth::example().into(),
                CheckReach::example().into(),
                GetStatus::default().into(),
            ];
            for look in looks {
                self.ask(look)?;
            }
        }
        self.ask(call)
    }
}

impl PrivilegedEpisode for Listening {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        Ok(self.session.facts())
    }
}

/// Plays an expert's episode. Returns the times of its phases, and the fields of the replies until its end.
fn listen(assistance: Assistance) -> (Vec<Option<f64>>, EndReason, Told) {
    let spec = spec("pouring", 2003, Protocol::Agentic).assisted(assistance);
    let session = Session::start(&spec, None).unwrap();
    let mut episode = Listening { session, told: Told::new(), commands: 0 };
    players::find("expert").unwrap().play(&spec, &mut episode).unwrap();
    episode.ask(GetStatus::default().into()).unwrap();
    if assistance == Assistance::Paper {
        let before = status(&mut episode.session);
        assert_eq!((before.ended, before.phases.len()), (None, 0), "success is told at the end");
    }
    episode.ask(Finish {}.into()).unwrap();
    assert_eq!(status(&mut episode.session).phases.len(), 3, "success is told at the end");
    let Listening { session, told, .. } = episode;
    let result = session.close();
    (result.phases.0.into_iter().map(|(_, time_s)| time_s).collect(), result.ended, told)
}

#[test]
fn replies_of_a_whole_episode_tell_what_is_listed_and_nothing_else() {
    let (paper_times_s, ended, told) = listen(Assistance::Paper);
    assert_eq!((ended, without(told, PAPER_AT_TIMES)), (EndReason::Finished, listed(&[PAPER])));
    let (full_times_s, ended, told) = listen(Assistance::Full);
    let told = without(without(told, PAPER_AT_TIMES), FULL_AT_TIMES);
    assert_eq!((ended, told), (EndReason::TaskComplete, listed(&[PAPER, FULL])));
    assert!(paper_times_s.iter().all(Option::is_some), "{paper_times_s:?}");
    assert_eq!(paper_times_s, full_times_s, "an expert needs nothing of what only `full` tells");
}

/// A policy in this process gets the information that it asks for under any assistance, and this is counted.
#[test]
fn what_is_shown_beyond_the_benchmark_is_counted() {
    use tandem_episodes::players::LocalEpisode as _;
    use tandem_tools_spec::ExtraInformation::{Odometry, ThirdPerson};
    let spec = spec("handover", 0, Protocol::Benchmark).assisted(Assistance::Paper);
    let mut episode = InProcess::new(Session::start(&spec, None).unwrap());
    let look = Observe { short: Some(true), ..Observe::of_all() };
    let seen = episode.observe(&look, &[]).unwrap();
    assert!(seen.robots[0].state.pelvis_in_start.is_some(), "who asks a policy knows it");
    let ToolReply::Act(reply) = episode.carry_out(Wait { steps: 1 }.into()).unwrap() else { panic!() };
    assert!(reply.robots[0].pelvis_in_start.is_some(), "who asks a policy knows it");
    assert_eq!(episode.session.result().extra_information, [""; 0], "the policy was shown nothing of it");
    episode.observe(&look, &[Odometry, ThirdPerson]).unwrap();
    episode.observe(&look, &[Odometry]).unwrap();
    episode.call(QueryDepth::example().into()).unwrap();
    let result = episode.session.result();
    assert_eq!(result.extra_information, ["pixel_depth", "third_person", "odometry"]);
    let replies = |what: &str| result.extra_information_replies[what].clone();
    let by_robot = |count: u32| BTreeMap::from([("A".to_owned(), count), ("B".to_owned(), count)]);
    assert_eq!((replies("odometry"), replies("third_person")), (by_robot(2), by_robot(1)));
    assert_eq!(replies("pixel_depth"), BTreeMap::from([("A".to_owned(), 1)]));
}
