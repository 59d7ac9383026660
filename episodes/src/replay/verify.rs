//! Verification of a recording: simulates the episode again, and compares the state after every step.

use std::collections::BTreeSet;

use tandem_tools_spec::ResultReply;

use super::ReplayError;
use crate::EpisodeError;
use crate::commands::Called;
use crate::fingerprint;
use crate::recording::{BEGIN, RecordedCall, Recording, state_hash_text};
use crate::session::Replay;

/// Outcome of simulating a recording again.
#[derive(Clone, Debug, PartialEq)]
pub struct Verification {
    /// Steps whose states equal the recorded ones, including the state before the first one.
    pub steps: usize,
    pub calls: usize,
    /// Steps at the end of an interrupted recording that belong to a call without a recorded reply.
    pub unanswered_steps: usize,
    /// The build that recorded the episode, if it is not this one: builds may differ in their physics.
    pub other_build: Option<String>,
    pub outcome: Verdict,
}

/// Comparison of the simulation with the recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Every state, the result, and the phases scored from the recorded steps agree.
    Same,
    State(Difference),
    /// The states agree, but the results differ: the differing part, as recorded and as simulated.
    Result {
        what: &'static str,
        recorded: String,
        again: String,
    },
}

/// The first step that differs.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    pub control_step: u64,
    /// Recorded and simulated state hash; `None` if there is no such step.
    pub recorded: Option<String>,
    pub again: Option<String>,
    /// Number, from 1, and tool of the call that made the step; `None` before the first call.
    pub call: Option<(usize, String)>,
}

/// Simulates the episode of `recording` again.
///
/// # Errors
///
/// If the recording cannot be read, its episode cannot be started, or it has a call that this build does
/// not know.
pub fn verify(recording: &Recording) -> Result<Verification, ReplayError> {
    let this = fingerprint::build().map_err(EpisodeError::Build)?;
    let begin = recording.checkpoint(BEGIN);
    let mut replay = Replay::start(&recording.spec, begin.as_ref(), recording.path())?;
    let mut comparison =
        HashComparison { recorded: recording.state_hashes().collect::<Result<_, _>>()?, steps: 0 };
    let calls = recording.tool_calls()?;
    // A recording may have been cut before its first call, within the hold at the episode's start.
    let cut = recording.result.is_none() && calls.is_empty();
    let begun = comparison.compare(replay.take_hashes()).filter(|found| !cut || found.recorded.is_some());
    let mut difference = begun.map(|found| (None, found));
    for (index, call) in calls.iter().enumerate() {
        if difference.is_some() {
            break;
        }
        let again = |error: EpisodeError| ReplayError::Call { number: index + 1, source: error.into() };
        let parsed = Called::parse(&call.tool, call.arguments.clone()).map_err(again)?;
        // A call that was refused is refused again, and the texts are not compared.
        let _ = replay.call(&parsed, call.thought, call.shown.as_deref());
        difference = comparison.compare(replay.take_hashes()).map(|found| (Some((index, call)), found));
    }
    let outcome = match (difference, &recording.result) {
        (Some((call, found)), _) => Verdict::State(found.by(call)),
        (None, Some(result)) => match comparison.missing() {
            Some(found) => Verdict::State(found.by(calls.iter().enumerate().next_back())),
            None => compare_results(recording, result, replay.result().0, recording.build == this)?,
        },
        (None, None) => Verdict::Same,
    };
    Ok(Verification {
        steps: comparison.steps,
        calls: calls.len(),
        unanswered_steps: match recording.result {
            Some(_) => 0,
            None => comparison.recorded.len() - comparison.steps,
        },
        other_build: (recording.build != this).then(|| recording.build.clone()),
        outcome,
    })
}

/// Recorded states, and the number of them that have been compared and agreed.
struct HashComparison {
    recorded: Vec<(u64, String)>,
    steps: usize,
}

/// A difference that has not been assigned to a call yet.
struct StateMismatch {
    control_step: u64,
    recorded: Option<String>,
    again: Option<String>,
}

impl HashComparison {
    /// Compares the states that follow. Returns the first difference; `None` if there is none.
    fn compare(&mut self, again: Vec<u64>) -> Option<StateMismatch> {
        for hash in again {
            let again = state_hash_text(hash);
            match self.recorded.get(self.steps) {
                Some((_, recorded)) if *recorded == again => self.steps += 1,
                other => {
                    let last = self.recorded.last().map_or(0, |(step, _)| *step);
                    return Some(StateMismatch {
                        control_step: other.map_or(last + 1, |(step, _)| *step),
                        recorded: other.map(|(_, recorded)| recorded.clone()),
                        again: Some(again),
                    });
                }
            }
        }
        None
    }

    /// Returns the first recorded state that was not simulated again.
    fn missing(&self) -> Option<StateMismatch> {
        let (control_step, recorded) = self.recorded.get(self.steps)?;
        Some(StateMismatch { control_step: *control_step, recorded: Some(recorded.clone()), again: None })
    }
}

impl StateMismatch {
    fn by(self, call: Option<(usize, &RecordedCall)>) -> Difference {
        let StateMismatch { control_step, recorded, again } = self;
        Difference {
            control_step,
            recorded,
            again,
            call: call.map(|(index, call)| (index + 1, call.tool.clone())),
        }
    }
}

fn text_of(hash: &Option<String>) -> String {
    hash.clone().unwrap_or_default()
}

/// Compares the recorded result with the simulated one, and with the phases scored from the recorded steps.
/// Departures and extra information are compared for the same build only, because another build may have
/// named fewer.
fn compare_results(
    recording: &Recording,
    recorded: &ResultReply,
    again: ResultReply,
    same_build: bool,
) -> Result<Verdict, ReplayError> {
    let times_s =
        |result: &ResultReply| result.phases.0.iter().filter_map(|(_, time_s)| *time_s).collect::<Vec<f64>>();
    let scored_s: Vec<f64> = recording.score()?.reached().map(|(_, time_s)| time_s).collect();
    let text = |times_s: &[f64]| format!("{times_s:?}");
    let facts = |result: &ResultReply| (result.env_steps, result.tool_calls, result.falls);
    let mut pairs = vec![
        ("state hash at the end", text_of(&recorded.state_hash), text_of(&again.state_hash)),
        ("times of phases", text(&times_s(recorded)), text(&times_s(&again))),
        ("times of phases scored from the steps", text(&times_s(recorded)), text(&scored_s)),
        ("steps, calls and falls", format!("{:?}", facts(recorded)), format!("{:?}", facts(&again))),
    ];
    if same_build {
        let shown = |result: &ResultReply| {
            let named: BTreeSet<&String> = result.extra_information.iter().collect();
            format!("{named:?}, replies {:?}", result.extra_information_replies)
        };
        let settings = |result: &ResultReply| format!("{}, {:?}", result.assistance, result.departures);
        pairs.extend([
            ("assistance and departures", settings(recorded), settings(&again)),
            ("extra information", shown(recorded), shown(&again)),
        ]);
    }
    let differs = pairs.into_iter().find(|(_, recorded, again)| recorded != again);
    Ok(match differs {
        Some((what, recorded, again)) => Verdict::Result { what, recorded, again },
        None => Verdict::Same,
    })
}
