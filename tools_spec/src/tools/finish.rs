//! `finish`: ends the episode and returns its result. `episodes/src/session/answer.rs` carries it out.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::Error as _};
use serde_json::{Map, Value};

use crate::parts::{AgentEnding, Assistance, Disclosure, ModelEnding, OperatorUse, Protocol, Usage};
use crate::tool::Tool;

/// End the episode and get its result. After that no command is executed; reads still answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("operator" = "Leave the rest to the others: your robot holds still from then on, and they play on. \
    Once all operators have finished, the episode ends and the reply is its result."))]
pub struct Finish {}

impl Tool for Finish {
    type Reply = ResultReply;
    const NAME: &'static str = "finish";
    const READ_ONLY: bool = false;
    const IDEMPOTENT: bool = true;

    fn example() -> Self {
        Finish {}
    }
}

/// End of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EndReason {
    /// The last phase was reached.
    TaskComplete,
    /// The steps ran out.
    StepBudgetExhausted,
    /// The policy's wall clock ran out.
    WallClockExhausted,
    /// `finish` was called, or the episode was deleted.
    Finished,
    /// The policy made no call for too long.
    Abandoned,
    /// The policy itself failed: its program or its server crashed or disappeared. Only `tandem evaluate`
    /// uses this.
    PolicyFailed,
    /// The simulator itself failed; the recording has the steps before.
    SimulatorFailed,
}

/// The reply to `finish`, and the content of `result.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ResultReply {
    /// The task's id.
    pub task: String,
    /// The seed; left out for a policy whose assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
    /// The rules that were in force.
    pub protocol: Protocol,
    /// Simulated seconds at which phases were reached; null for one not reached or not disclosed.
    pub phases: PhaseTimes,
    /// True if every phase was reached; left out where phases are not disclosed, and in results of earlier
    /// versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub success: Option<bool>,
    /// Cause of its end.
    pub ended: EndReason,
    /// Control steps of 20 ms, the initial hold included.
    pub env_steps: u32,
    /// Tool calls of all robots, including reads, refused calls and the one that ended the episode. Each
    /// command of a plan or walk counts as one, and each slice of 5 steps with `until`.
    pub tool_calls: u32,
    /// Requests of the policy itself: like tool_calls, but a plan or a walk, whose commands are a call each,
    /// counts once. Left out in results of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub requests: Option<u32>,
    /// Wall-clock thinking time of the policy between its calls, in seconds; with one operator per robot, the
    /// sum over all operators.
    #[serde(default)]
    pub thinking_s: f64,
    /// Use by each operator that has commanded, where each robot has its own; left out otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub operators: Vec<OperatorUse>,
    /// Robots that fell.
    pub falls: u32,
    /// Ratio of simulated time to physics wall clock.
    pub realtime_factor: f64,
    /// Hash of the whole physical state at the end, 16 hexadecimal digits; left out for a
    /// policy whose assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state_hash: Option<String>,
    /// Failure of the simulator: its step, body and error; left out where it did not fail.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulator_failure: Option<String>,
    /// Amount of information that the policy got.
    #[serde(default)]
    pub assistance: Assistance,
    /// Information that the policy got and the benchmark withholds, for example "depth_images"; left out
    /// where there was none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub extra_information: Vec<String>,
    /// Number of replies with each kind, by its name and robot; left out where there was none, and of a short
    /// reply.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub extra_information_replies: BTreeMap<String, BTreeMap<String, u32>>,
    /// Share of the joint targets that exceeded joint limits by more than 0.01 rad and were clamped; left out
    /// where none did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints_clamped_share: Option<f64>,
    /// Departures from the benchmark, for example "assistance: full"; left out where there was none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub departures: Vec<String>,
    /// Cause of an incomplete recording; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording_failed: Option<String>,
    /// Usage that notes on the episode report; left out where there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub usage: Option<Usage>,
}

impl ResultReply {
    /// Returns the result as a policy gets it at the end. Under "paper", it contains neither seed nor hash,
    /// by which the policy could recognize an episode that it has played before.
    pub fn disclosed(mut self, disclosure: Disclosure) -> ResultReply {
        match self.assistance {
            Assistance::Paper => (self.seed, self.state_hash) = (None, None),
            Assistance::Full => {}
        }
        if !disclosure.tells(true) {
            self.phases.0.iter_mut().for_each(|(_, time_s)| *time_s = None);
            self.success = None;
        }
        self
    }
}

impl ResultReply {
    /// Describes the ends of language models' play that the end of the episode does not imply.
    pub fn model_endings(&self) -> Option<String> {
        let endings = self.usage.iter().flat_map(Usage::own_endings);
        let words: Vec<String> = endings.map(ModelEnding::words).collect();
        (!words.is_empty()).then(|| words.join(", "))
    }
}

impl Usage {
    /// Adds the end of a model's play if the end of the episode implies it and no note reports it.
    pub fn ended_by(mut self, reason: EndReason) -> Usage {
        let ending = match reason {
            EndReason::TaskComplete => Some(AgentEnding::Success),
            EndReason::Finished => Some(AgentEnding::Finished),
            EndReason::StepBudgetExhausted
            | EndReason::WallClockExhausted
            | EndReason::Abandoned
            | EndReason::PolicyFailed
            | EndReason::SimulatorFailed => None,
        };
        if let Some(ending) = ending.filter(|_| !self.models.is_empty() && self.endings.is_empty()) {
            self.endings.push(ModelEnding { robot: None, ending, text: String::new() });
        }
        self
    }
}

/// Seconds by phase number, in the task's order; a JSON object from `p1`, `p2`, ... to seconds or null.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseTimes(pub Vec<(String, Option<f64>)>);

impl PhaseTimes {
    /// Returns the time at which the phase with this number, for example `p2`, was reached.
    pub fn reached_s(&self, number: &str) -> Option<f64> {
        self.0.iter().find(|(phase, _)| phase == number).and_then(|(_, time_s)| *time_s)
    }
}

impl Serialize for PhaseTimes {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(phase, time_s)| (phase, time_s)))
    }
}

impl<'de> Deserialize<'de> for PhaseTimes {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let object = Map::<String, Value>::deserialize(deserializer)?;
        let time = |(phase, value): (String, Value)| match (value.as_f64(), value.is_null()) {
            (None, false) => {
                Err(D::Error::custom(format!("phase {phase} holds {value}; expected seconds or null")))
            }
            (time_s, _) => Ok((phase, time_s)),
        };
        object.into_iter().map(time).collect::<Result<_, _>>().map(PhaseTimes)
    }
}

impl JsonSchema for PhaseTimes {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "PhaseTimes".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "object", "additionalProperties": { "type": ["number", "null"] } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_an_episode_says_how_a_models_play_ended_where_no_note_does() {
        let ended = |models: &[&str], reason: EndReason| {
            let models = models.iter().map(|model| (*model).to_owned()).collect();
            let usage = Usage { models, ..Usage::default() }.ended_by(reason);
            usage.endings.first().map(|ended| ended.ending)
        };
        assert_eq!(ended(&["m"], EndReason::TaskComplete), Some(AgentEnding::Success));
        assert_eq!(ended(&["m"], EndReason::Finished), Some(AgentEnding::Finished));
        assert_eq!(ended(&["m"], EndReason::StepBudgetExhausted), None);
        assert_eq!(ended(&[], EndReason::Finished), None, "no model has played");
        let silent = ModelEnding { robot: None, ending: AgentEnding::Silent, text: String::new() };
        let usage = Usage { models: vec!["m".into()], endings: vec![silent.clone()], ..Usage::default() };
        assert_eq!(usage.ended_by(EndReason::Finished).endings, [silent]);
    }
}
