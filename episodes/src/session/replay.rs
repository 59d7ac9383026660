//! A recorded episode played again: call by call, with the policy's clock as it was charged.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

use tandem_tools_spec::{ExtraInformation, ResultReply};

use super::{Checkpoint, Session};
use crate::EpisodeError;
use crate::commands::Called;
use crate::recording::{CallerRecord, RecordedCheckpoint};
use crate::spec::{EpisodeSpec, Start};

/// An episode under way for the second time.
pub struct Replay {
    session: Session,
    /// What the policy's clock shows, in nanoseconds.
    policy_clock_ns: Arc<AtomicU64>,
}

impl Replay {
    /// Takes the episode `spec` to where its policy took over. Where it did not begin at its task's own beginning, `begin` is
    /// the checkpoint that it began with, of the recording at `path`.
    pub fn start(
        spec: &EpisodeSpec,
        begin: Option<&RecordedCheckpoint>,
        path: &Path,
    ) -> Result<Replay, EpisodeError> {
        let policy_clock_ns = Arc::new(AtomicU64::new(0));
        let read = policy_clock_ns.clone();
        let mut session = Session::build(spec, Box::new(move || Duration::from_nanos(read.load(Relaxed))))?;
        if let Some(begin) = begin {
            session.resume(&Checkpoint::from_bytes(&begin.bytes, path)?)?;
        } else if spec.start != Start::Task {
            session.begin(None)?;
        }
        session.requests = None;
        session.hashes = Some(vec![session.world.state_hash()]);
        if spec.start == Start::Task {
            session.hold(spec.rules().initial_hold_steps)?;
        }
        session.clock.resume();
        Ok(Replay { session, policy_clock_ns })
    }

    /// Makes a call that was made when the policy had thought for as long as `thought`; `shown` as [`crate::RecordedCall`] has it.
    pub fn call(
        &mut self,
        called: &Called,
        thought: Duration,
        shown: Option<&[ExtraInformation]>,
    ) -> Result<(), EpisodeError> {
        let passed = thought.saturating_sub(self.session.clock.spent());
        self.policy_clock_ns.fetch_add(u64::try_from(passed.as_nanos()).unwrap_or(u64::MAX), Relaxed);
        let caller = shown.map_or(CallerRecord::Policy, CallerRecord::InProcess);
        self.session.make(caller, called).map(drop)
    }

    /// The hashes of the states since they were last taken, the first of all included.
    pub fn take_hashes(&mut self) -> Vec<u64> {
        self.session.hashes.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// The result as it stands, and whether the episode has ended by itself.
    pub fn result(&self) -> (ResultReply, bool) {
        (self.session.result(), self.session.ended.is_some())
    }
}
