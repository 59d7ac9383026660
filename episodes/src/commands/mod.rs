//! Commands: an acting tool call is converted once to orders for robots, and each order to a trajectory of
//! joint targets.
//!
//! Each acting tool has a separate file that converts its arguments to joint targets: `move_wrists`, `walk`,
//! `send_joint_chunk`, `send_joint_drives`, `wait`.

mod aim;
mod called;
mod check_reach;
pub(crate) mod columns;
mod footing;
mod joints;
mod motion;
mod move_wrists;
mod report;
mod upper_body;
mod wait;
mod walk;

pub(crate) use called::Allowed;
pub use called::{Called, OperatorCall, OperatorCommand};
pub use check_reach::check_reach;
pub use columns::{Clamped, TargetCounts, action_row, base_row};
pub use joints::Executed;
pub(crate) use joints::drive_row;
pub use motion::{Motion, MotionState, RobotSheet};
pub use report::{grip, report, report_wrists_in, wrist_state};
pub use upper_body::{UpperBody, upper_body};

use tandem_sim::RobotCommand;
use tandem_tools_spec::{ActCall, JointChunk, JointDrives, WalkMove, WristMove};

use crate::EpisodeError;
use crate::protocol::Rules;
use joints::{DriveTrajectory, JointTrajectory};
use move_wrists::WristTrajectory;
pub(crate) use move_wrists::wrist_targets;
use walk::WalkTrajectory;

/// Orders to robots for a number of control steps. A robot without an order holds still.
#[derive(Clone, Debug)]
pub struct Command {
    pub steps: u32,
    /// At most one order for each robot, in the order of the report.
    pub orders: Vec<RobotOrder>,
}

/// Order to a robot, given by its index. It has been checked and cannot be refused any more.
#[derive(Clone, Debug)]
pub struct RobotOrder {
    pub robot: usize,
    /// Duration of the order in control steps. A shorter command executes only its beginning.
    pub steps: u32,
    pub action: RobotAction,
}

/// Departures from the benchmark of wrist commands with carried targets, or with compliance.
const CARRIED: &str = "wrist commands: carried";
const COMPLIANCE: &str = "wrist commands: compliance";
/// Departure of commands that drive every joint; the robot's name follows.
const JOINT_CONTROL: &str = "control: joint";

/// Action of one robot, with the arguments of its tool.
#[derive(Clone, Debug)]
pub enum RobotAction {
    MoveWrists(Box<WristMove>),
    Walk(WalkMove),
    SendJointChunk(JointChunk),
    SendJointDrives(JointDrives),
    Wait,
}

impl RobotAction {
    /// Returns the departures from the benchmark's commands.
    pub fn departures(&self) -> Vec<String> {
        match self {
            RobotAction::MoveWrists(entry) => {
                let compliances =
                    [entry.compliance_n_s_m, entry.side_compliance_n_s_m, entry.turn_compliance_n_m_s_rad];
                let gives_way = compliances.iter().any(Option::is_some);
                let departures = [(CARRIED, entry.carried == Some(true)), (COMPLIANCE, gives_way)];
                departures.into_iter().filter(|(_, departs)| *departs).map(|(name, _)| name.into()).collect()
            }
            RobotAction::SendJointDrives(entry) => vec![format!("{JOINT_CONTROL} ({})", entry.robot)],
            RobotAction::Walk(_) | RobotAction::SendJointChunk(_) | RobotAction::Wait => Vec::new(),
        }
    }

    /// Returns true if the robot's drives and base controller execute the command. Returns false for
    /// setpoints of its motors, and for waiting, which changes no target.
    fn is_for_controller(&self) -> bool {
        match self {
            RobotAction::MoveWrists(_) | RobotAction::Walk(_) | RobotAction::SendJointChunk(_) => true,
            RobotAction::SendJointDrives(_) | RobotAction::Wait => false,
        }
    }
}

/// Trajectory of one robot, by control step.
pub enum Trajectory {
    /// The base stands, and hands continue to their targets.
    Hold,
    Wrists(Box<WristTrajectory>),
    Walk(WalkTrajectory),
    Joints(JointTrajectory),
    Drives(DriveTrajectory),
}

impl Command {
    /// Reads a call for the robots of `motions`.
    ///
    /// # Errors
    ///
    /// Any error in the call; the command is then refused as a whole.
    pub fn read(call: &ActCall, rules: &Rules, motions: &[Motion]) -> Result<Command, EpisodeError> {
        let steps = rules.steps(call.steps())?;
        let order = |(name, action): (&str, RobotAction)| {
            find(name, motions).map(|robot| RobotOrder { robot, steps, action })
        };
        let orders = actions(call, motions).into_iter().map(order).collect::<Result<_, _>>()?;
        Ok(Command { steps, orders })
    }

    /// Returns a command with which all robots hold still, without reports.
    pub fn hold(steps: u32) -> Command {
        Command { steps, orders: Vec::new() }
    }

    /// Combines orders to several robots, which are executed at the same time for the duration of the
    /// shortest.
    pub fn together(orders: Vec<RobotOrder>) -> Command {
        let steps = orders.iter().map(|order| order.steps).min().unwrap_or_default();
        Command { steps, orders }
    }
}

impl Trajectory {
    /// Starts `action` on `motion`, to be finished within `steps` control steps. Returns the trajectory
    /// and the clamped values.
    pub fn begin(action: &RobotAction, steps: u32, motion: &mut Motion) -> (Trajectory, Clamped) {
        let mut clamped = Clamped::default();
        if action.is_for_controller() {
            motion.hand_back();
        }
        let trajectory = match action {
            RobotAction::MoveWrists(entry) => {
                Trajectory::Wrists(WristTrajectory::begin(entry, steps, motion, &mut clamped).into())
            }
            RobotAction::Walk(entry) => Trajectory::Walk(WalkTrajectory::begin(entry, motion, &mut clamped)),
            RobotAction::SendJointChunk(chunk) => {
                Trajectory::Joints(JointTrajectory::begin(chunk, motion, &mut clamped))
            }
            RobotAction::SendJointDrives(drives) => Trajectory::Drives(DriveTrajectory::begin(drives)),
            RobotAction::Wait => Trajectory::Hold,
        };
        (trajectory, clamped)
    }

    /// Returns the command of control step `step`, counted from 1.
    pub fn command(&self, step: u32, motion: &mut Motion) -> RobotCommand {
        match self {
            Trajectory::Hold => wait::hold(motion),
            Trajectory::Wrists(wrists) => wrists.advance(step, motion),
            Trajectory::Walk(walk) => walk.advance(step, motion),
            Trajectory::Joints(joints) => joints.advance(step, motion),
            Trajectory::Drives(drives) => drives.advance(step, motion),
        }
        motion.command()
    }
}

/// Returns the action of each robot in a call, with the robot's name.
fn actions<'a>(call: &'a ActCall, motions: &'a [Motion]) -> Vec<(&'a str, RobotAction)> {
    match call {
        ActCall::MoveWrists(args) => {
            let action = |entry: &'a WristMove| {
                (entry.robot.as_str(), RobotAction::MoveWrists(Box::new(entry.clone())))
            };
            args.robots.iter().map(action).collect()
        }
        ActCall::Walk(args) => {
            args.robots.iter().map(|entry| (entry.robot.as_str(), RobotAction::Walk(entry.clone()))).collect()
        }
        ActCall::SendJointChunk(args) => {
            let action =
                |chunk: &'a JointChunk| (chunk.robot.as_str(), RobotAction::SendJointChunk(chunk.clone()));
            args.robots.iter().map(action).collect()
        }
        ActCall::SendJointDrives(args) => {
            let action = |drives: &'a JointDrives| {
                (drives.robot.as_str(), RobotAction::SendJointDrives(drives.clone()))
            };
            args.robots.iter().map(action).collect()
        }
        ActCall::Wait(_) => {
            motions.iter().map(|motion| (motion.robot.name.as_str(), RobotAction::Wait)).collect()
        }
    }
}

/// Returns the index of the robot called `name`.
///
/// # Errors
///
/// [`EpisodeError::UnknownRobot`], which lists the robots.
pub fn find(name: &str, motions: &[Motion]) -> Result<usize, EpisodeError> {
    let names = || motions.iter().map(|motion| motion.robot.name.clone());
    names()
        .position(|known| known == name)
        .ok_or_else(|| EpisodeError::UnknownRobot { name: name.into(), have: names().collect() })
}

#[cfg(test)]
mod tests;
