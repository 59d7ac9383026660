//! What an episode leaves in its folder: `episode.mcap`, `result.json`, `strip.png`, `report.html`.

use std::path::{Path, PathBuf};

use tandem_sim::{RobotCommand, World};
use tandem_tools_spec::{Budget, PhaseReached, Protocol, ResultReply, ToolCall, ToolReply};

use crate::observe::Eyes;
use crate::recorder::{
    ObjectStep, RecordedRobot, Recorder, RecordingHeader, RobotStep, StepRecord, ToolCallRecord,
};
use crate::report::{CallCounts, Report};
use crate::results::{EpisodeResult, OutputError, write_whole};
use crate::strip::{self, Moment};
use crate::tasks::Task;
use crate::{EpisodeError, Facts};

/// The files of an episode under way.
pub struct RunFiles {
    folder: PathBuf,
    recorder: Recorder,
    moments: Vec<Moment>,
    calls: CallCounts,
    budget_left: Option<Budget>,
}

impl RunFiles {
    pub const STRIP: &str = "strip.png";
    pub const REPORT: &str = "report.html";

    /// Makes the folder and begins the recording.
    pub fn create(
        folder: &Path,
        task: &Task,
        seed: u32,
        protocol: Protocol,
        locomotion: &str,
        world: &World,
    ) -> Result<RunFiles, EpisodeError> {
        std::fs::create_dir_all(folder).map_err(|source| OutputError::Io { path: folder.into(), source })?;
        let robots = world.robots().iter();
        let header = RecordingHeader {
            task: task.id.into(),
            seed,
            protocol,
            locomotion: locomotion.into(),
            robots: robots
                .map(|robot| RecordedRobot { name: robot.name.clone(), model: robot.model.clone() })
                .collect(),
        };
        let mut recorder = Recorder::create(folder, header)?;
        recorder.draw("world", world.room())?;
        for (name, geoms) in world.object_geoms() {
            recorder.draw(name, geoms)?;
        }
        Ok(RunFiles {
            folder: folder.into(),
            recorder,
            moments: Vec::new(),
            calls: CallCounts::default(),
            budget_left: None,
        })
    }

    pub fn step(
        &mut self,
        world: &World,
        commands: &[RobotCommand],
        facts: &Facts,
        budget: Budget,
    ) -> Result<(), EpisodeError> {
        self.budget_left = Some(budget);
        let robots: Vec<RobotStep> = commands
            .iter()
            .enumerate()
            .map(|(robot, command)| RobotStep {
                state: world.robot_state(robot),
                command: *command,
                grips: facts
                    .objects
                    .iter()
                    .map(|object| (object.name.clone(), object.hands[robot]))
                    .collect(),
            })
            .collect();
        let objects: Vec<ObjectStep> = world
            .objects()
            .map(|(name, state)| ObjectStep { name, world_from_object: state.world_from_object })
            .collect();
        let step = StepRecord { time_s: world.time_s(), robots: &robots, objects: &objects, budget };
        Ok(self.recorder.step(&step)?)
    }

    pub fn phase(&mut self, phase: &PhaseReached) -> Result<(), EpisodeError> {
        Ok(self.recorder.phase(phase)?)
    }

    pub fn tool_call(
        &mut self,
        time_s: f64,
        call: &ToolCall,
        answer: &Result<ToolReply, EpisodeError>,
    ) -> Result<(), EpisodeError> {
        self.calls.count(call.name(), answer.is_ok());
        let problem = answer.as_ref().err().map(|error| error.to_string());
        let outcome = match (answer, &problem) {
            (Ok(reply), _) => Ok(reply),
            (Err(_), text) => Err(text.as_deref().unwrap_or_default()),
        };
        Ok(self.recorder.tool_call(&ToolCallRecord { time_s, call, outcome })?)
    }

    /// Keeps this moment for the strip.
    pub fn keep_picture(
        &mut self,
        caption: &str,
        world: &World,
        eyes: &mut Eyes,
    ) -> Result<(), EpisodeError> {
        self.moments.push(Moment::capture(caption, world, eyes));
        Ok(())
    }

    /// Closes the recording and writes the rest.
    pub fn finish(self, result: &ResultReply, task: &Task) -> Result<(), EpisodeError> {
        let summary = EpisodeResult::from(result);
        self.recorder.finish(&summary)?;
        let strip = strip::png(&self.moments)?;
        write_whole(&self.folder, Self::STRIP, &strip)?;
        let report =
            Report { task, result, calls: &self.calls, budget_left: self.budget_left, strip: &strip };
        write_whole(&self.folder, Self::REPORT, report.html().as_bytes())?;
        summary.write(&self.folder)?;
        Ok(())
    }
}
