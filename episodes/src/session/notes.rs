//! Entries of an episode for its readers that are not calls: notes, calls refused before they reached the
//! episode, and plans, whose commands are separate calls. They do not affect state, counts, budget or clock.

use tandem_tools_spec::{Note, SpecError};

use super::Session;
use super::journal::KeptRequest;
use crate::EpisodeError;
use crate::commands;
use crate::output::OutputError;
use crate::recording::{CallMoment, CallerRecord, NoteMessage, ToolCallRecord};

impl Session {
    /// Records a note of the policy that directs all robots, or of the operator of one.
    ///
    /// # Errors
    ///
    /// If the note is invalid or is about another operator's robot, or if the episode has ended.
    pub fn note(&mut self, operator: Option<&str>, note: Note) -> Result<(), EpisodeError> {
        let arrival = self.arrival(|| KeptRequest::note(operator, &note));
        let kept = self.keep_note(operator, note);
        self.write_down(arrival);
        kept
    }

    fn keep_note(&mut self, operator: Option<&str>, mut note: Note) -> Result<(), EpisodeError> {
        note.validate().map_err(|reason| SpecError::Invalid { tool: Note::NAME, reason })?;
        self.expect_underway()?;
        if let Some(own) = operator {
            let name = note.robot.get_or_insert_with(|| own.into());
            if name != own {
                return Err(EpisodeError::ForeignRobot { name: name.clone(), own: own.into() });
            }
        }
        if let Some(robot) = &note.robot {
            commands::find(robot, &self.motions)?;
        }
        self.usage.add(&note);
        let note = NoteMessage::new(self.now(), self.told_calls, note);
        self.show_note(&note);
        let time_s = self.present.time_s;
        if let Some(files) = &mut self.files {
            files.keep_note(time_s, note);
        }
        Ok(())
    }

    /// Records a call that was refused before it reached the episode, with its raw `arguments`.
    pub fn refused_before(&mut self, operator: Option<&str>, tool: &str, arguments: &str, problem: &str) {
        let arrival = self.arrival(|| KeptRequest::refused(operator, [tool, arguments, problem]));
        self.tell_beside(operator, tool, arguments, Err(problem));
        self.write_down(arrival);
    }

    /// Records a request that is not a call of the episode, and its outcome.
    pub(super) fn tell_beside(
        &mut self,
        operator: Option<&str>,
        tool: &str,
        arguments: &str,
        outcome: Result<&str, &str>,
    ) {
        if self.result.is_none() {
            let caller = operator.map_or(CallerRecord::Policy, CallerRecord::Operator);
            self.tell(ToolCallRecord::beside(self.now(), caller, tool, arguments, outcome));
        }
    }

    /// Records a call and shows it to viewers.
    pub(super) fn tell(&mut self, record: Result<ToolCallRecord, OutputError>) {
        self.told_calls += 1;
        self.show_call(&record);
        if let Some(files) = &mut self.files {
            files.tool_call(record);
        }
    }

    /// Returns the current moment in the recording's form.
    pub(super) fn now(&self) -> CallMoment {
        CallMoment {
            time_s: self.present.time_s,
            control_step: self.present.control_step,
            thought: self.clock.spent() + self.clock.thinking(),
        }
    }
}
