//! Replay of a recorded episode's commands from a phase's start. On the build that made the recording, it
//! reaches every phase as recorded, the most that any player can reach from that start.

use tandem_sim::Step;
use tandem_tools_spec::{JointChunk, SendJointChunk};

use super::{Episode, Player, PlayerError};
use crate::commands::base_row;
use crate::recording::{Recording, RecordingError};
use crate::spec::{EpisodeSpec, PhaseStart, Start};

/// A player that sends recorded action rows.
pub struct Demonstration {
    spec: EpisodeSpec,
}

impl Demonstration {
    pub fn new(spec: &EpisodeSpec) -> Demonstration {
        Demonstration { spec: spec.clone() }
    }

    /// Returns the recorded steps after the start.
    fn steps(&self) -> Result<Vec<Step>, PlayerError> {
        let unreadable = |error: RecordingError| PlayerError::GaveUp(error.to_string());
        let Start::Phase(PhaseStart { recording, phase }) = &self.spec.start else {
            return Err(PlayerError::GaveUp("it starts at no phase of a demonstration".into()));
        };
        let recording = Recording::read(recording).map_err(unreadable)?;
        let start = recording.checkpoint(phase);
        let from_s = start.map_or(f64::INFINITY, |start| start.time_s);
        let steps = recording.steps();
        let later = steps.filter(|step| !matches!(step, Ok(step) if step.time_s <= from_s));
        later.collect::<Result<_, _>>().map_err(unreadable)
    }
}

impl Player for Demonstration {
    fn play(&mut self, episode: &mut dyn Episode) -> Result<(), PlayerError> {
        let most = self.spec.rules().steps_per_command;
        for steps in self.steps()?.chunks(most as usize) {
            let names = self.spec.task.robot_names().enumerate();
            let rows = |robot: usize| steps.iter().map(|step| recorded_action(step, robot)).collect();
            let robots = names.map(|(robot, name)| JointChunk { robot: name.into(), rows: rows(robot) });
            episode.call(SendJointChunk { robots: robots.collect() }.into())?;
        }
        Ok(())
    }
}

/// Returns the action row of robot number `robot` in `step`.
pub fn recorded_action(step: &Step, robot: usize) -> Vec<f64> {
    let command = &step.robots[robot].command;
    command.upper_rad.into_iter().chain(base_row(&command.base)).map(f64::from).collect()
}
