//! Notes of a player on its play, for later readers of the episode. A note is not a tool call: it does not
//! affect the episode, and no policy sees it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::error::SpecError;
use crate::limits::{ROBOT_PATTERN, one_of};
use crate::tool::read_as;

/// Maximum number of characters of a note: more than a model outputs at once.
const MAX_CHARACTERS: usize = 50_000;
/// Maximum number of characters that results keep of the text with which a model's play ended.
const MAX_ENDING_CHARACTERS: usize = 500;
/// Maximum number of characters of a model's name.
const MAX_NAME_CHARACTERS: usize = 200;
/// Maximum tokens, dollars and seconds in one note; larger numbers are counting errors.
const MAX_TOKENS: u32 = 1_000_000_000;
const MAX_USD: f64 = 1e6;
const MAX_SECONDS: f64 = 1e6;

/// A player's note on its play, recorded for later readers of the episode: a model's thoughts, its messages,
/// and their cost. It does not change the episode, costs no call, no steps and no time, and no policy sees
/// it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Note {
    /// The text, at most 50,000 characters. It may be empty if the note reports usage.
    #[schemars(length(max = MAX_CHARACTERS))]
    pub text: String,
    /// Kind of the text. Null: a note.
    pub kind: Option<NoteKind>,
    /// The robot that it is about, for example "A". Null: all, and for the operator of a robot its own.
    #[schemars(regex(pattern = ROBOT_PATTERN))]
    pub robot: Option<String>,
    /// Tokens that the model read and wrote for it. Null: unknown.
    pub tokens: Option<TokenCount>,
    /// Cost in US dollars. Null: unknown.
    #[schemars(range(min = 0, max = MAX_USD))]
    pub usd: Option<f64>,
    /// Name of the model on its server, at most 200 characters. Null: unknown.
    #[schemars(length(max = MAX_NAME_CHARACTERS))]
    pub model: Option<String>,
    /// Seconds that the model took. Null: unknown.
    #[schemars(range(min = 0, max = MAX_SECONDS))]
    pub seconds: Option<f64>,
    /// End of the model's play. Null: none yet.
    pub ending: Option<AgentEnding>,
}

/// End of a language model's play.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AgentEnding {
    /// The task was completed.
    Success,
    /// The model called finish.
    Finished,
    /// The model refused to go on.
    Refused,
    /// A filter of the model's endpoint held back its reply.
    ContentFilter,
    /// The model repeatedly called no tool.
    Silent,
    /// Its token limit was reached.
    TokenLimit,
    /// Its price limit was reached.
    PriceLimit,
    /// Its call limit was reached.
    CallLimit,
    /// Its time limit was reached.
    TimeLimit,
    /// The conversation exceeded the model's context.
    Context,
    /// The model's endpoint gave no reply.
    Endpoint,
}

impl AgentEnding {
    /// Describes the end for reports.
    pub fn words(self) -> &'static str {
        match self {
            AgentEnding::Success => "the task was completed",
            AgentEnding::Finished => "the policy ended the episode",
            AgentEnding::Refused => "the model refused",
            AgentEnding::ContentFilter => "a content filter held back the model's reply",
            AgentEnding::Silent => "the model called no tool",
            AgentEnding::TokenLimit => "the tokens ran out",
            AgentEnding::PriceLimit => "the money ran out",
            AgentEnding::CallLimit => "the calls ran out",
            AgentEnding::TimeLimit => "the agent's time ran out",
            AgentEnding::Context => "the conversation became too long for the model",
            AgentEnding::Endpoint => "the model's endpoint gave no reply",
        }
    }

    /// Returns true if the end of the episode implies this end.
    pub fn is_of_the_episode(self) -> bool {
        matches!(self, AgentEnding::Success | AgentEnding::Finished)
    }
}

/// Kind of a note's text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoteKind {
    /// Thoughts of a model before it acted.
    Thought,
    /// Text of a model.
    Message,
    /// Anything else, such as a program's actions.
    Note,
}

/// Tokens of a language model.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TokenCount {
    /// Input tokens, including cached ones.
    #[schemars(range(max = MAX_TOKENS))]
    pub input: u32,
    /// Output tokens, including thoughts.
    #[schemars(range(max = MAX_TOKENS))]
    pub output: u32,
    /// Input tokens from a cache. Left out: none.
    #[serde(default)]
    #[schemars(range(max = MAX_TOKENS))]
    pub cached: u32,
}

impl Note {
    /// Name in refusals.
    pub const NAME: &str = "notes";

    /// Returns the JSON Schema of the fields of which a note has at least one.
    pub(crate) fn conditions() -> Value {
        let mut used = one_of(&[("tokens", "object"), ("usd", "number"), ("seconds", "number")]);
        let words = json!({ "properties": { "text": { "minLength": 1 } } });
        used.as_array_mut().into_iter().for_each(|used| used.insert(0, words.clone()));
        used
    }

    /// Returns a valid note.
    pub fn example() -> Note {
        Note {
            text: "The bottle is 0.31 m ahead of A, a bit to the right. I reach above it first.".into(),
            kind: Some(NoteKind::Thought),
            robot: Some("A".into()),
            tokens: Some(TokenCount { input: 5210, output: 84, cached: 4800 }),
            usd: Some(0.004),
            model: Some("a-model".into()),
            seconds: Some(2.5),
            ending: None,
        }
    }

    /// Parses and checks a note.
    pub fn parse(body: Value) -> Result<Note, SpecError> {
        let note: Note = read_as(Note::NAME, body, || json!(Note::example()))?;
        note.validate().map_err(|reason| SpecError::Invalid { tool: Note::NAME, reason })?;
        Ok(note)
    }

    /// Returns true if the note reports usage.
    fn reports_usage(&self) -> bool {
        self.tokens.is_some() || self.usd.is_some() || self.seconds.is_some()
    }

    /// Checks lengths and numbers. Errors state valid values.
    pub fn validate(&self) -> Result<(), String> {
        let long = |name: &str, text: &str, most: usize| match text.chars().count() {
            count if count > most => {
                Err(format!("{name} has {count} characters; give at most {most}, or several notes"))
            }
            _ => Ok(()),
        };
        long("text", &self.text, MAX_CHARACTERS)?;
        long("model", self.model.as_deref().unwrap_or_default(), MAX_NAME_CHARACTERS)?;
        if self.text.is_empty() && !self.reports_usage() && self.ending.is_none() {
            return Err("it says nothing; give a text, or the tokens, usd or seconds that were used".into());
        }
        let TokenCount { input, output, cached } = self.tokens.unwrap_or_default();
        for (name, count) in [("input", input), ("output", output), ("cached", cached)] {
            if count > MAX_TOKENS {
                return Err(format!(
                    "tokens.{name} is {count}; give 0 to {MAX_TOKENS}, those of this note alone"
                ));
            }
        }
        for (name, number, most) in [("usd", self.usd, MAX_USD), ("seconds", self.seconds, MAX_SECONDS)] {
            if let Some(number) = number.filter(|number| !(0.0..=most).contains(number)) {
                return Err(format!("{name} is {number}; give 0 to {most}, that of this note alone"));
            }
        }
        Ok(())
    }
}

/// Sum of the usage in all notes of an episode.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Usage {
    /// Number of notes.
    pub notes: u32,
    /// Input tokens of models, including cached ones.
    pub input_tokens: u64,
    /// Output tokens of models.
    pub output_tokens: u64,
    /// Number of input tokens from a cache.
    pub cached_tokens: u64,
    /// Cost in US dollars; left out where no note has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub usd: Option<f64>,
    /// Seconds that models took; left out where no note has them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_s: Option<f64>,
    /// The models that notes name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<String>,
    /// Sums for each robot, from notes that name it; left out where none does.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub robots: Vec<RobotUsage>,
    /// Ends of the models' play: one for all robots, or one for each that has reported it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub endings: Vec<ModelEnding>,
}

/// Usage of one robot's model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotUsage {
    /// The robot that it directed.
    pub robot: String,
    /// The model, as its latest note names it; left out where none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Input tokens, including cached ones.
    pub input_tokens: u64,
    /// Output tokens.
    pub output_tokens: u64,
    /// Number of input tokens from a cache.
    pub cached_tokens: u64,
    /// Cost in US dollars; left out where no note has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub usd: Option<f64>,
    /// Seconds that it took; left out where no note has them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_s: Option<f64>,
}

/// End of a model's play, with its own text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModelEnding {
    /// The robot that it directed; left out where it directed all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// The end.
    pub ending: AgentEnding,
    /// Text of the model or its endpoint, for example a refusal; empty where there is none.
    pub text: String,
}

impl ModelEnding {
    /// Describes the end, prefixed with the robot if the model directed only one.
    pub fn words(&self) -> String {
        let words = self.ending.words();
        self.robot.as_ref().map_or_else(|| words.into(), |robot| format!("{robot}: {words}"))
    }
}

impl Usage {
    /// Adds the usage and the end that a note reports.
    pub fn add(&mut self, note: &Note) {
        let TokenCount { input, output, cached } = note.tokens.unwrap_or_default();
        self.notes += 1;
        self.input_tokens += u64::from(input);
        self.output_tokens += u64::from(output);
        self.cached_tokens += u64::from(cached);
        self.usd = added(self.usd, note.usd);
        self.model_s = added(self.model_s, note.seconds);
        if let Some(model) = note.model.as_ref().filter(|model| !self.models.contains(model)) {
            self.models.push(model.clone());
        }
        if let Some(robot) = note.robot.as_deref().filter(|_| note.reports_usage()) {
            self.robot_mut(robot).add(note);
        }
        if let Some(ending) = note.ending {
            let text = note.text.chars().take(MAX_ENDING_CHARACTERS).collect();
            self.endings.retain(|known| known.robot != note.robot);
            self.endings.push(ModelEnding { robot: note.robot.clone(), ending, text });
        }
    }

    /// Returns the entry of a robot, which is added if it is missing.
    fn robot_mut(&mut self, robot: &str) -> &mut RobotUsage {
        let index = self.robots.iter().position(|known| known.robot == robot).unwrap_or(self.robots.len());
        if index == self.robots.len() {
            self.robots.push(RobotUsage { robot: robot.into(), ..RobotUsage::default() });
        }
        &mut self.robots[index]
    }

    /// Returns the ends of models' play that the end of the episode does not imply.
    pub fn own_endings(&self) -> impl Iterator<Item = &ModelEnding> {
        self.endings.iter().filter(|ended| !ended.ending.is_of_the_episode())
    }
}

impl RobotUsage {
    fn add(&mut self, note: &Note) {
        let TokenCount { input, output, cached } = note.tokens.unwrap_or_default();
        self.input_tokens += u64::from(input);
        self.output_tokens += u64::from(output);
        self.cached_tokens += u64::from(cached);
        self.usd = added(self.usd, note.usd);
        self.model_s = added(self.model_s, note.seconds);
        self.model = note.model.clone().or(self.model.take());
    }
}

/// Adds two numbers, each of which may be unknown. The sum is unknown if both are.
fn added(total_value: Option<f64>, more_value: Option<f64>) -> Option<f64> {
    match (total_value, more_value) {
        (None, None) => None,
        (total, more) => Some(total.unwrap_or_default() + more.unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back_and_most_may_be_left_out() {
        for note in [Note::example(), Note { text: "ü".repeat(MAX_CHARACTERS), ..Note::default() }] {
            assert_eq!(Note::parse(json!(note)), Ok(note));
        }
        let few = Note::parse(json!({ "text": "", "tokens": { "input": 10, "output": 2 } })).unwrap();
        assert_eq!(few.tokens, Some(TokenCount { input: 10, output: 2, cached: 0 }));
    }

    #[test]
    fn refusals_say_what_would_work() {
        let check = |body: Value, says: &str| {
            let text = Note::parse(body).unwrap_err().to_string();
            assert!(text.contains(says), "{text}");
        };
        check(json!({}), "missing field `text`; arguments that work: {\"text\":");
        check(json!({ "text": "" }), "it says nothing; give a text");
        check(json!({ "text": "a".repeat(50_001) }), "text has 50001 characters; give at most 50000");
        check(json!({ "text": "a", "model": "m".repeat(201) }), "model has 201 characters");
        check(
            json!({ "text": "a", "kind": "shout" }),
            "kind: unknown variant `shout`, expected one of `thought`",
        );
        check(json!({ "text": "a", "usd": -1 }), "usd is -1; give 0 to 1000000");
        check(json!({ "text": "a", "seconds": 1e300 }), "seconds is ");
        check(
            json!({ "text": "a", "tokens": { "input": 2_000_000_000_u32, "output": 1 } }),
            "tokens.input is",
        );
        check(json!({ "text": "a", "tokens": { "input": 5 } }), "tokens: missing field `output`");
        check(json!({ "text": "a", "mood": "glad" }), "unknown field `mood`");
    }

    #[test]
    fn the_end_of_a_models_play_is_kept_once_for_each_robot() {
        let said = |robot: Option<&str>, ending: AgentEnding| Note {
            text: "I cannot do that.".into(),
            robot: robot.map(str::to_owned),
            ending: Some(ending),
            ..Note::default()
        };
        let mut usage = Usage::default();
        usage.add(&said(Some("A"), AgentEnding::Silent));
        usage.add(&said(Some("A"), AgentEnding::Refused));
        usage.add(&said(Some("B"), AgentEnding::CallLimit));
        let words: Vec<String> = usage.own_endings().map(ModelEnding::words).collect();
        assert_eq!(words, ["A: the model refused", "B: the calls ran out"]);
    }

    #[test]
    fn what_was_used_adds_up() {
        let mut usage = Usage::default();
        usage.add(&Note { text: "Hm.".into(), ..Note::default() });
        assert_eq!((usage.usd, usage.model_s), (None, None));
        usage.add(&Note::example());
        usage.add(&Note::example());
        let mut partner = Note { robot: Some("B".into()), model: Some("other".into()), ..Note::example() };
        usage.add(&partner);
        partner.robot = None;
        usage.add(&partner);
        assert_eq!((usage.notes, usage.input_tokens, usage.output_tokens), (5, 20840, 336));
        assert_eq!((usage.cached_tokens, usage.usd, usage.model_s), (19200, Some(0.016), Some(10.0)));
        assert_eq!((usage.models, usage.endings), (vec!["a-model".into(), "other".into()], vec![]));
        let part = |robot: &str, model: &str, notes: u32| RobotUsage {
            robot: robot.into(),
            model: Some(model.into()),
            input_tokens: 5210 * u64::from(notes),
            output_tokens: 84 * u64::from(notes),
            cached_tokens: 4800 * u64::from(notes),
            usd: Some(0.004 * f64::from(notes)),
            model_s: Some(2.5 * f64::from(notes)),
        };
        assert_eq!(usage.robots, [part("A", "a-model", 2), part("B", "other", 1)]);
    }
}
