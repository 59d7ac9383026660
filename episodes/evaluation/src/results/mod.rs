//! Results of episodes, as files and as counts.

mod machine;
mod phase_level;
mod process_record;
mod seed_list;
mod utc;

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use tandem_episodes::{EpisodeSpec, Phase};
use tandem_tools_spec::{Assistance, EndReason, ExtraInformation, PhaseTimes, ResultReply, Usage};

pub use machine::Machine;
pub use phase_level::{PhaseLevel, PhaseMeans, PhaseRate};
pub use process_record::{PROCESSES_FILE, ProcessRecord, command_line};
pub use seed_list::SeedList;
pub use utc::utc_text;

/// Name of the player that holds still, in results.
pub const IDLE: &str = "idle";

/// Name of the policy that replays a demonstration without observations, in results.
pub const OPEN_LOOP: &str = "open-loop";

/// Name of the folder with single episodes, in the folder of an evaluation.
pub const EPISODES: &str = "episodes";

/// Name of the folder with evaluations under stress, in the folder of an evaluation.
pub const STRESS: &str = "stress";

/// One played episode, as stored in its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlayedEpisode {
    /// The policy.
    #[serde(flatten)]
    pub policy: PolicyCard,
    pub spec: EpisodeSpec,
    /// Name of the robots' base controller; files of different content have different names.
    pub locomotion: String,
    /// Version and fingerprint of the program. An episode of another build is played again.
    pub build: String,
    #[serde(flatten)]
    pub result: ResultReply,
    /// The policy's thinking time.
    #[serde(default)]
    pub thought_s: f64,
    /// Reason why the episode did not succeed: the failure that stopped the policy, or the first missed
    /// phase.
    pub note: Option<String>,
    /// True if a failure of the policy itself counts as a failed episode, because the episode has been
    /// retried as often as requested.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub keep_failed: bool,
    /// Earlier attempts at this episode, which did not count; the oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub attempts: Vec<Attempt>,
    /// Time in UTC at which the episode ended; for a served episode, the time of its file. `None` in results
    /// of earlier builds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_at: Option<String>,
}

/// An attempt at an episode that did not count, so that the episode was played again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    pub ended: EndReason,
    pub phases: PhaseTimes,
    pub env_steps: u32,
    pub tool_calls: u32,
    pub thought_s: f64,
    pub note: Option<String>,
    /// Usage that the notes report.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub usage: Option<Usage>,
}

/// Reason why an episode is not evidence of its policy's performance. Reports list these episodes separately
/// from failures, and the next run plays them again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Exclusion {
    PolicyFailed,
    SimulatorFailed,
}

impl Exclusion {
    /// Returns the name that tables show.
    pub fn name(self) -> &'static str {
        match self {
            Exclusion::PolicyFailed => "policy failed",
            Exclusion::SimulatorFailed => "simulator failed",
        }
    }
}

impl PlayedEpisode {
    /// Returns all attempts at the episode, with this one last.
    pub fn into_attempts(self) -> Vec<Attempt> {
        let PlayedEpisode { result, thought_s, note, mut attempts, .. } = self;
        let ResultReply { ended, phases, env_steps, tool_calls, usage, .. } = result;
        attempts.push(Attempt { ended, phases, env_steps, tool_calls, thought_s, note, usage });
        attempts
    }

    /// Returns the index of the phase at which the episode began, which alone counts; `None` if the episode
    /// began at the task's beginning.
    pub fn start_phase(&self) -> Option<usize> {
        self.spec.start_phase()
    }

    /// Returns `true` if phase number `phase`, from 0, was reached.
    pub fn reached(&self, phase: usize) -> bool {
        self.result.phases.reached_s(&Phase::number(phase)).is_some()
    }

    /// Returns the information that the policy was shown and the benchmark withholds. Information that the
    /// assistance level implies is left out.
    fn shown(&self) -> impl Iterator<Item = &String> {
        let is_said = |what: &&String| {
            let of_full = ExtraInformation::ALL.into_iter().filter(|kind| kind.is_of_full_assistance());
            self.spec.assistance == Assistance::Full && of_full.into_iter().any(|kind| kind.name() == **what)
        };
        let asked = &self.policy.extra_information;
        asked.iter().chain(self.result.extra_information.iter().filter(move |what| !is_said(what)))
    }

    /// Returns `true` if the counted phase was reached: the phase at which the episode began, or else the
    /// last one.
    pub fn succeeded(&self) -> bool {
        self.reached(self.start_phase().unwrap_or(self.spec.task.phases.len() - 1))
    }

    /// Returns the reason why the episode does not count; `None` if it counts. An episode that succeeded
    /// before a failure counts.
    pub fn exclusion(&self) -> Option<Exclusion> {
        let failed = match self.result.ended {
            EndReason::PolicyFailed if self.keep_failed => None,
            EndReason::PolicyFailed => Some(Exclusion::PolicyFailed),
            EndReason::SimulatorFailed => Some(Exclusion::SimulatorFailed),
            EndReason::TaskComplete
            | EndReason::StepBudgetExhausted
            | EndReason::WallClockExhausted
            | EndReason::Finished
            | EndReason::Abandoned => None,
        };
        failed.filter(|_| !self.succeeded())
    }

    /// Returns the number of requests. Results of earlier builds contain only the number of tool calls.
    pub fn requests(&self) -> u32 {
        self.result.requests.unwrap_or(self.result.tool_calls)
    }

    /// Returns `true` if the episode counts in rates and averages.
    pub fn counts(&self) -> bool {
        self.exclusion().is_none()
    }
}

/// Returns the number of these attempts that ended because the policy itself failed.
pub fn failures_of_policy(attempts: &[Attempt]) -> usize {
    attempts.iter().filter(|attempt| attempt.ended == EndReason::PolicyFailed).count()
}

/// Names of the built-in players. They act in the simulator's process and read no text replies.
pub const PLAYERS: [&str; 4] = ["expert", "no_words", "idle", "demonstration"];

/// Description of a policy in results. Episodes of policies with different cards are never mixed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PolicyCard {
    /// The policy's name in results.
    #[serde(rename = "policy")]
    pub name: String,
    /// Settings of the policy's connection and control that its name does not contain.
    #[serde(rename = "policy_settings", default, skip_serializing_if = "Option::is_none")]
    pub settings: Option<Value>,
    /// Extra information that the policy requests and the benchmark withholds. In the same JSON object, the
    /// result lists the information that was shown, under the name without prefix.
    #[serde(rename = "policy_extra_information", default, skip_serializing_if = "Vec::is_empty")]
    pub extra_information: Vec<String>,
}

impl PolicyCard {
    /// Returns the name, followed by the extra information that the policy is shown.
    pub fn full_name(&self) -> String {
        named(&self.name, &self.extra_information)
    }
}

/// Returns a policy's name, followed by its attributes.
pub fn named(policy: &str, beside: &[String]) -> String {
    std::iter::once(policy.to_owned()).chain(beside.iter().map(|what| format!(" + {what}"))).collect()
}

/// Returns the extra information that the policy was shown in any of these episodes, for display after the
/// policy's name.
pub fn shown_in<'a>(episodes: impl Iterator<Item = &'a PlayedEpisode>) -> Vec<String> {
    let shown: BTreeSet<&String> = episodes.flat_map(PlayedEpisode::shown).collect();
    shown.into_iter().cloned().collect()
}

impl From<&str> for PolicyCard {
    /// Creates the card of a policy of which only the name is known.
    fn from(name: &str) -> PolicyCard {
        PolicyCard { name: name.into(), ..PolicyCard::default() }
    }
}

/// Returns the simulator's failure, or else the first phase that was not reached.
pub fn episode_note(result: &ResultReply, counts: Option<usize>) -> Option<String> {
    let failed = result.simulator_failure.as_ref().map(|failure| format!("the simulator failed {failure}"));
    failed.or_else(|| missed_phase_note(result, counts))
}

/// Returns a note on the first counted phase that was not reached. `counts` is the only counted phase, or
/// `None` if all count.
pub fn missed_phase_note(result: &ResultReply, counts: Option<usize>) -> Option<String> {
    let counted = |index: usize| counts.is_none_or(|only| only == index);
    let phases = result.phases.0.iter().enumerate();
    let (_, (phase, _)) =
        phases.filter(|(index, _)| counted(*index)).find(|(_, (_, time_s))| time_s.is_none())?;
    Some(format!("{phase} was not reached in {} steps", result.env_steps))
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use tandem_episodes::{players, tasks};
    use tandem_tools_spec::Protocol;

    use super::*;

    /// A policy's card and its result are in one JSON object.
    #[test]
    fn what_a_policy_asks_for_and_what_it_was_shown_are_kept_apart() {
        let result: ResultReply = serde_json::from_value(json!({
            "task": "handover", "seed": 3, "protocol": "agentic", "phases": {"p1": 4.2, "p2": null},
            "assistance": "full", "extra_information": ["odometry", "third_person"], "ended": "finished",
            "env_steps": 812, "tool_calls": 61, "thinking_s": 0.0, "falls": 0, "realtime_factor": 3.5,
        }))
        .unwrap();
        let card = PolicyCard { extra_information: vec!["third_person".into()], ..PolicyCard::from("agent") };
        for policy in [card, "agent".into()] {
            let played = PlayedEpisode {
                policy,
                spec: EpisodeSpec::new(&tasks::find("handover").unwrap(), 3, Protocol::Agentic),
                locomotion: "balance".into(),
                build: "test".into(),
                result: result.clone(),
                thought_s: 0.0,
                note: None,
                keep_failed: false,
                attempts: Vec::new(),
                ended_at: Some("2026-11-28T01:20:00Z".into()),
            };
            let text = serde_json::to_string(&played).unwrap();
            assert_eq!(serde_json::from_str::<PlayedEpisode>(&text).unwrap(), played);
        }
    }

    #[test]
    fn the_built_in_players_are_all_named() {
        assert_eq!(players::ALL.iter().map(|entry| entry.name).collect::<Vec<_>>(), PLAYERS);
    }
}
