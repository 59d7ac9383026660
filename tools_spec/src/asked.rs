//! What a program may ask for besides a tool's own arguments. Models are shown none of it: it stands in the schemas of bodies, not in
//! those of tools.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Map, Value, json};

use crate::error::SpecError;
use crate::list::{ActCall, LookCall, ToolCall, tool_specs};
use crate::parts::{Driving, Formats, Hints};
use crate::schema::{ToolSpec, body_schema, plain_schema};
use crate::strict_value::StrictValue;
use crate::tool::{Tool, parse_args};
use crate::tools::{Observation, Observe, StartEpisode};

/// A call on an episode, and what a program asks for besides.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// The call.
    pub call: ToolCall,
    /// How pictures are to come, where the call looks.
    pub formats: Formats,
    /// Of a command: the step that the episode has to stand at.
    pub expected_step: Option<u32>,
    /// Of a command: what to look at once it is done.
    pub then: Option<Look>,
}

/// An observation, and how its pictures are to come.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Look {
    /// What to look at.
    #[serde(flatten)]
    pub observe: Observe,
    /// How pictures are to come.
    #[serde(flatten)]
    pub formats: Formats,
}

/// What goes with a command.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
struct WithCommand {
    /// The step that the episode has to stand at, as the `step` of an earlier reply has it; where it stands at another, the
    /// command is refused with 409 and nothing moves. Null: at any.
    #[schemars(range(max = u32::MAX))]
    expected_step: Option<u32>,
    /// Arguments of observe: the reply then has as `observation` what is seen when the command is done. Null: nothing.
    #[schemars(extend("properties" = observe_properties(), "additionalProperties" = false))]
    observe: Option<Map<String, Value>>,
}

impl WithCommand {
    const FIELDS: [&str; 2] = ["expected_step", Observe::NAME];
}

impl Asked {
    /// Reads a call with whatever may stand beside its arguments.
    pub fn parse(name: &str, mut args: Value) -> Result<Asked, SpecError> {
        if let Some(tool) = ActCall::TOOLS.iter().find(|tool| **tool == name) {
            let beside: WithCommand = beside(tool, &mut args, &WithCommand::FIELDS)?;
            let call = ToolCall::parse(name, args)?;
            let then = beside.observe.map(|args| Look::parse(args.into())).transpose()?;
            return Ok(Asked { expected_step: beside.expected_step, then, ..Asked::from(call) });
        }
        if name == Observe::NAME {
            let Look { observe, formats } = Look::parse(args)?;
            return Ok(Asked { formats, ..Asked::from(ToolCall::from(observe)) });
        }
        Ok(Asked::from(ToolCall::parse(name, args)?))
    }
}

impl From<ToolCall> for Asked {
    fn from(call: ToolCall) -> Asked {
        Asked { call, formats: Formats::default(), expected_step: None, then: None }
    }
}

impl Look {
    /// Reads arguments of `observe` with formats among them.
    pub fn parse(mut args: Value) -> Result<Look, SpecError> {
        let formats = beside(Observe::NAME, &mut args, &Formats::FIELDS)?;
        Ok(Look { observe: parse_args(args)?, formats })
    }

    /// The call alone.
    pub fn call(&self) -> ToolCall {
        ToolCall::Look(LookCall::Observe(self.observe.clone()))
    }
}

/// Reads the arguments of `start_episode`, and by whom the episode is to be driven.
pub fn parse_start(mut args: Value) -> Result<(StartEpisode, Driving), SpecError> {
    let driving: Driving = beside(StartEpisode::NAME, &mut args, &Driving::FIELDS)?;
    let invalid = |reason| SpecError::Invalid { tool: StartEpisode::NAME, reason };
    driving.validate().map_err(invalid)?;
    Ok((parse_args(args)?, driving))
}

/// Takes `fields` out of the arguments of `tool` and reads them.
fn beside<T: DeserializeOwned + Default>(
    tool: &'static str,
    args: &mut Value,
    fields: &[&str],
) -> Result<T, SpecError> {
    let Value::Object(object) = args else { return Ok(T::default()) };
    let taken: Map<String, Value> =
        fields.iter().filter_map(|field| object.shift_remove_entry(*field)).collect();
    if taken.is_empty() {
        return Ok(T::default());
    }
    serde_path_to_error::deserialize(StrictValue(taken.into()))
        .map_err(|error| SpecError::Invalid { tool, reason: format!("{}: {}", error.path(), error.inner()) })
}

/// Every tool, with what programs may send beside its arguments in the schema of its body.
pub fn specs_for_programs(hints: Hints) -> Vec<ToolSpec> {
    let mut specs = tool_specs(hints);
    for spec in &mut specs {
        match spec.name {
            StartEpisode::NAME => spec.allow(&properties::<Driving>()),
            Observe::NAME => spec.allow(&properties::<Formats>()),
            name if ActCall::TOOLS.contains(&name) => {
                spec.allow(&properties::<WithCommand>());
                let mut observation = plain_schema::<Observation>();
                observation["description"] =
                    json!("What is seen after the command; left out where it did not ask.");
                spec.reply_schema["properties"]["observation"] = observation;
            }
            _ => {}
        }
    }
    specs
}

fn properties<T: JsonSchema>() -> Map<String, Value> {
    let mut schema = body_schema::<T>(Hints::default());
    schema["properties"].as_object_mut().map(std::mem::take).unwrap_or_default()
}

/// What `observe` may hold beside a command.
fn observe_properties() -> Value {
    json!(properties::<Observe>().into_iter().chain(properties::<Formats>()).collect::<Map<_, _>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::{DepthFormat, ImageFormat, Operators};
    use crate::tools::Wait;

    #[test]
    fn what_stands_beside_the_arguments_is_read() {
        let plain = Asked::parse("wait", json!({ "steps": 5 })).unwrap();
        assert_eq!(plain, Asked::from(ToolCall::from(Wait { steps: 5 })));
        let asked = Asked::parse(
            "wait",
            json!({ "steps": 5, "expected_step": 300.0, "observe": { "robots": ["A"], "images": "rgb" } }),
        );
        let formats = Formats { images: Some(ImageFormat::Rgb), depth: None };
        let look = Look { observe: Observe { robots: Some(vec!["A".into()]), short: None }, formats };
        assert_eq!(asked.unwrap(), Asked { expected_step: Some(300), then: Some(look), ..plain });
        let asked = Asked::parse("observe", json!({ "depth": "float16", "short": true })).unwrap();
        assert_eq!(asked.call, Observe { robots: None, short: Some(true) }.into());
        assert_eq!(asked.formats, Formats { images: None, depth: Some(DepthFormat::Float16) });
        let (start, driving) =
            parse_start(json!({ "task": "handover", "seed": 0, "operators": "per_robot" })).unwrap();
        assert_eq!((start.seed, driving.operators), (0, Some(Operators::PerRobot)));
    }

    #[test]
    fn refusals_name_the_field() {
        let check = |name: &str, args: Value, says: &str| {
            let text = Asked::parse(name, args).unwrap_err().to_string();
            assert!(text.contains(says), "{text}");
        };
        check("wait", json!({ "steps": 5, "expected_step": -1 }), "wait: expected_step: ");
        check("wait", json!({ "steps": 5, "observe": { "robot": "A" } }), "unknown field `robot`");
        check("wait", json!({ "steps": 5, "observe": { "robots": [] } }), "at least one robot");
        check("observe", json!({ "images": "jpeg" }), "unknown variant `jpeg`, expected `png` or `rgb`");
        check("get_status", json!({ "expected_step": 3 }), "unknown field `expected_step`");
        check("grasp", json!({}), "no tool \"grasp\"");
        let start = |field: &str, value: Value| {
            parse_start(json!({ "task": "handover", "seed": 0, field: value })).unwrap_err().to_string()
        };
        assert!(start("patience_s", json!(0)).contains("patience_s is 0"));
        assert!(start("operators", json!("two")).contains("`per_robot`"));
    }

    #[test]
    fn bodies_allow_it_and_models_do_not_see_it() {
        for spec in specs_for_programs(Hints::On) {
            let beside: &[&str] = match spec.name {
                StartEpisode::NAME => &Driving::FIELDS,
                Observe::NAME => &Formats::FIELDS,
                name if ActCall::TOOLS.contains(&name) => &WithCommand::FIELDS,
                _ => &[],
            };
            let body = spec.body_schema(25);
            for field in beside {
                assert!(body["properties"][field]["description"].is_string(), "{}: {field}", spec.name);
                assert!(spec.input_schema["properties"].get(*field).is_none(), "{}: {field}", spec.name);
            }
        }
    }
}
