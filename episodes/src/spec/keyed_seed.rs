//! Seeds that an evaluator's key draws, and what a policy is told of them.

use serde::{Deserialize, Serialize};
use tandem_tools_spec::Assistance;

use super::EpisodeSpec;

/// The seed that an evaluator's key draws for a public one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyedSeed {
    /// Names the key and tells nothing of it.
    pub key_fingerprint: String,
    /// The seed in whose place it stands.
    pub drawn: u32,
}

impl EpisodeSpec {
    /// The same with what an evaluator's key makes of the seed.
    pub fn keyed(self, keyed_seed: Option<KeyedSeed>) -> EpisodeSpec {
        let drawn = keyed_seed.as_ref().map_or(self.seed, |keyed| keyed.drawn);
        EpisodeSpec { task: self.task.under(drawn), keyed_seed, ..self }
    }

    /// The seed that decides what happens: the evaluator's, where a key has drawn one.
    pub fn world_seed(&self) -> u32 {
        self.keyed_seed.as_ref().map_or(self.seed, |keyed| keyed.drawn)
    }

    /// The seed, as far as the policy is told.
    pub fn told_seed(&self) -> Option<u32> {
        match self.assistance {
            Assistance::Paper => None,
            Assistance::Full => Some(self.seed),
        }
    }
}
