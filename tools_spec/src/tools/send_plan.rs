//! `send_plan`: several commands in one call. `episodes/src/session/plan/` carries it out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::checks;
use crate::parts::PlanReply;
use crate::tool::Tool;
use crate::tools::{MoveWrists, SendJointChunk, Wait, Walk, WalkTo};

/// Maximum number of commands in one plan.
const MAX_COMMANDS: usize = 20;

/// Carry out up to 20 commands in order, each counted as a tool call, until one's `expects` does not hold.
/// With `until`, a command lasts until it does: lower a hand until it touches, wait until a phase is
/// reached. Returns the last command's reply, how many were carried out, and why no more. If one is
/// invalid, none is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SendPlan {
    /// Commands.
    #[schemars(length(min = 1, max = MAX_COMMANDS))]
    pub commands: Vec<PlannedCommand>,
    /// True: words of another operator end it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("for_operators" = true, "default" = false))]
    pub until_heard: bool,
}

/// One command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlannedCommand {
    /// Its tool.
    #[schemars(extend("enum" = SendPlan::COMMANDS))]
    pub tool: String,
    /// Its arguments, without episode_id.
    pub arguments: Map<String, Value>,
    /// Conditions after it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expects: Option<Expectation>,
    /// True: it ends once its `expects` hold, with `arrived`, or `holding` of fingers that move, not before
    /// all `steps`; else the plan stops then, up to 1500. For move_wrists, walk, wait.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub until: bool,
}

/// Conditions on the robots that the command names, or all after `wait`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// Every wrist with a target has arrived.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arrived: Option<bool>,
    /// A wrist is blocked or out of reach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blocked: Option<bool>,
    /// A hand presses on something.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub touching: Option<bool>,
    /// A hand holds something.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holding: Option<bool>,
    /// A hand feels more than this, in newtons.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_above_n: Option<f64>,
    /// No hand feels more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_below_n: Option<f64>,
    /// This phase is reached, for example "p1".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_reached: Option<String>,
    /// A robot steps or settles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_stepping: Option<bool>,
    /// Another operator has spoken since the plan began.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("for_operators" = true))]
    pub heard: Option<bool>,
    /// The operator of this robot has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("for_operators" = true))]
    pub heard_from: Option<String>,
    /// All others wait.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("for_operators" = true))]
    pub partners_wait: Option<bool>,
    /// One of these holds, each like `expects`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vec<Map<String, Value>>>")]
    pub any_of: Option<Vec<Expectation>>,
}

impl Expectation {
    /// Returns the name of a condition on other operators; `None` if there is none.
    pub fn names_partners(&self) -> Option<&'static str> {
        let own = [
            ("heard", self.heard.is_some()),
            ("heard_from", self.heard_from.is_some()),
            ("partners_wait", self.partners_wait.is_some()),
        ];
        let named = own.into_iter().find(|(_, is_given)| *is_given).map(|(name, _)| name);
        named.or_else(|| self.any_of.iter().flatten().find_map(Expectation::names_partners))
    }

    /// Returns true if there is no condition.
    pub fn is_empty(&self) -> bool {
        *self == Expectation::default()
    }

    /// Returns these conditions and all conditions in `any_of`.
    pub fn with_alternatives(&self) -> Vec<&Expectation> {
        let inner = self.any_of.iter().flatten().flat_map(Expectation::with_alternatives);
        [self].into_iter().chain(inner).collect()
    }

    /// Checks that forces are finite and that every alternative has a condition.
    fn validate(&self) -> Result<(), String> {
        for (name, force_n) in [("force_above_n", self.force_above_n), ("force_below_n", self.force_below_n)]
        {
            checks::finite(&format!("expects.{name}"), force_n.as_slice())?;
        }
        let Some(any_of) = &self.any_of else { return Ok(()) };
        match any_of.is_empty() || any_of.iter().any(Expectation::is_empty) {
            true => {
                Err("any_of has no condition, or an entry without one; give some, for example [{\"heard\": true}]"
                    .into())
            }
            false => any_of.iter().try_for_each(Expectation::validate),
        }
    }
}

impl SendPlan {
    /// Tools that a plan may contain: commands, and walks to a place.
    pub const COMMANDS: [&str; 5] =
        [MoveWrists::NAME, Walk::NAME, SendJointChunk::NAME, Wait::NAME, WalkTo::NAME];
    /// Commands that may continue until a condition holds.
    pub const UNTIL_COMMANDS: [&str; 3] = [MoveWrists::NAME, Walk::NAME, Wait::NAME];
    /// Maximum number of control steps of a command with `until`, the same as for a walk: half a minute.
    pub const MAX_UNTIL_STEPS: u32 = 1500;

    /// Returns the name of the command at `index` in messages.
    pub fn place(&self, index: usize) -> String {
        format!("command {} of {}", index + 1, self.commands.len())
    }
}

impl Tool for SendPlan {
    type Reply = PlanReply;
    const NAME: &'static str = "send_plan";
    const READ_ONLY: bool = false;
    /// The arguments of a command are an object that the schema of the command's tool describes.
    const STRICT: bool = false;
    const FULL_ONLY: bool = true;

    fn example() -> Self {
        let object = |value: Value| value.as_object().cloned().unwrap_or_default();
        let command = |tool: &str, arguments: Value, expects: Option<Expectation>| PlannedCommand {
            tool: tool.into(),
            arguments: object(arguments),
            expects,
            until: false,
        };
        let arrived = Expectation { arrived: Some(true), ..Expectation::default() };
        let reach = command(
            MoveWrists::NAME,
            json!({ "steps": 25, "robots": [{ "robot": "A", "right_position_m": [0.3, -0.2, 0.1] }] }),
            None,
        );
        let wait = command(Wait::NAME, json!({ "steps": 10 }), Some(arrived));
        SendPlan { commands: vec![reach, wait], until_heard: false }
    }

    fn robots(&self) -> Vec<&str> {
        let named = self.commands.iter().filter_map(|command| command.arguments.get("robots")?.as_array());
        named.flatten().filter_map(|entry| entry.get("robot")?.as_str()).collect()
    }

    fn validate(&self) -> Result<(), String> {
        match self.commands.len() {
            0 => return Err("commands is empty; give 1 to 20".into()),
            count if count > MAX_COMMANDS => {
                return Err(format!("commands holds {count}; give at most {MAX_COMMANDS}"));
            }
            _ => {}
        }
        self.commands.iter().enumerate().try_for_each(|(index, command)| {
            let expected = command.expects.as_ref().map_or(Ok(()), Expectation::validate);
            let checked = expected.and_then(|()| command.check_name());
            checked.map_err(|why| format!("{}: {why}", self.place(index)))
        })
    }
}

impl PlannedCommand {
    fn check_name(&self) -> Result<(), String> {
        let name = self.tool.as_str();
        if !SendPlan::COMMANDS.contains(&name) {
            return Err(format!("{name:?} is no command; have: {}", SendPlan::COMMANDS.join(", ")));
        }
        if !self.until {
            return Ok(());
        }
        if !SendPlan::UNTIL_COMMANDS.contains(&name) {
            return Err(format!(
                "{name} cannot have `until`; these can: {}",
                SendPlan::UNTIL_COMMANDS.join(", ")
            ));
        }
        if self.expects.as_ref().is_none_or(Expectation::is_empty) {
            return Err("`until` needs a condition in `expects`, for example {\"touching\": true}".into());
        }
        match self.arguments.get("steps").and_then(Value::as_u64) {
            Some(steps) if steps > u64::from(SendPlan::MAX_UNTIL_STEPS) => {
                Err(format!("steps is {steps}; with `until` give at most {}", SendPlan::MAX_UNTIL_STEPS))
            }
            _ => Ok(()),
        }
    }
}
