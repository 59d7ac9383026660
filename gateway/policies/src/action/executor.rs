//! Executes the actions of policies with the public commands: `send_joint_chunk`, `move_wrists` for wrist
//! poses, or `send_joint_drives` for motor setpoints.

use std::{iter, ops::Range};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use tandem_episodes::players::{LocalEpisode, PlayerError};
use tandem_tools_spec::{
    CommandReply, JointChunk, JointDrives, MoveWrists, Pose, SendJointChunk, SendJointDrives, StopReason,
    ToolCall, ToolReply,
};

use super::{
    RobotRows,
    spans::{RowSpan, control_rows, spans},
    wrists::wrist_move,
};
use crate::{
    columns::{held_row, sensed_pelvis},
    map::{Between, PolicyMap},
    poses::pose_of,
    request::{PolicyObservation, withheld},
};

/// Executor of a policy's actions, which keeps track of the robots' state.
pub struct Executor<'a> {
    map: &'a PolicyMap,
    /// Maximum number of control steps per command.
    most_steps: usize,
    /// Last commanded row of each robot, in the task's order.
    last_rows: Vec<Vec<f64>>,
    /// Pose of each robot's pelvis in its start frame, from the robot's odometry.
    start_from_pelvis: Vec<Isometry3<f64>>,
}

/// A command before its conversion to a call. Its wrist targets depend on the pelvis poses at its beginning.
#[derive(Clone, Debug, PartialEq)]
pub enum PlannedCommand {
    Joints(SendJointChunk),
    Drives(SendJointDrives),
    /// Every robot moves to the wrist targets of its row with this index.
    Wrists {
        row: usize,
        steps: u32,
    },
}

/// Returns the number of rows to execute: the length of the shortest chunk.
pub fn executed_rows(chunks: &[RobotRows]) -> usize {
    chunks.iter().map(|chunk| chunk.rows.len()).min().unwrap_or_default()
}

impl<'a> Executor<'a> {
    /// Creates an executor for robots in the `observed` state that have had no command yet.
    pub fn new(map: &'a PolicyMap, most_steps: usize, observed: &PolicyObservation) -> Executor<'a> {
        let last_rows = observed.robots.iter().map(|robot| held_row(&robot.state_values)).collect();
        let mut executor =
            Executor { map, most_steps: most_steps.max(1), last_rows, start_from_pelvis: Vec::new() };
        executor.sense(observed);
        executor
    }

    /// Updates the pelvis poses from an observation.
    pub fn sense(&mut self, observed: &PolicyObservation) {
        let pelvises = observed.robots.iter().map(|robot| pose_of(sensed_pelvis(&robot.state_values)));
        self.start_from_pelvis = pelvises.collect();
    }

    /// Executes the rows with the indices `rows` from `chunks`, which are in the task's order of robots.
    pub fn execute(
        &mut self,
        episode: &mut dyn LocalEpisode,
        chunks: &[RobotRows],
        rows: Range<usize>,
    ) -> Result<(), PlayerError> {
        for planned in self.commands(chunks, rows.clone()) {
            if let ToolReply::Act(reply) = episode.carry_out(self.call(planned, chunks))? {
                if reply.stop_reason != StopReason::StepsDone {
                    return Err(PlayerError::EpisodeOver);
                }
                self.take_report(&reply, chunks)?;
            }
        }
        for (last_row, chunk) in self.last_rows.iter_mut().zip(chunks) {
            last_row.clone_from(&chunk.rows[rows.end - 1].row);
        }
        Ok(())
    }

    /// Returns the commands for the rows with the indices `rows`. No command is longer than the protocol
    /// allows.
    pub fn commands(&self, chunks: &[RobotRows], rows: Range<usize>) -> Vec<PlannedCommand> {
        let mut spans = spans(executed_rows(chunks), self.map.rate_hz());
        spans.retain(|span| rows.contains(&span.row));
        if self.map.drives_motors() {
            return self.drive_commands(chunks, &spans);
        }
        match (self.map.moves_wrists(), self.map.chunk.between) {
            (false, between) => self.joint_commands(chunks, &spans, between),
            (true, Between::Interpolate) => {
                let command = |span: RowSpan| PlannedCommand::Wrists { row: span.row, steps: span.steps };
                spans.into_iter().map(command).collect()
            }
            (true, Between::Hold) => {
                let at_once = |span: RowSpan| {
                    let command = PlannedCommand::Wrists { row: span.row, steps: 1 };
                    iter::repeat_n(command, span.steps as usize)
                };
                spans.into_iter().flat_map(at_once).collect()
            }
        }
    }

    fn joint_commands(
        &self,
        chunks: &[RobotRows],
        spans: &[RowSpan],
        between: Between,
    ) -> Vec<PlannedCommand> {
        let of_robots = chunks.iter().zip(&self.last_rows);
        let of_robots: Vec<Vec<Vec<f64>>> =
            of_robots.map(|(chunk, from)| control_rows(&chunk.rows, spans, from, between)).collect();
        let steps = of_robots.first().map_or(0, Vec::len);
        let command = |from: usize| {
            let to = steps.min(from + self.most_steps);
            let part = |(chunk, rows): (&RobotRows, &Vec<Vec<f64>>)| JointChunk {
                robot: chunk.robot.clone(),
                rows: rows[from..to].to_vec(),
            };
            PlannedCommand::Joints(SendJointChunk {
                robots: chunks.iter().zip(&of_robots).map(part).collect(),
            })
        };
        (0..steps).step_by(self.most_steps).map(command).collect()
    }

    /// Returns the commands for motors. Each row is held until the next one.
    fn drive_commands(&self, chunks: &[RobotRows], spans: &[RowSpan]) -> Vec<PlannedCommand> {
        let rows: Vec<usize> =
            spans.iter().flat_map(|span| iter::repeat_n(span.row, span.steps as usize)).collect();
        let command = |rows: &[usize]| {
            let part = |chunk: &RobotRows| JointDrives {
                robot: chunk.robot.clone(),
                rows: rows.iter().map(|row| chunk.rows[*row].motor_row.clone()).collect(),
            };
            PlannedCommand::Drives(SendJointDrives { robots: chunks.iter().map(part).collect() })
        };
        rows.chunks(self.most_steps).map(command).collect()
    }

    /// Converts a command from [`Executor::commands`] to a call for the current state.
    pub fn call(&self, planned: PlannedCommand, chunks: &[RobotRows]) -> ToolCall {
        match planned {
            PlannedCommand::Joints(command) => command.into(),
            PlannedCommand::Drives(command) => command.into(),
            PlannedCommand::Wrists { row, steps } => {
                let told_columns = self.map.told_columns();
                let entry = |(chunk, start_from_pelvis): (&RobotRows, &Isometry3<f64>)| {
                    let frame = self.map.chunk.wrist_frame;
                    wrist_move(&chunk.robot, &chunk.rows[row], &told_columns, frame, start_from_pelvis)
                };
                let robots = chunks.iter().zip(&self.start_from_pelvis).map(entry).collect();
                MoveWrists { steps, robots }.into()
            }
        }
    }

    fn take_report(&mut self, reply: &CommandReply, chunks: &[RobotRows]) -> Result<(), PlayerError> {
        for (chunk, start_from_pelvis) in chunks.iter().zip(&mut self.start_from_pelvis) {
            if let Some(report) = reply.robots.iter().find(|report| report.robot == chunk.robot) {
                let pelvis_in_start = report.pelvis_in_start.ok_or_else(|| withheld("a command"))?;
                let Pose { position_m, quaternion_wxyz: [w, x, y, z] } = pelvis_in_start;
                let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                *start_from_pelvis = Isometry3::from_parts(Translation3::from(position_m), rotation);
            }
        }
        Ok(())
    }
}
