//! Replay of a recorded episode, call by call. The policy's clock advances by the recorded thinking times.

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

/// An episode being replayed.
pub struct Replay {
    session: Session,
    /// The policy's clock.
    hands: SetHands,
}

impl Replay {
    /// Brings the episode `spec` to the state in which its policy took over. `begin` is the checkpoint
    /// with which it started, from the recording at `path`; `None` for the task's own start.
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
            // The file that the recording names is not trusted, and its episode may start from yet another
            // file.
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

    /// Repeats a call at the policy's thinking time `thought`; `shown` has the same meaning as in
    /// [`crate::RecordedCall`].
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

    /// Takes the state hashes since they were last taken, including that of the first state.
    pub fn take_hashes(&mut self) -> Vec<u64> {
        self.session.hashes.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Replays a recorded episode up to a moment and returns a checkpoint of it.
    ///
    /// # Errors
    ///
    /// If the recording cannot be read, or the replay differs from it.
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
            // A refused call is refused again.
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

    /// Returns the current result, and true if the episode has ended without a request.
    pub fn result(&self) -> (ResultReply, bool) {
        (self.session.result(), self.session.ended.is_some())
    }
}
