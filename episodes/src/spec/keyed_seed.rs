//! Seeds drawn by an evaluator's key, and the seed that a policy receives.

use serde::{Deserialize, Serialize};
use tandem_tools_spec::Assistance;

use super::EpisodeSpec;

/// Seed that an evaluator's key draws for a public seed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyedSeed {
    /// Fingerprint that identifies the key without revealing it.
    pub key_fingerprint: String,
    /// Seed used in place of the public one.
    pub drawn: u32,
}

impl EpisodeSpec {
    /// Returns the spec with the seed drawn by an evaluator's key.
    pub fn keyed(self, keyed_seed: Option<KeyedSeed>) -> EpisodeSpec {
        let drawn = keyed_seed.as_ref().map_or(self.seed, |keyed| keyed.drawn);
        EpisodeSpec { task: self.task.under(drawn), keyed_seed, ..self }
    }

    /// Returns the seed that determines the episode: the one drawn by a key, if there is a key.
    pub fn world_seed(&self) -> u32 {
        self.keyed_seed.as_ref().map_or(self.seed, |keyed| keyed.drawn)
    }

    /// Returns the seed disclosed to the policy; `None` under the paper's assistance.
    pub fn told_seed(&self) -> Option<u32> {
        match self.assistance {
            Assistance::Paper => None,
            Assistance::Full => Some(self.seed),
        }
    }
}
