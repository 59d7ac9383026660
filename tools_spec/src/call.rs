//! A tool call on an episode by a program: the tool, and fields in addition to the tool's arguments. Models
//! do not see these fields: the schemas of request bodies contain them, the schemas of tools do not.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Map, Value, json};

use crate::error::SpecError;
use crate::list::{ActCall, EPISODE_TOOLS, LookCall, PlanCall, ToolCall, every_tool_spec};
use crate::parts::{Assistance, Driving, Formats, ImageFormat, Wording};
use crate::schema::{ToolSpec, body_schema, plain_schema};
use crate::strict_value::StrictValue;
use crate::tool::{Tool, parse_args};
use crate::tools::{
    Expectation, GetRobotState, Observation, Observe, PlannedCommand, SendPlan, StartEpisode, WalkTo,
};

/// A call on an episode. [`Call::parse`] can parse its serialized form.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Call {
    /// The tool and its arguments.
    #[serde(flatten)]
    pub tool: ToolCall,
    /// Formats of images, if the tool is `observe`.
    #[serde(flatten)]
    pub formats: Formats,
    /// Required step of the episode, if the tool is a command.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_step: Option<u32>,
    /// Observation to make when the command is done.
    #[serde(rename = "observe", skip_serializing_if = "Option::is_none")]
    pub then: Option<Look>,
    /// True to include the sensor readings of every physics step, if the tool is `get_robot_state` or
    /// `observe`.
    #[serde(skip_serializing_if = "is_false")]
    pub samples: bool,
    /// True for a short reply, which omits values that are as expected. `observe` has a separate field for
    /// this.
    #[serde(skip_serializing_if = "is_false")]
    pub short: bool,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

/// Fields of every tool that has no field of the same name.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct WithAll {
    /// True for a short reply.
    short: Option<bool>,
}

impl WithAll {
    const FIELDS: [&str; 1] = ["short"];
}

/// An observation, and the formats of its images.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Look {
    /// The observation.
    #[serde(flatten)]
    pub observe: Observe,
    /// Formats of its images.
    #[serde(flatten)]
    pub formats: Formats,
}

/// Additional fields of `get_robot_state` and `observe`.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
struct WithState {
    /// True: `samples` of the state are the sensor readings of each 5 ms physics step since the last control
    /// step.
    samples: Option<bool>,
}

impl WithState {
    const FIELDS: [&str; 1] = ["samples"];
}

/// Additional fields of commands.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
struct WithCommand {
    /// Required step of the episode, as in the `step` of an earlier reply; at another step, the command is
    /// refused with 409 and nothing moves. Null: any.
    #[schemars(range(max = u32::MAX))]
    expected_step: Option<u32>,
    /// Arguments of observe: the reply then has an `observation` from the end of the command. Null: none.
    #[schemars(extend("properties" = observe_properties(), "additionalProperties" = false))]
    observe: Option<Map<String, Value>>,
}

impl WithCommand {
    const FIELDS: [&str; 2] = ["expected_step", Observe::NAME];
}

impl Call {
    /// Parses the call of tool `name` from the arguments `args`, which include the additional fields.
    pub fn parse(name: &str, mut args: Value) -> Result<Call, SpecError> {
        let short = match EPISODE_TOOLS.iter().find(|tool| **tool == name && name != Observe::NAME) {
            Some(tool) => beside::<WithAll>(tool, &mut args, &WithAll::FIELDS)?.short.unwrap_or(false),
            None => false,
        };
        Ok(Call { short, ..Call::parse_in_full(name, args)? })
    }

    fn parse_in_full(name: &str, mut args: Value) -> Result<Call, SpecError> {
        if let Some(tool) = ActCall::TOOLS.iter().find(|tool| **tool == name) {
            let beside: WithCommand = beside(tool, &mut args, &WithCommand::FIELDS)?;
            let call = ToolCall::parse(name, args)?;
            let then = beside.observe.map(|args| Look::parse(args.into())).transpose()?;
            return Ok(Call { expected_step: beside.expected_step, then, ..Call::from(call) });
        }
        match name {
            Observe::NAME => {
                let beside: WithState = beside(Observe::NAME, &mut args, &WithState::FIELDS)?;
                Ok(Call { samples: beside.samples.unwrap_or(false), ..Look::parse(args)?.into() })
            }
            GetRobotState::NAME => {
                let beside: WithState = beside(GetRobotState::NAME, &mut args, &WithState::FIELDS)?;
                let call = Call::from(ToolCall::parse(name, args)?);
                Ok(Call { samples: beside.samples.unwrap_or(false), ..call })
            }
            _ => ToolCall::parse(name, args).map(Call::from),
        }
    }

    /// Returns the tool's name.
    pub fn name(&self) -> &'static str {
        self.tool.name()
    }

    /// Returns the robots that the call and its observation name.
    pub fn robots(&self) -> Vec<&str> {
        let then = self.then.iter().flat_map(|look| look.observe.robots());
        self.tool.robots().into_iter().chain(then).collect()
    }

    /// Returns the number of requested control steps of 20 ms; 0 if the call is not a command.
    pub fn steps(&self) -> u32 {
        self.tool.steps()
    }

    /// Returns true for `observe` with `short`, unless the caller requests arrays. Programs that request
    /// arrays get all numbers.
    pub fn looks_shortly(&self) -> bool {
        let is_short =
            matches!(&self.tool, ToolCall::Look(LookCall::Observe(args)) if args.short == Some(true));
        is_short && self.formats.images != Some(ImageFormat::Rgb) && self.formats.depth.is_none()
    }

    /// Limits observations that name no robot to `robot`.
    pub fn looking_through(mut self, robot: &str) -> Call {
        let then = self.then.as_mut().map(|look| &mut look.observe);
        let own = match &mut self.tool {
            ToolCall::Look(LookCall::Observe(observe)) => Some(observe),
            ToolCall::Look(_)
            | ToolCall::Act(_)
            | ToolCall::Plan(_)
            | ToolCall::Manage(_)
            | ToolCall::Talk(_) => None,
        };
        for observe in own.into_iter().chain(then) {
            observe.robots.get_or_insert_with(|| vec![robot.into()]);
        }
        self
    }

    /// Checks a call that was built in Rust. [`Call::parse`] has already checked calls from JSON.
    pub fn validate(&self) -> Result<(), SpecError> {
        self.tool.validate()?;
        match &self.then {
            Some(look) => look.call().validate(),
            None => Ok(()),
        }
    }
}

impl From<ToolCall> for Call {
    fn from(tool: ToolCall) -> Call {
        Call {
            tool,
            formats: Formats::default(),
            expected_step: None,
            then: None,
            samples: false,
            short: false,
        }
    }
}

impl From<Look> for Call {
    fn from(look: Look) -> Call {
        Call { formats: look.formats, ..Call::from(look.call()) }
    }
}

impl Look {
    /// Parses arguments of `observe`, which may include formats.
    pub fn parse(mut args: Value) -> Result<Look, SpecError> {
        let formats = beside(Observe::NAME, &mut args, &Formats::FIELDS)?;
        Ok(Look { observe: parse_args(args)?, formats })
    }

    /// Returns the call without the formats.
    fn call(&self) -> ToolCall {
        self.observe.clone().into()
    }
}

impl SendPlan {
    /// Returns the commands as calls.
    pub fn calls(&self) -> Result<Vec<PlanStep>, SpecError> {
        let call = |(index, command): (usize, &PlannedCommand)| {
            let refused = |reason: String| SpecError::Invalid {
                tool: SendPlan::NAME,
                reason: format!("{}: {reason}", self.place(index)),
            };
            let mut args = Value::Object(command.arguments.clone());
            let with_all = beside::<WithAll>(SendPlan::NAME, &mut args, &WithAll::FIELDS)
                .map_err(|error| refused(error.to_string()))?;
            let call = match ToolCall::parse(&command.tool, args) {
                Ok(ToolCall::Act(call)) if SendPlan::COMMANDS.contains(&call.name()) => {
                    PlannedCall::Act(call)
                }
                Ok(ToolCall::Plan(PlanCall::WalkTo(walk))) => PlannedCall::WalkTo(walk),
                Ok(other) => return Err(refused(format!("{} is no command of a plan", other.name()))),
                Err(error) => return Err(refused(error.to_string())),
            };
            let (expects, short) =
                (command.expects.clone().unwrap_or_default(), with_all.short.unwrap_or(false));
            Ok(PlanStep { place: self.place(index), call, expects, until: command.until, short })
        };
        self.commands.iter().enumerate().map(call).collect()
    }
}

/// A parsed command of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanStep {
    /// Name of the command's place in the plan, for messages.
    pub place: String,
    /// The command.
    pub call: PlannedCall,
    /// Conditions that have to hold after the command.
    pub expects: Expectation,
    /// True if the command ends as soon as the conditions hold.
    pub until: bool,
    /// True for a short reply, if it is the last executed command.
    pub short: bool,
}

/// A call that a plan may contain.
#[derive(Debug, Clone, PartialEq)]
pub enum PlannedCall {
    /// One command.
    Act(ActCall),
    /// A walk to a place, which consists of several commands.
    WalkTo(WalkTo),
}

impl PlannedCall {
    /// Returns the name of the tool.
    pub fn name(&self) -> &'static str {
        match self {
            PlannedCall::Act(call) => call.name(),
            PlannedCall::WalkTo(_) => WalkTo::NAME,
        }
    }
}

/// Parses the arguments of `start_episode` and the fields about the episode's operators.
pub fn parse_start(mut args: Value) -> Result<(StartEpisode, Driving), SpecError> {
    let driving: Driving = beside(StartEpisode::NAME, &mut args, &Driving::FIELDS)?;
    let invalid = |reason| SpecError::Invalid { tool: StartEpisode::NAME, reason };
    driving.validate().map_err(invalid)?;
    Ok((parse_args(args)?, driving))
}

/// Removes `fields` from the arguments of `tool` and parses them.
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

/// Returns every tool. The schema of a tool's body includes the additional fields that programs may send.
pub fn specs_for_programs(wording: impl Into<Wording>) -> Vec<ToolSpec> {
    let wording = wording.into();
    let mut specs = every_tool_spec(wording);
    let commands = specs.iter().filter(|spec| SendPlan::COMMANDS.contains(&spec.name));
    let planned: Vec<Value> = commands.map(ToolSpec::as_planned).collect();
    for spec in &mut specs {
        match spec.name {
            SendPlan::NAME => spec.demand_of_commands(planned.clone()),
            StartEpisode::NAME => {
                spec.allow(&properties::<Driving>(wording));
                spec.demand_one_of(Driving::conditions());
            }
            Observe::NAME => {
                spec.allow(&properties::<Formats>(wording));
                allow_samples(spec, wording);
            }
            GetRobotState::NAME => allow_samples(spec, wording),
            name if ActCall::TOOLS.contains(&name) => {
                spec.allow(&properties::<WithCommand>(wording));
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

fn allow_samples(spec: &mut ToolSpec, wording: Wording) {
    if wording.assistance == Assistance::Full {
        spec.allow(&properties::<WithState>(wording));
    }
}

fn properties<T: JsonSchema>(wording: Wording) -> Map<String, Value> {
    properties_of(body_schema::<T>(wording))
}

fn properties_of(mut schema: Value) -> Map<String, Value> {
    schema["properties"].as_object_mut().map(std::mem::take).unwrap_or_default()
}

/// Returns the schema of `observe` as a field of a command. Its texts are adapted together with the
/// command's.
fn observe_properties() -> Value {
    let own = properties_of(plain_schema::<Observe>()).into_iter();
    json!(own.chain(properties_of(plain_schema::<Formats>())).collect::<Map<_, _>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::{DepthFormat, Operators};
    use crate::tools::{GetStatus, MoveWrists, Say, Wait, WristMove};

    fn looking(robots: &[&str]) -> Look {
        let robots = Some(robots.iter().map(|robot| robot.to_string()).collect());
        let formats = Formats { images: Some(ImageFormat::Rgb), depth: None };
        Look { observe: Observe { robots, ..Observe::of_all() }, formats }
    }

    #[test]
    fn what_stands_beside_the_arguments_is_read() {
        let plain = Call::parse("wait", json!({ "steps": 5 })).unwrap();
        assert_eq!(plain, Call::from(ToolCall::from(Wait { steps: 5 })));
        let call = Call::parse(
            "wait",
            json!({ "steps": 5, "expected_step": 300.0, "observe": { "robots": ["A"], "images": "rgb" } }),
        );
        assert_eq!(call.unwrap(), Call { expected_step: Some(300), then: Some(looking(&["A"])), ..plain });
        let call = Call::parse("observe", json!({ "depth": "float16", "short": true })).unwrap();
        assert_eq!(call.tool, Observe { short: Some(true), ..Observe::of_all() }.into());
        assert_eq!(call.formats, Formats { images: None, depth: Some(DepthFormat::Float16) });
        let call = Call::parse("get_robot_state", json!({ "robot": "A", "samples": true })).unwrap();
        assert!(call.samples, "{call:?}");
        let (start, driving) =
            parse_start(json!({ "task": "handover", "seed": 0, "operators": "per_robot" })).unwrap();
        assert_eq!((start.seed, driving.operators), (0, Some(Operators::PerRobot)));
    }

    #[test]
    fn what_is_written_is_read_back() {
        let examples = ToolCall::examples().into_iter().map(Call::from);
        let wait = Call::from(ToolCall::from(Wait { steps: 5 }));
        let whole = Call { expected_step: Some(300), then: Some(looking(&["A", "B"])), ..wait };
        let sampled = Call { samples: true, ..Call::from(ToolCall::from(GetRobotState::of("A"))) };
        let looked = Call { samples: true, ..Call::from(looking(&["A"])) };
        for call in examples.chain([whole, Call::from(looking(&["B"])), sampled, looked]) {
            assert_eq!(Call::parse(call.name(), json!(call)), Ok(call));
        }
        assert_eq!(json!(Call::from(ToolCall::from(GetStatus::default()))), json!({}));
    }

    /// Every tool has the field for a short reply, and its serialized form can be parsed.
    #[test]
    fn every_tool_takes_short() {
        for call in ToolCall::examples() {
            let mut args = json!(call);
            args["short"] = true.into();
            let read = Call::parse(call.name(), args).unwrap();
            assert!(read.short != (call.name() == Observe::NAME), "{read:?}");
            assert_eq!(Call::parse(read.name(), json!(read)), Ok(read));
            let mut args = json!(call);
            args["short"] = "yes".into();
            assert!(Call::parse(call.name(), args).unwrap_err().to_string().contains("short"));
        }
    }

    #[test]
    fn a_call_knows_its_robots_and_its_steps() {
        let robots = |call: &Call| call.robots().join(" ");
        for (name, example) in ToolCall::examples().into_iter().map(|call| (call.name(), Call::from(call))) {
            assert_eq!(example.steps() > 0, ActCall::TOOLS.contains(&name), "{name}");
            let named = if ["wait", "get_status", "finish", "say"].contains(&name) { "" } else { "A" };
            assert_eq!(robots(&example), named, "{name}");
        }
        let both = vec![WristMove::hold("B"), WristMove::hold("A")];
        let reach = Call::from(ToolCall::from(MoveWrists { steps: 7, robots: both }));
        assert_eq!((robots(&reach).as_str(), reach.steps()), ("B A", 7));
        assert_eq!(robots(&Call { then: Some(looking(&["C"])), ..reach }), "B A C");
    }

    #[test]
    fn who_looks_for_itself_need_not_say_so() {
        let all = Observe::of_all;
        let look = || Look { observe: all(), formats: Formats::default() };
        let wait = Call { then: Some(look()), ..Call::from(ToolCall::from(Wait { steps: 1 })) };
        for call in [Call::from(look()), wait] {
            assert_eq!(call.looking_through("B").robots(), ["B"]);
        }
        for named in [ToolCall::from(GetRobotState::of("A")), Say { text: "B.".into() }.into()] {
            assert_eq!(Call::from(named.clone()).looking_through("B"), Call::from(named));
        }
    }

    #[test]
    fn refusals_name_the_field() {
        let check = |name: &str, args: Value, says: &str| {
            let text = Call::parse(name, args).unwrap_err().to_string();
            assert!(text.contains(says), "{text}");
        };
        check("wait", json!({ "steps": 5, "expected_step": -1 }), "wait: expected_step: ");
        check("wait", json!({ "steps": 5, "observe": { "robot": "A" } }), "unknown field `robot`");
        check("wait", json!({ "steps": 5, "observe": { "robots": [] } }), "at least one robot");
        check(
            "observe",
            json!({ "images": "jpeg" }),
            "unknown variant `jpeg`, expected one of `png`, `rgb`, `link`",
        );
        check("get_status", json!({ "expected_step": 3 }), "unknown field `expected_step`");
        check("grasp", json!({}), "no tool \"grasp\"");
        let start = |field: &str, value: Value| {
            let start = json!({ "task": "handover", "seed": 0, "operators": "per_robot", field: value });
            parse_start(start).unwrap_err().to_string()
        };
        assert!(start("patience_s", json!(0)).contains("patience_s is 0"));
        assert!(start("operators", json!("two")).contains("`per_robot`"));
    }

    #[test]
    fn bodies_allow_it_and_models_do_not_see_it() {
        for spec in specs_for_programs(Assistance::Full) {
            let beside: &[&str] = match spec.name {
                StartEpisode::NAME => &Driving::FIELDS,
                Observe::NAME => &Formats::FIELDS,
                GetRobotState::NAME => &WithState::FIELDS,
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
