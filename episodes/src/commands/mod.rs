//! Commands: an acting tool call becomes one order per robot, once; orders become joint targets, step by step.

mod aim;
mod called;
mod columns;
mod motion;
mod orders;
mod own;
mod reach;
mod report;
mod run;
mod upper_body;

pub use aim::Aim;
pub use called::{Called, OperatorCommand};
pub use columns::{action_row, base_row};
pub use motion::{Motion, MotionState, RobotSheet};
pub use own::own;
pub use reach::check_reach;
pub use report::report;
pub use run::Run;
pub use upper_body::{UpperBody, upper_body};

use tandem_sim::{BaseCommand, HAND_JOINTS, Sides, UPPER_JOINTS};
use tandem_tools_spec::ActCall;

use crate::EpisodeError;
use crate::protocol::Rules;

/// What all robots do for some control steps.
pub struct Command {
    pub steps: u32,
    /// One per robot of the episode.
    pub orders: Vec<Order>,
    /// Control steps that each robot's order is made for: of a longer one, only the beginning is executed.
    pub made_for: Vec<u32>,
    /// Robots that the caller named, in its order, or all that wait: these are reported on.
    named: Vec<usize>,
}

/// What one robot is to do, and what of it had to be cut down.
pub struct Order {
    pub movement: Movement,
    pub cut: Cut,
}

/// What one robot does during a command.
#[derive(Clone, Debug)]
pub enum Movement {
    /// Nothing new is asked for, and the base stands: hands go on to where they were told to be.
    Hold,
    /// Wrists and fingers arrive with the command's last step.
    Reach(Box<Goals>),
    /// The base moves; arms and hands keep their joints.
    Walk(BaseCommand),
    /// One row per step.
    Rows(Vec<Row>),
}

/// Where hands are to be; fingers that are `None` stay.
#[derive(Clone, Debug)]
pub struct Goals {
    pub wrists: Sides<Aim>,
    /// How the wrists give way; `None` for not at all.
    pub compliance_n_s_m: Option<f64>,
    pub fingers_rad: Sides<Option<[f64; HAND_JOINTS]>>,
    pub base: BaseCommand,
}

/// Joint targets and base command of one control step.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    pub upper_rad: [f64; UPPER_JOINTS],
    pub base: BaseCommand,
}

/// What lay beyond a limit and was moved there.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    /// Columns of the action row.
    columns: Vec<usize>,
    /// Fields of the base command.
    base: Vec<&'static str>,
}

impl Command {
    /// Reads a call for the robots that `motions` move. Either all of it is in order, or none of it becomes a command.
    pub fn read(call: &ActCall, rules: &Rules, motions: &[Motion]) -> Result<Command, EpisodeError> {
        match call {
            ActCall::MoveWrists(args) => {
                let entries = args.robots.iter().map(|entry| (entry.robot.as_str(), entry));
                Command::of(rules.steps(args.steps as usize)?, entries, motions, orders::reach)
            }
            ActCall::Walk(args) => {
                let entries = args.robots.iter().map(|entry| (entry.robot.as_str(), entry));
                Command::of(rules.steps(args.steps as usize)?, entries, motions, orders::walk)
            }
            ActCall::SendJointChunk(args) => {
                let rows = args.robots.first().map_or(0, |chunk| chunk.rows.len());
                let entries = args.robots.iter().map(|chunk| (chunk.robot.as_str(), chunk.rows.as_slice()));
                Command::of(rules.steps(rows)?, entries, motions, orders::rows)
            }
            ActCall::Wait(args) => {
                let hold = Command::hold(rules.steps(args.steps as usize)?, motions.len());
                Ok(Command { named: (0..motions.len()).collect(), ..hold })
            }
        }
    }

    /// `robots` robots stand still for `steps` control steps.
    pub fn hold(steps: u32, robots: usize) -> Command {
        let orders = (0..robots).map(|_| Order::hold()).collect();
        Command { steps, orders, made_for: vec![steps; robots], named: Vec::new() }
    }

    /// What several robots, by index, are told each by a command of its own, side by side and for as long as the shortest of them.
    pub fn together(parts: Vec<(usize, Command)>, robots: usize) -> Command {
        let steps = parts.iter().map(|(_, part)| part.steps).min().unwrap_or_default();
        let mut command = Command::hold(steps, robots);
        for (robot, part) in parts {
            command.made_for[robot] = part.steps;
            command.orders.splice(robot..=robot, part.orders.into_iter().nth(robot));
            command.named.push(robot);
        }
        command
    }

    /// The robots to report on, and what of their orders had to be cut down.
    pub fn cuts(&self) -> Vec<(usize, Cut)> {
        self.named.iter().map(|robot| (*robot, self.orders[*robot].cut.clone())).collect()
    }

    /// Robots with an entry get the order that `order` makes of it, the others hold.
    fn of<'a, Entry>(
        steps: u32,
        entries: impl Iterator<Item = (&'a str, Entry)>,
        motions: &[Motion],
        order: impl Fn(Entry, &Motion) -> Order,
    ) -> Result<Command, EpisodeError> {
        let mut command = Command::hold(steps, motions.len());
        for (name, entry) in entries {
            let robot = find(name, motions)?;
            command.orders[robot] = order(entry, &motions[robot]);
            command.named.push(robot);
        }
        Ok(command)
    }
}

impl Order {
    fn hold() -> Order {
        Order { movement: Movement::Hold, cut: Cut::default() }
    }
}

/// Index of the robot called `name`.
pub fn find(name: &str, motions: &[Motion]) -> Result<usize, EpisodeError> {
    let names = || motions.iter().map(|motion| motion.robot.name.clone());
    names()
        .position(|known| known == name)
        .ok_or_else(|| EpisodeError::UnknownRobot { name: name.into(), have: names().collect() })
}

#[cfg(test)]
mod tests;
