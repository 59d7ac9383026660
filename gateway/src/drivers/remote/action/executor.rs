//! Carries out what policies tell robots, by the commands that everybody has: `send_joint_chunk`, or `move_wrists` for poses.

use std::{iter, ops::Range};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use tandem_episodes::players::{LocalEpisode, PlayerError};
use tandem_tools_spec::{
    CommandReply, JointChunk, MoveWrists, Pose, SendJointChunk, StopReason, ToolCall, ToolReply,
};

use super::{
    RobotRows,
    spans::{RowSpan, control_rows, spans},
    wrists::wrist_move,
};
use crate::drivers::remote::{
    columns::{held_row, sensed_pelvis},
    map::{Between, PolicyMap},
    poses::pose_of,
    request::{PolicyObservation, withheld},
};

/// Tells robots what policies decided, and remembers where that left them.
pub struct Executor<'a> {
    map: &'a PolicyMap,
    /// The most steps of one command.
    most_steps: usize,
    /// The row that each robot was last told, in the task's order.
    last_rows: Vec<Vec<f64>>,
    /// Where each robot's pelvis stands by its own odometry.
    start_from_pelvis: Vec<Isometry3<f64>>,
}

/// A command that is not made yet: where pelvises stand when it begins decides what wrists are told.
#[derive(Clone, Debug, PartialEq)]
pub enum PlannedCommand {
    Joints(SendJointChunk),
    /// Every robot goes to its row of this number.
    Wrists {
        row: usize,
        steps: u32,
    },
}

/// How many rows of each robot are executed: as many as every robot has.
pub fn executed_rows(chunks: &[RobotRows]) -> usize {
    chunks.iter().map(|chunk| chunk.rows.len()).min().unwrap_or_default()
}

impl<'a> Executor<'a> {
    /// Robots that are as they were `observed` to be and were told nothing yet.
    pub fn new(map: &'a PolicyMap, most_steps: usize, observed: &PolicyObservation) -> Executor<'a> {
        let last_rows = observed.robots.iter().map(|robot| held_row(&robot.state_values)).collect();
        let mut executor =
            Executor { map, most_steps: most_steps.max(1), last_rows, start_from_pelvis: Vec::new() };
        executor.sense(observed);
        executor
    }

    /// Takes up where robots are.
    pub fn sense(&mut self, observed: &PolicyObservation) {
        let pelvises = observed.robots.iter().map(|robot| pose_of(sensed_pelvis(&robot.state_values)));
        self.start_from_pelvis = pelvises.collect();
    }

    /// Carries out the rows with the numbers `rows` of `chunks`, which are in the task's order.
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

    /// The commands that carry out the rows with the numbers `rows`, none longer than the protocol allows.
    pub fn commands(&self, chunks: &[RobotRows], rows: Range<usize>) -> Vec<PlannedCommand> {
        let mut spans = spans(executed_rows(chunks), self.map.rate_hz());
        spans.retain(|span| rows.contains(&span.row));
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

    /// The call that a command of [`Executor::commands`] is now.
    pub fn call(&self, planned: PlannedCommand, chunks: &[RobotRows]) -> ToolCall {
        match planned {
            PlannedCommand::Joints(command) => command.into(),
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
