//! Sessions and calls shared by the tests.

use tandem_episodes::{EpisodeSpec, Session, tasks};
use tandem_tools_spec::{
    CommandReply, GetRobotState, GetStatus, JointChunk, LookReply, ManageReply, MoveWrists, Protocol,
    RobotState, SendJointChunk, StatusReply, ToolCall, ToolReply, Wait, Walk, WalkMove, WristMove,
};

pub fn spec(task: &str, seed: u32, protocol: Protocol) -> EpisodeSpec {
    EpisodeSpec::new(&tasks::find(task).unwrap(), seed, protocol)
}

pub fn start(task: &str, seed: u32, protocol: Protocol) -> Session {
    Session::start(&spec(task, seed, protocol), None).unwrap()
}

pub fn handover(seed: u32) -> Session {
    start("handover", seed, Protocol::Benchmark)
}

pub fn command(session: &mut Session, call: ToolCall) -> CommandReply {
    match session.call(call).unwrap() {
        ToolReply::Act(reply) => reply,
        other => panic!("{other:?} is no reply to a command"),
    }
}

pub fn wait(session: &mut Session, steps: u32) -> CommandReply {
    command(session, Wait { steps }.into())
}

pub fn status(session: &mut Session) -> StatusReply {
    match session.call(GetStatus::default().into()).unwrap() {
        ToolReply::Manage(ManageReply::GetStatus(status)) => status,
        other => panic!("{other:?} is no status"),
    }
}

pub fn state(session: &mut Session, robot: &str) -> RobotState {
    match session.call(GetRobotState::of(robot).into()).unwrap() {
        ToolReply::Look(LookReply::GetRobotState(state)) => state,
        other => panic!("{other:?} is no state"),
    }
}

/// Returns a command that moves A's right hand to the side of its chest, with fingers half closed.
pub fn raise_hand(steps: u32) -> ToolCall {
    MoveWrists { steps, robots: vec![hand_up()] }.into()
}

pub fn hand_up() -> WristMove {
    WristMove {
        right_position_m: Some([0.28, -0.24, 0.22]),
        right_quaternion_wxyz: Some([1.0, 0.0, 0.0, 0.0]),
        right_fingers_rad: Some([0.0, -0.4, -0.4, 0.6, 0.6, 0.6, 0.6]),
        ..WristMove::hold("A")
    }
}

pub fn squat(height_m: f64) -> ToolCall {
    let entry = WalkMove {
        robot: "B".into(),
        vx_m_s: 0.0,
        vy_m_s: 0.0,
        yaw_rate_rad_s: 0.0,
        pelvis_height_m: Some(height_m),
        waist_yaw_rad: None,
        look_at_m: None,
    };
    Walk { steps: 50, robots: vec![entry] }.into()
}

/// Runs about a second and a half with every kind of command.
pub fn play(session: &mut Session) {
    command(session, raise_hand(25));
    command(session, squat(0.70));
    let rows = vec![row(session, "B"); 5];
    command(session, SendJointChunk { robots: vec![JointChunk { robot: "B".into(), rows }] }.into());
    wait(session, 10);
}

/// Returns the action row that holds a robot at its measured joint positions.
pub fn row(session: &mut Session, robot: &str) -> Vec<f64> {
    let columns = session.briefing().action_row;
    let state = state(session, robot);
    let height_m = state.base_command.as_ref().map(|command| command.pelvis_height_m).expect("a command");
    let base = [0.0, 0.0, 0.0, height_m];
    columns.iter().filter_map(|column| state.joint_positions_rad.get(column)).chain(base).collect()
}
