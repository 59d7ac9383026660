//! Operators of an episode, and the rules for them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Minimum and maximum patience, in seconds.
const PATIENCE_S: [f64; 2] = [0.05, 600.0];

/// Operators and their rules.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Driving {
    /// "per_robot": each robot has its own operator, which sees and commands that robot alone, with its token
    /// in the reply. "one" or null: one policy directs all robots.
    pub operators: Option<Operators>,
    /// Seconds for which operators wait for another's command before its robot holds still. Null: 120.
    /// Refused if one policy directs all.
    #[schemars(range(min = PATIENCE_S[0], max = PATIENCE_S[1]))]
    pub patience_s: Option<f64>,
    /// True: operators may talk to each other by the tool say, which is refused where one policy directs
    /// all. False or null: they may not.
    pub talk: Option<bool>,
}

impl Driving {
    /// Names of the fields in JSON.
    pub const FIELDS: [&str; 3] = ["operators", "patience_s", "talk"];

    const PATIENCE_S: f64 = 120.0;

    /// Returns true if each robot has its own operator.
    pub fn is_per_robot(&self) -> bool {
        self.operators == Some(Operators::PerRobot)
    }

    /// Returns the time in seconds for which operators wait for another operator's command.
    pub fn patience_s(&self) -> f64 {
        self.patience_s.unwrap_or(Driving::PATIENCE_S)
    }

    /// Returns the JSON Schema of the conditions in [`Driving::validate`] that concern several fields.
    pub(crate) fn conditions() -> Value {
        json!([
            { "required": ["operators"], "properties": { "operators": { "const": Operators::PerRobot } } },
            { "properties": { "talk": { "enum": [false, null] }, "patience_s": { "type": "null" } } },
        ])
    }

    /// Checks the patience, and that fields about operators are given only if there are operators. Errors
    /// state valid values.
    pub fn validate(&self) -> Result<(), String> {
        let given = [self.patience_s.map(|_| "patience_s"), self.talk.filter(|talk| *talk).map(|_| "talk")];
        if let (false, Some(field)) = (self.is_per_robot(), given.into_iter().flatten().next()) {
            return Err(format!(
                "{field} is for operators, and one policy directs all robots; add \"operators\": \"per_robot\", or leave {field} out"
            ));
        }
        let [shortest, longest] = PATIENCE_S;
        match self.patience_s {
            Some(given) if !(shortest..=longest).contains(&given) => Err(format!(
                "patience_s is {given}; give {shortest} to {longest} seconds, for example 120 for agents that think or 1 for learned policies"
            )),
            _ => Ok(()),
        }
    }
}

/// Operators of an episode.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Operators {
    /// One for all robots.
    #[default]
    One,
    /// One for each robot.
    PerRobot,
}

impl Operators {
    /// Returns true if one policy directs all robots.
    pub fn is_one(&self) -> bool {
        *self == Operators::One
    }
}

/// Credentials of a robot's operator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OperatorToken {
    /// The robot, for example "A".
    pub robot: String,
    /// Token that its operator sends with every request, for example `Authorization: Bearer TOKEN`.
    pub token: String,
}

/// Requests and thinking time of a robot's operator up to its last command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OperatorUse {
    /// The robot, for example "A".
    pub robot: String,
    /// Its operator's requests.
    pub requests: u32,
    /// Wall-clock thinking time of the operator since its first request, without steps, in seconds.
    pub thinking_s: f64,
}

/// Activity of a partner, in a reply.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Partner {
    /// Its robot, for example "B".
    pub robot: String,
    /// Its activity during the command.
    pub did: PartnerDid,
    /// Tool of its operator's command, or of the plan's present command; left out where there was none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
}

/// Activity of another operator's robot during a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PartnerDid {
    /// It followed its operator's command.
    Acted,
    /// It held still: no command came within the episode's patience. Nobody waits for its operator until it
    /// calls again.
    HeldSilent,
    /// It held still: its operator has called finish.
    HeldFinished,
}

/// Current activity of another operator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Presence {
    /// Name of its robot.
    pub robot: String,
    /// Its activity.
    pub state: PresenceState,
    /// Thinking time since its last reply, in seconds; left out unless it is thinking.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thinking_s: Option<f64>,
}

/// Activity of an operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PresenceState {
    /// It has not called yet.
    Absent,
    /// It thinks, and the others wait for it.
    Thinking,
    /// Its command waits for other commands.
    Waiting,
    /// Its command is executed.
    Acting,
    /// It has not commanded within the others' patience; they go on without it.
    Silent,
    /// It has called finish.
    Finished,
}

/// A partner's message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Heard {
    /// The speaker's robot, for example "B".
    pub from: String,
    /// The text.
    pub text: String,
    /// Control step of the episode.
    #[serde(default)]
    pub step: u32,
    /// Number of the speaker's message, counted from 1.
    #[serde(default)]
    pub number: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fields_are_those_of_the_type() {
        let driving = Driving { operators: Some(Operators::PerRobot), patience_s: None, talk: Some(true) };
        let written = json!(driving);
        let names: Vec<&String> = written.as_object().into_iter().flatten().map(|(name, _)| name).collect();
        assert_eq!(names, Driving::FIELDS);
        assert_eq!(written["operators"], "per_robot");
    }

    #[test]
    fn patience_has_its_limits() {
        let operators = Some(Operators::PerRobot);
        let with = |patience_s: f64| Driving { operators, patience_s: Some(patience_s), talk: None };
        for patience_s in PATIENCE_S {
            assert_eq!(with(patience_s).validate(), Ok(()));
        }
        for patience_s in [0.0, -1.0, 601.0, f64::NAN, f64::INFINITY] {
            assert!(with(patience_s).validate().is_err(), "{patience_s}");
        }
        assert_eq!((Driving::default().patience_s(), Driving::default().is_per_robot()), (120.0, false));
    }

    #[test]
    fn what_is_said_of_operators_needs_some() {
        let check =
            |operators: Option<Operators>, patience_s: Option<f64>, talk: Option<bool>, says: &str| {
                let text = Driving { operators, patience_s, talk }.validate().err().unwrap_or_default();
                assert!(text.contains(says) && text.is_empty() == says.is_empty(), "{text}");
            };
        for operators in [None, Some(Operators::One)] {
            check(operators, Some(5.0), None, "patience_s is for operators");
            check(operators, None, Some(true), "talk is for operators");
            check(operators, None, Some(true), "add \"operators\": \"per_robot\", or leave talk out");
            check(operators, None, Some(false), "");
        }
        check(Some(Operators::PerRobot), Some(5.0), Some(true), "");
    }
}
