//! Instructions from a user's file, which replace a task's own in an episode.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use crate::tasks::{Task, TaskWords};

/// Instructions in a file for one task. The task's own instructions remain wherever the file has none.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "RecordedWords")]
pub struct OwnWords {
    /// Hash of the texts, which distinguishes instructions in results.
    pub xxh3: String,
    /// Instruction for a policy that directs all robots.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Instructions by robot, for policies of one robot each.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub robots: BTreeMap<String, String>,
}

/// Hashes of the benchmark's published instructions, joint and for each robot, which a user's file may
/// contain. There is one hash for each task, in the order of [`crate::tasks::cohub`].
const BENCHMARK_WORDS: [&str; 10] = [
    "e6e83c5720b2bda4",
    "811edfc525362d72",
    "e0fb3a429bed504e",
    "a090d2464262cbad",
    "5d9af061e22a4c2f",
    "4a433d04b8e9c6fd",
    "a3ff536ba94812bd",
    "f0201d82a6b526e7",
    "ef96d1aef64a9a74",
    "6f4320604cdab543",
];

/// Recorded form. Recordings of earlier builds have the hash alone.
#[derive(Deserialize)]
#[serde(untagged)]
enum RecordedWords {
    Hash(String),
    Texts {
        xxh3: String,
        #[serde(default)]
        joint: Option<String>,
        #[serde(default)]
        robots: BTreeMap<String, String>,
    },
}

impl From<RecordedWords> for OwnWords {
    fn from(recorded: RecordedWords) -> OwnWords {
        match recorded {
            RecordedWords::Hash(xxh3) => OwnWords { xxh3, ..OwnWords::default() },
            RecordedWords::Texts { xxh3, joint, robots } => OwnWords { xxh3, joint, robots },
        }
    }
}

impl OwnWords {
    /// Returns instructions with these texts.
    pub fn of(joint: Option<String>, robots: BTreeMap<String, String>) -> OwnWords {
        let xxh3 = format!("{:016x}", xxh3_64(format!("{:?}", (&joint, &robots)).as_bytes()));
        OwnWords { xxh3, joint, robots }
    }

    /// Returns true if these are the benchmark's instructions for `task`.
    pub fn are_the_benchmarks(&self, task: &Task) -> bool {
        task.is_benchmark() && BENCHMARK_WORDS.contains(&self.xxh3.as_str())
    }

    /// Returns `words`, the instructions of `task`, with these texts in place of those that they replace.
    pub fn over(&self, task: &Task, words: TaskWords) -> TaskWords {
        let TaskWords { joint, shared, robots } = words;
        let own = |(name, text): (&str, String)| self.robots.get(name).cloned().unwrap_or(text);
        TaskWords {
            joint: self.joint.clone().unwrap_or(joint),
            shared,
            robots: task.robot_names().zip(robots).map(own).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks;

    #[test]
    fn the_benchmarks_words_are_known_where_a_file_has_them() {
        assert_eq!(BENCHMARK_WORDS.len(), tasks::cohub().len());
        let handover = &tasks::cohub()[0];
        let joint = "Pass the bottle directly from Robot A's right hand to Robot B's right hand, then place it on the target.";
        let of_a = "Pick up the bottle directly in front of you with your right hand and hand it to your partner's right hand.";
        let of_b = "Receive the bottle with your right hand, place it on the target directly in front of you, and release it.";
        let robots = |of_b: &str| {
            BTreeMap::from([("A", of_a), ("B", of_b)].map(|(name, text)| (name.to_owned(), text.to_owned())))
        };
        assert!(OwnWords::of(Some(joint.into()), robots(of_b)).are_the_benchmarks(handover));
        assert!(!OwnWords::of(Some(joint.into()), robots("Take it.")).are_the_benchmarks(handover));
        assert!(!OwnWords::of(None, robots(of_b)).are_the_benchmarks(handover));
    }

    #[test]
    fn words_of_earlier_recordings_are_known_by_their_hash() {
        let read = |text: &str| serde_json::from_str::<OwnWords>(text).unwrap();
        let hash = OwnWords { xxh3: "00ff".into(), ..OwnWords::default() };
        assert_eq!(read("\"00ff\""), hash);
        let words = OwnWords { joint: Some("Pass it on.".into()), ..hash };
        assert_eq!(read(&serde_json::to_string(&words).unwrap()), words);
    }
}
