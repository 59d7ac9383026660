//! Descriptions of tasks, protocols and robots for policies.

mod brief;
mod extents;
mod furniture;
mod grips;
mod moving;
mod relative;
mod room;

pub use brief::{brief, teamwork};
pub use extents::{corners_m, extent_m};
#[cfg(test)]
pub use grips::grips;
pub use room::room;

use tandem_sim::BaseLimits;
use tandem_tools_spec::{
    Disclosure, Instruction, JointInfo, PhaseInfo, Protocol, ProtocolInfo, RobotKind, TaskInfo, TaskList,
};

use crate::commands::RobotSheet;
use crate::convert::{rounded, wire_limits};
use crate::protocol::rules;
use crate::scoring::Phase;
use crate::stress::{self, Stress};
use crate::tasks::{Task, TaskSet, TaskWords};

/// Returns the reply to `list_tasks`: these tasks in their wording under `stress`, for robots that follow
/// base commands within `limits`.
pub fn task_list(tasks: &TaskSet, stress: Option<Stress>, limits: &BaseLimits) -> TaskList {
    let info = |task: &Task| task_info(task, stress::task_words(stress, task));
    TaskList { tasks: tasks.all().map(info).collect(), base_limits: wire_limits(limits) }
}

fn task_info(task: &Task, words: TaskWords) -> TaskInfo {
    TaskInfo {
        id: task.id.clone(),
        suite: task.suite().map(str::to_owned),
        robots: instructions(task, &words),
        instruction: words.joint,
        phases: phases(task),
        protocols: Protocol::ALL.map(|protocol| protocol_info(protocol, task)).to_vec(),
    }
}

/// Returns the phases of a task in the order in which they must be reached.
pub fn phases(task: &Task) -> Vec<PhaseInfo> {
    let info = |(index, phase): (usize, &Phase)| PhaseInfo {
        id: phase.id.clone(),
        number: Phase::number(index),
        description: phase.description.clone(),
        collaborative: phase.collaborative,
    };
    task.phases.iter().enumerate().map(info).collect()
}

fn protocol_info(protocol: Protocol, task: &Task) -> ProtocolInfo {
    let rules = rules(protocol, task);
    ProtocolInfo {
        protocol,
        steps_per_command: rules.steps_per_command,
        episode_steps: rules.episode_steps,
        initial_hold_steps: rules.initial_hold_steps,
        wall_clock_s: rules.thinking.map(|thinking| thinking.as_secs_f64()),
        first_seed: rules.seeds.0,
        last_seed: rules.seeds.1,
    }
}

/// Returns the text on how an episode with this disclosure of phases ends.
pub fn ending(disclosure: Disclosure) -> &'static str {
    match disclosure {
        Disclosure::Live => {
            "Replies tell phases once they are reached, and the last of them ends the episode."
        }
        Disclosure::End => {
            "Phases are told once the episode has ended: until then `phases` is empty, whatever has been reached. Success does not \
             end it: look whether the task is done, then call finish."
        }
        Disclosure::Never => {
            "Phases are not told, and success does not end the episode: look whether the task is done, then call finish."
        }
    }
}

/// Returns the instruction of each robot of a task in this wording.
pub fn instructions(task: &Task, words: &TaskWords) -> Vec<Instruction> {
    let part = |(name, instruction): (&str, &String)| Instruction {
        robot: name.into(),
        instruction: instruction.clone(),
    };
    task.robot_names().zip(&words.robots).map(part).collect()
}

/// Returns the description of a kind of robot, by the example `robot`.
pub fn robot_kind(kind: String, robot: &RobotSheet) -> RobotKind {
    RobotKind {
        kind,
        joints: robot
            .model
            .joints
            .iter()
            .map(|joint| JointInfo {
                name: joint.name.clone(),
                lower_rad: rounded(joint.lower_rad.into()),
                upper_rad: rounded(joint.upper_rad.into()),
                effort_n_m: rounded(joint.effort_n_m.into()),
            })
            .collect(),
        base_limits: wire_limits(&robot.base_limits),
    }
}
