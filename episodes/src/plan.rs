//! Commands as plans for single robots, and the report on what became of them.

use nalgebra::Isometry3;
use tandem_ik::FrameError;
use tandem_sim::{
    ARM_COLUMNS, ARM_JOINTS, BaseCommand, HAND_COLUMNS, HAND_JOINTS, Robot, RobotState, Side, UPPER,
    UPPER_JOINTS, WAIST_COLUMN,
};
use tandem_tools_spec::{
    CheckReach, HandReach, HandReport, Protocol, ReachReply, RobotReport, ToolCall, WalkMove, WristMove,
};

use crate::convert::{clamp_base, isometry, isometry_from_sim, rounded, wire_pose};
use crate::motion::{Motion, Plan};

/// A measured joint this near to its limit rests at it.
const AT_LIMIT_RAD: f32 = 0.01;

/// What one robot is to do, and what of it had to be cut down.
pub struct Order {
    pub plan: Plan,
    /// Columns of the action row whose target lay beyond a limit.
    clamped: Vec<usize>,
    base_clamped: Vec<String>,
}

/// Control steps that a command asks for.
pub fn steps(call: &ToolCall) -> usize {
    match call {
        ToolCall::MoveWrists(args) => args.steps as usize,
        ToolCall::Walk(args) => args.steps as usize,
        ToolCall::Wait(args) => args.steps as usize,
        ToolCall::SendJointChunk(args) => args.robots.first().map_or(0, |chunk| chunk.rows.len()),
        _ => 0,
    }
}

/// Robots that a command names, in its order.
pub fn named_robots(call: &ToolCall) -> Vec<&str> {
    match call {
        ToolCall::MoveWrists(args) => args.robots.iter().map(|entry| entry.robot.as_str()).collect(),
        ToolCall::Walk(args) => args.robots.iter().map(|entry| entry.robot.as_str()).collect(),
        ToolCall::SendJointChunk(args) => args.robots.iter().map(|entry| entry.robot.as_str()).collect(),
        _ => Vec::new(),
    }
}

pub fn protocol_name(protocol: Protocol) -> &'static str {
    match protocol {
        Protocol::Agentic => "agentic",
        Protocol::Benchmark => "benchmark",
    }
}

/// The plan for robot `name` of a command that names it.
pub fn order(call: &ToolCall, name: &str, robot: &Robot, motion: &Motion) -> Order {
    let hold = Order { plan: motion.hold(), clamped: Vec::new(), base_clamped: Vec::new() };
    match call {
        ToolCall::MoveWrists(args) => args
            .robots
            .iter()
            .find(|entry| entry.robot == name)
            .map_or(hold, |entry| wrist_order(entry, robot, motion)),
        ToolCall::Walk(args) => args
            .robots
            .iter()
            .find(|entry| entry.robot == name)
            .map_or(hold, |entry| walk_order(entry, robot, motion)),
        ToolCall::SendJointChunk(args) => args
            .robots
            .iter()
            .find(|entry| entry.robot == name)
            .map_or(hold, |entry| chunk_order(&entry.rows, robot, motion)),
        _ => hold,
    }
}

fn wrist_order(entry: &WristMove, robot: &Robot, motion: &Motion) -> Order {
    let mut order = base_order(
        [entry.vx_m_s.unwrap_or(0.0), entry.vy_m_s.unwrap_or(0.0), entry.yaw_rate_rad_s.unwrap_or(0.0)],
        entry.pelvis_height_m,
        robot,
        motion,
    );
    order.plan.wrists = [
        wrist_target(entry.left_position_m, entry.left_quaternion_wxyz, &motion.targets()[0]),
        wrist_target(entry.right_position_m, entry.right_quaternion_wxyz, &motion.targets()[1]),
    ];
    for (side, fingers) in [(Side::Left, &entry.left_fingers_rad), (Side::Right, &entry.right_fingers_rad)] {
        let Some(fingers) = fingers else { continue };
        let mut goal_rad = [0.0; HAND_JOINTS];
        for (finger, asked_rad) in fingers.iter().enumerate() {
            let column = HAND_COLUMNS[side] + finger;
            goal_rad[finger] = clamp_column(robot, column, *asked_rad, &mut order.clamped);
        }
        order.plan.fingers_rad[side.index()] = Some(goal_rad);
    }
    order
}

/// A pose of which either half may be left as it was.
fn wrist_target(
    position_m: Option<[f64; 3]>,
    quaternion_wxyz: Option<[f64; 4]>,
    present: &Isometry3<f64>,
) -> Option<Isometry3<f64>> {
    if position_m.is_none() && quaternion_wxyz.is_none() {
        return None;
    }
    let kept = wire_pose(present);
    Some(isometry(position_m.unwrap_or(kept.position_m), quaternion_wxyz.unwrap_or(kept.quaternion_wxyz)))
}

fn walk_order(entry: &WalkMove, robot: &Robot, motion: &Motion) -> Order {
    base_order([entry.vx_m_s, entry.vy_m_s, entry.yaw_rate_rad_s], entry.pelvis_height_m, robot, motion)
}

fn base_order(velocity: [f64; 3], height_m: Option<f64>, robot: &Robot, motion: &Motion) -> Order {
    let asked = BaseCommand {
        vx_m_s: velocity[0] as f32,
        vy_m_s: velocity[1] as f32,
        yaw_rate_rad_s: velocity[2] as f32,
        pelvis_height_m: height_m.map_or(motion.base().pelvis_height_m, |height_m| height_m as f32),
    };
    let (base, base_clamped) = clamp_base(asked, &robot.base_limits());
    Order { plan: Plan { base, ..motion.hold() }, clamped: Vec::new(), base_clamped }
}

fn chunk_order(rows: &[Vec<f64>], robot: &Robot, motion: &Motion) -> Order {
    let mut order = Order { plan: motion.hold(), clamped: Vec::new(), base_clamped: Vec::new() };
    let mut plan_rows = Vec::with_capacity(rows.len());
    for row in rows {
        let upper_rad: [f64; UPPER_JOINTS] =
            std::array::from_fn(|column| clamp_column(robot, column, row[column], &mut order.clamped));
        let [vx, vy, yaw_rate, height] = [31, 32, 33, 34].map(|column| row[column] as f32);
        let asked = BaseCommand { vx_m_s: vx, vy_m_s: vy, yaw_rate_rad_s: yaw_rate, pelvis_height_m: height };
        let (base, moved) = clamp_base(asked, &robot.base_limits());
        for field in moved {
            if !order.base_clamped.contains(&field) {
                order.base_clamped.push(field);
            }
        }
        order.plan.base.pelvis_height_m = base.pelvis_height_m;
        plan_rows.push((upper_rad, base));
    }
    order.plan.rows = Some(plan_rows);
    order
}

/// A joint target within its joint's limits; notes the column if it had to be moved there.
fn clamp_column(robot: &Robot, column: usize, asked_rad: f64, clamped: &mut Vec<usize>) -> f64 {
    let joint = &robot.model.joints[UPPER[column]];
    let within_rad = asked_rad.clamp(joint.lower_rad.into(), joint.upper_rad.into());
    if within_rad != asked_rad && !clamped.contains(&column) {
        clamped.push(column);
    }
    within_rad
}

/// How a robot did under an order that has just been executed.
pub fn report(order: &Order, robot: &Robot, state: &RobotState, motion: &Motion) -> RobotReport {
    let names = |columns: &mut dyn Iterator<Item = usize>| -> Vec<String> {
        columns.map(|column| robot.model.joints[UPPER[column]].name.clone()).collect()
    };
    let at_limit = |column: usize| {
        let joint = &robot.model.joints[UPPER[column]];
        let q_rad = state.q_rad[UPPER[column]];
        q_rad < joint.lower_rad + AT_LIMIT_RAD || q_rad > joint.upper_rad - AT_LIMIT_RAD
    };
    let hand = |side: Side| {
        let (arm, hand) = (ARM_COLUMNS[side], HAND_COLUMNS[side]);
        let is_own = move |column: usize| {
            (arm..arm + ARM_JOINTS).contains(&column) || (hand..hand + HAND_JOINTS).contains(&column)
        };
        let target = &motion.targets()[side.index()];
        let measured = isometry_from_sim(&state.pelvis_from_wrist[side]);
        let missing = measured.inverse() * target;
        HandReport {
            target: wire_pose(target),
            measured: wire_pose(&measured),
            position_error_m: rounded(missing.translation.vector.norm()),
            orientation_error_rad: rounded(missing.rotation.angle()),
            joints_clamped: names(&mut order.clamped.iter().copied().filter(|column| is_own(*column))),
            // A finger is at a limit whenever the hand is open; that says nothing about reach.
            joints_at_limit: names(&mut (arm..arm + ARM_JOINTS).filter(|column| at_limit(*column))),
        }
    };
    RobotReport {
        robot: robot.name.clone(),
        left: hand(Side::Left),
        right: hand(Side::Right),
        waist_joints_clamped: names(
            &mut order.clamped.iter().copied().filter(|column| *column >= WAIST_COLUMN),
        ),
        waist_joints_at_limit: names(&mut (WAIST_COLUMN..UPPER_JOINTS).filter(|column| at_limit(*column))),
        base_command_clamped: order.base_clamped.clone(),
    }
}

/// Whether a robot's wrists would reach the poses asked for.
pub fn check_reach(args: &CheckReach, motion: &Motion) -> ReachReply {
    let [left, right] = motion.targets();
    let targets = [
        wrist_target(args.left_position_m, args.left_quaternion_wxyz, left).unwrap_or(*left),
        wrist_target(args.right_position_m, args.right_quaternion_wxyz, right).unwrap_or(*right),
    ];
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
    ReachReply {
        robot: args.robot.clone(),
        reachable: left.reachable && right.reachable,
        left,
        right,
        joints_at_limit,
    }
}

fn is_within_reach(error: &FrameError) -> bool {
    let tolerance = crate::motion::REACH_TOLERANCE;
    error.position_m <= tolerance.position_m && error.orientation_rad <= tolerance.orientation_rad
}
