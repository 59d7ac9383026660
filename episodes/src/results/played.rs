//! One episode that was played, as evaluations keep it in a file of its own.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use tandem_tools_spec::ResultReply;

use crate::spec::EpisodeSpec;

/// Folder of single episodes in the folder of an evaluation.
pub const EPISODES: &str = "episodes";

/// One episode that was played, as it is kept in a file of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Played {
    /// Who played.
    #[serde(flatten)]
    pub by: PolicyCard,
    pub spec: EpisodeSpec,
    /// Which base controller the robots had; the name tells files of different content apart.
    pub locomotion: String,
    /// Version and fingerprint of the program; what another build played is played again.
    pub build: String,
    #[serde(flatten)]
    pub result: ResultReply,
    /// How long the policy thought.
    #[serde(default)]
    pub thought_s: f64,
    /// Why the episode fell short: what stopped the policy, or the first phase that was missed.
    pub note: Option<String>,
}

impl Played {
    /// Index of the phase that it began at and that alone counts; `None` where it began at the task's beginning.
    pub fn begun_phase(&self) -> Option<usize> {
        self.spec.begun_phase()
    }
}

/// What results say of a policy. Episodes of policies with different cards are never taken for each other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PolicyCard {
    /// What results call it.
    #[serde(rename = "policy")]
    pub name: String,
    /// How it is reached and driven, as far as its name does not say it.
    #[serde(rename = "policy_settings", default, skip_serializing_if = "Option::is_none")]
    pub settings: Option<Value>,
    /// What it is shown beyond what the robots themselves see and feel.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub extra_information: Vec<String>,
}

impl PolicyCard {
    /// The name, and what the policy is shown beyond what others see.
    pub fn full_name(&self) -> String {
        let extra = self.extra_information.iter().map(|what| format!(" + {what}"));
        std::iter::once(self.name.clone()).chain(extra).collect()
    }
}

impl From<&str> for PolicyCard {
    /// A policy of which nothing but the name is known.
    fn from(name: &str) -> PolicyCard {
        PolicyCard { name: name.into(), ..PolicyCard::default() }
    }
}

/// The first phase that was not reached; where one phase counts, that one.
pub fn missed(result: &ResultReply, counts: Option<usize>) -> Option<String> {
    let counted = |index: usize| counts.is_none_or(|only| only == index);
    let phases = result.phases.0.iter().enumerate();
    let (_, (phase, _)) =
        phases.filter(|(index, _)| counted(*index)).find(|(_, (_, time_s))| time_s.is_none())?;
    Some(format!("{phase} was not reached in {} steps", result.env_steps))
}
