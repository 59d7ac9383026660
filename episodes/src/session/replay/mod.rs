//! A recorded episode played again: call by call, with the policy's clock as it was charged.

mod bring_back;
mod set_clock;

use std::path::Path;
use std::time::Duration;

use tandem_sim::CONTROL_HZ;
use tandem_tools_spec::{ExtraInformation, ResultReply};

use super::checkpoint::unreadable;
use super::{Checkpoint, Session, monotonic, this_build};
use crate::commands::Called;
use crate::error::{CheckpointError, EpisodeError};
use crate::recording::{BEGIN, CallerRecord, RecordedCheckpoint, Recording, state_hash_text};
use crate::spec::{EpisodeSpec, MomentStart, Start};
pub use bring_back::BringBack;
use set_clock::SetHands;

/// An episode under way for the second time.
pub struct Replay {
    session: Session,
    /// The policy's clock.
    hands: SetHands,
}

impl Replay {
    /// Takes the episode `spec` to where its policy took over. Where it did not begin at its task's own beginning, `begin` is
    /// the checkpoint that it began with, of the recording at `path`.
    pub fn start(
        spec: &EpisodeSpec,
        begin: Option<&RecordedCheckpoint>,
        path: &Path,
    ) -> Result<Replay, EpisodeError> {
        let hands = SetHands::default();
        let mut session = Session::build(spec, hands.clock(monotonic()))?;
        if let Some(begin) = begin {
            session.resume(&Checkpoint::from_bytes(&begin.bytes, path)?)?;
        } else if spec.start != Start::Task {
            // What it names may be anything, and may begin elsewhere in its turn.
            return Err(CheckpointError::NoBeginning { path: path.into() }.into());
        }
        session.requests = None;
        session.hashes = Some(vec![session.world.state_hash()]);
        if spec.start == Start::Task {
            session.hold(spec.rules().initial_hold_steps)?;
        }
        session.clock.resume();
        Ok(Replay { session, hands })
    }

    /// Makes a call that was made when the policy had thought for as long as `thought`; `shown` as [`crate::RecordedCall`] has it.
    pub fn call(
        &mut self,
        called: &Called,
        thought: Duration,
        shown: Option<&[ExtraInformation]>,
    ) -> Result<(), EpisodeError> {
        self.hands.pass(thought.saturating_sub(self.session.clock.spent()));
        let caller = shown.map_or(CallerRecord::Policy, CallerRecord::InProcess);
        self.session.make(caller, called).map(drop)
    }

    /// The hashes of the states since they were last taken, the first of all included.
    pub fn take_hashes(&mut self) -> Vec<u64> {
        self.session.hashes.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// The checkpoint of a recorded episode at a moment of it, up to which it is played again; it has to go as it was recorded.
    pub fn checkpoint_at(start: &MomentStart) -> Result<Checkpoint, EpisodeError> {
        let MomentStart { recording: path, control_step, .. } = start;
        let recording = Recording::read(path).map_err(unreadable)?;
        let begin = recording.checkpoint(BEGIN);
        let mut replay = Replay::start(&recording.spec, begin.as_ref(), path)?;
        let until_s = *control_step as f64 / CONTROL_HZ;
        for call in recording.tool_calls().map_err(unreadable)? {
            if call.time_s > until_s {
                break;
            }
            // A call that was refused is refused again.
            let called = Called::parse(&call.tool, call.arguments)?;
            let _ = replay.call(&called, call.thought, call.shown.as_deref());
        }
        let step = replay.session.present.control_step;
        let hash = replay.session.world.state_hash();
        let recorded =
            recording.state_hashes().find(|state| !matches!(state, Ok((number, _)) if *number != step));
        match recorded.transpose().map_err(unreadable)? {
            Some((_, recorded)) if recorded == state_hash_text(hash) => replay.session.checkpoint(),
            _ => {
                let (path, made_by, this) = (path.clone(), recording.build.clone(), this_build()?);
                Err(CheckpointError::OtherWay { path, step, made_by, this }.into())
            }
        }
    }

    /// The result as it stands, and whether the episode has ended by itself.
    pub fn result(&self) -> (ResultReply, bool) {
        (self.session.result(), self.session.ended.is_some())
    }
}
