//! What an episode leaves in its folder: `episode.mcap`, `result.json`, `strip.png`, `report.html`.

use std::path::{Path, PathBuf};

use tandem_sim::Step;
use tandem_tools_spec::{Budget, PhaseReached, ResultReply, ToolCall, ToolReply};

use super::{Session, this_build};
use crate::EpisodeError;
use crate::output::{OutputError, write_whole};
use crate::recording::{Recorder, RecordingHeader, ToolCallRecord};
use crate::reports::{self, CallCounts, EpisodePage, EpisodeResult, Moment};
use crate::scoring::Facts;
use crate::tasks::Task;

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

    /// Makes the folder and begins the recording where `session` stands.
    pub(super) fn create(folder: &Path, session: &Session) -> Result<RunFiles, EpisodeError> {
        std::fs::create_dir_all(folder).map_err(|source| OutputError::Io { path: folder.into(), source })?;
        let header = RecordingHeader {
            spec: session.spec().clone(),
            locomotion: session.origin.locomotion.clone(),
            build: this_build()?.into(),
            robots: session.motions.iter().map(|motion| motion.robot.clone()).collect(),
            scores: session.scores.memory(),
        };
        let mut recorder = Recorder::create(folder, header, &session.present)?;
        recorder.draw("world", session.world.room())?;
        for (name, model) in session.world.object_models() {
            recorder.draw(name, &model.geoms)?;
        }
        Ok(RunFiles {
            folder: folder.into(),
            recorder,
            moments: Vec::new(),
            calls: CallCounts::default(),
            budget_left: None,
        })
    }

    pub(super) fn step(&mut self, step: &Step, facts: &Facts, budget: Budget) -> Result<(), EpisodeError> {
        self.budget_left = Some(budget);
        Ok(self.recorder.step(step, facts, budget)?)
    }

    pub(super) fn phase(&mut self, phase: &PhaseReached) -> Result<(), EpisodeError> {
        Ok(self.recorder.phase(phase)?)
    }

    pub(super) fn tool_call(
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

    /// Keeps a moment for the strip.
    pub(super) fn keep(&mut self, moment: Moment) {
        self.moments.push(moment);
    }

    /// Closes the recording and writes the rest.
    pub(super) fn finish(self, result: &ResultReply, task: &Task) -> Result<(), EpisodeError> {
        let summary = EpisodeResult::from(result);
        self.recorder.finish(&summary)?;
        let strip = reports::png(&self.moments)?;
        write_whole(&self.folder.join(Self::STRIP), &strip)?;
        let page =
            EpisodePage { task, result, calls: &self.calls, budget_left: self.budget_left, strip: &strip };
        write_whole(&self.folder.join(Self::REPORT), page.html().as_bytes())?;
        summary.write(&self.folder)?;
        Ok(())
    }
}
