//! Calls to an episode: a tool call, or simultaneous commands of operators with a robot each. A recording
//! stores them, and a replay repeats them.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use tandem_tools_spec::{
    ActCall, Call, Formats, JointChunk, JointDrives, Look, MoveWrists, OperatorUse, SendJointChunk,
    SendJointDrives, SpecError, ToolCall, Wait, Walk,
};

use super::{Command, Motion, RobotAction, RobotOrder, find};
use crate::EpisodeError;
use crate::protocol::Rules;

/// A call to an episode.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "one call at a time is on its way")]
pub enum Called {
    /// One call, by the policy of all robots or an operator of one.
    One(Call),
    /// Commands of several operators, executed at the same time for the duration of the shortest command.
    /// Robots without a command hold still.
    Together(Vec<OperatorCall>),
}

/// A call that the operator of one robot may make: it fits the contract and names no other robot.
#[derive(Clone, Debug, PartialEq)]
pub struct OperatorCall {
    robot: String,
    call: Call,
    /// Tool of the plan's command to which the call belongs. The plan has been counted as a request already.
    planned: Option<&'static str>,
}

/// An operator's command that has been read, to be executed together with the other operators' commands.
#[derive(Clone, Debug)]
pub struct OperatorCommand {
    /// The call in the recording's form.
    pub(crate) call: OperatorCall,
    /// Number of control steps requested.
    pub(crate) steps: u32,
    /// Requests and thinking time of its operator so far, as counted by the host.
    pub(crate) used: Option<OperatorUse>,
}

/// Checked calls that show their callers no withheld information. Only [`Called::allowed`] makes them,
/// and no call is answered without one.
#[derive(Clone, Copy)]
pub(crate) struct Allowed<'a>(&'a Called);

impl<'a> Allowed<'a> {
    /// Returns the checked call.
    pub(crate) fn called(self) -> &'a Called {
        self.0
    }
}

/// Options of a caller's call.
pub(crate) struct Surroundings {
    /// The caller's robot, if each robot has an operator and several call together.
    pub operator: Option<String>,
    /// Observation requested after the call.
    pub then: Option<Look>,
    /// True for a short reply.
    pub short: bool,
}

/// Arguments of [`Called::Together`] in a recording.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TogetherArguments {
    commands: Vec<OperatorArguments>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OperatorArguments {
    robot: String,
    tool: String,
    arguments: Value,
}

impl Called {
    /// Name of simultaneous commands in recordings.
    pub const TOGETHER: &str = "together";

    /// Returns the tool's name, or [`Called::TOGETHER`].
    pub fn name(&self) -> &'static str {
        match self {
            Called::One(call) => call.name(),
            Called::Together(_) => Called::TOGETHER,
        }
    }

    /// Returns every caller's call.
    pub(crate) fn calls(&self) -> Vec<&Call> {
        match self {
            Called::One(call) => vec![call],
            Called::Together(calls) => calls.iter().map(OperatorCall::call).collect(),
        }
    }

    /// Checks that each call fits the contract and passes `check`.
    ///
    /// # Errors
    ///
    /// If a call does not fit the contract or `check` refuses it. The first such error is returned.
    pub(crate) fn allowed(
        &self,
        check: impl Fn(&ToolCall) -> Result<(), EpisodeError>,
    ) -> Result<Allowed<'_>, EpisodeError> {
        for call in self.calls() {
            call.validate()?;
            check(&call.tool)?;
        }
        Ok(Allowed(self))
    }

    /// Returns the requested image formats.
    pub(crate) fn formats(&self) -> Formats {
        match self {
            Called::One(call) => call.formats,
            Called::Together(_) => Formats::default(),
        }
    }

    /// Returns true if every command belongs to a plan, which has been counted as a request already.
    pub(crate) fn continues_plans(&self) -> bool {
        match self {
            Called::One(_) => false,
            Called::Together(calls) => calls.iter().all(|own| own.planned.is_some()),
        }
    }

    /// Returns true for an observation or measurement, which moves no robot.
    pub(crate) fn is_look(&self) -> bool {
        matches!(self, Called::One(Call { tool: ToolCall::Look(_), .. }))
    }

    /// Removes the options from every caller's call, which leaves the content of a recording.
    pub(crate) fn take_surroundings(&mut self) -> Vec<Surroundings> {
        let take = |call: &mut Call, operator: Option<String>| {
            call.expected_step = None;
            Surroundings { operator, then: call.then.take(), short: call.short || call.looks_shortly() }
        };
        match self {
            Called::One(call) => vec![take(call, None)],
            Called::Together(calls) => {
                calls.iter_mut().map(|own| take(&mut own.call, Some(own.robot.clone()))).collect()
            }
        }
    }

    /// Returns the arguments as JSON, for [`Called::parse`].
    pub fn arguments(&self) -> Result<String, serde_json::Error> {
        match self {
            Called::One(call) => serde_json::to_string(call),
            Called::Together(calls) => {
                let commands = calls.iter().map(OperatorCall::arguments).collect::<Result<_, _>>()?;
                serde_json::to_string(&TogetherArguments { commands })
            }
        }
    }

    /// Parses a call from a recording.
    ///
    /// # Errors
    ///
    /// Malformed arguments, or a call that an operator may not make.
    pub fn parse(name: &str, arguments: Value) -> Result<Called, EpisodeError> {
        if name != Called::TOGETHER {
            return Ok(Called::One(Call::parse(name, arguments)?));
        }
        let malformed = |error: serde_json::Error| SpecError::Malformed {
            tool: Called::TOGETHER,
            place: String::new(),
            reason: error.to_string(),
            example: r#"{"commands":[{"robot":"A","tool":"wait","arguments":{"steps":25}}]}"#.into(),
        };
        let arguments: TogetherArguments = serde_json::from_value(arguments).map_err(malformed)?;
        let calls = arguments.commands.into_iter().map(OperatorCall::parse);
        Ok(Called::Together(calls.collect::<Result<_, _>>()?))
    }
}

impl From<ToolCall> for Called {
    fn from(tool: ToolCall) -> Called {
        Called::One(tool.into())
    }
}

impl From<Call> for Called {
    fn from(call: Call) -> Called {
        Called::One(call)
    }
}

impl OperatorCall {
    /// Returns the call for the operator of `robot`. An observation that names no robot is of the operator's
    /// robot.
    ///
    /// # Errors
    ///
    /// A call that does not fit the contract, or [`EpisodeError::ForeignRobot`].
    pub fn new(robot: &str, call: Call) -> Result<OperatorCall, EpisodeError> {
        call.validate()?;
        let call = call.looking_through(robot);
        if let Some(name) = call.robots().into_iter().find(|name| *name != robot) {
            return Err(EpisodeError::ForeignRobot { name: name.into(), own: robot.into() });
        }
        Ok(OperatorCall { robot: robot.into(), call, planned: None })
    }

    /// Returns the call as part of a plan's command, which has the tool `tool`.
    pub fn planned(self, tool: &'static str) -> OperatorCall {
        OperatorCall { planned: Some(tool), ..self }
    }

    /// Returns the tool's name. For a part of a plan, returns the name of the tool of the plan's command.
    pub fn tool(&self) -> &'static str {
        self.planned.unwrap_or(self.call.name())
    }

    /// Returns the operator's robot.
    pub fn robot(&self) -> &str {
        &self.robot
    }

    /// Returns the operator's tool call.
    pub fn call(&self) -> &Call {
        &self.call
    }

    /// Returns the operator's tool call by value.
    pub fn into_call(self) -> Call {
        self.call
    }

    /// Returns the command without the observation requested after it.
    pub fn unseen(mut self) -> OperatorCall {
        self.call.then = None;
        self
    }

    /// Returns the rest of a command after this many control steps; `None` for a finished command and for
    /// other calls.
    pub fn rest(&self, executed_steps: u32) -> Option<OperatorCall> {
        let ToolCall::Act(act) = &self.call.tool else { return None };
        let steps = act.steps().checked_sub(executed_steps).filter(|left| *left > 0)?;
        let rest = match act.clone() {
            ActCall::MoveWrists(command) => ActCall::MoveWrists(MoveWrists { steps, ..command }),
            ActCall::Walk(command) => ActCall::Walk(Walk { steps, ..command }),
            ActCall::Wait(Wait { steps: _ }) => ActCall::Wait(Wait { steps }),
            ActCall::SendJointChunk(SendJointChunk { robots }) => {
                let left = |chunk: JointChunk| JointChunk {
                    rows: chunk.rows.into_iter().skip(executed_steps as usize).collect(),
                    ..chunk
                };
                ActCall::SendJointChunk(SendJointChunk { robots: robots.into_iter().map(left).collect() })
            }
            ActCall::SendJointDrives(SendJointDrives { robots }) => {
                let left = |drives: JointDrives| JointDrives {
                    rows: drives.rows.into_iter().skip(executed_steps as usize).collect(),
                    ..drives
                };
                ActCall::SendJointDrives(SendJointDrives { robots: robots.into_iter().map(left).collect() })
            }
        };
        let call = Call { tool: ToolCall::Act(rest), expected_step: None, ..self.call.clone() };
        Some(OperatorCall { robot: self.robot.clone(), call, planned: self.planned })
    }

    /// Returns the command without its expected step, which has been checked.
    pub(crate) fn at_any_step(mut self) -> OperatorCall {
        self.call.expected_step = None;
        self
    }

    /// Reads the order for the operator's robot; `motions` are those of all robots.
    pub(crate) fn order(&self, rules: &Rules, motions: &[Motion]) -> Result<RobotOrder, EpisodeError> {
        let robot = find(&self.robot, motions)?;
        let Command { steps, orders } = Command::read(self.command()?, rules, motions)?;
        let own = orders.into_iter().find(|order| order.robot == robot);
        Ok(own.unwrap_or(RobotOrder { robot, steps, action: RobotAction::Wait }))
    }

    fn command(&self) -> Result<&ActCall, SpecError> {
        match &self.call.tool {
            ToolCall::Act(call) => Ok(call),
            other => Err(SpecError::Invalid {
                tool: Called::TOGETHER,
                reason: format!("{} is no command; operators command by move_wrists and such", other.name()),
            }),
        }
    }

    fn arguments(&self) -> Result<OperatorArguments, serde_json::Error> {
        Ok(OperatorArguments {
            robot: self.robot.clone(),
            tool: self.call.name().into(),
            arguments: serde_json::to_value(&self.call)?,
        })
    }

    fn parse(arguments: OperatorArguments) -> Result<OperatorCall, EpisodeError> {
        let OperatorArguments { robot, tool, arguments } = arguments;
        let call = OperatorCall::new(&robot, Call::parse(&tool, arguments)?)?;
        // A recording has plans that were refused as a whole, which a replay refuses again.
        if !matches!(call.call.tool, ToolCall::Plan(_)) {
            call.command()?;
        }
        Ok(call)
    }
}

impl OperatorCommand {
    /// Adds the operator's requests and thinking time so far.
    pub fn with_use(self, used: OperatorUse) -> OperatorCommand {
        OperatorCommand { used: Some(used), ..self }
    }

    /// Returns the operator's robot.
    pub fn robot(&self) -> &str {
        self.call.robot()
    }

    /// Returns the number of control steps requested.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// Returns the tool's name. For a part of a plan, returns the name of the tool of the plan's command.
    pub fn tool(&self) -> &'static str {
        self.call.tool()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use tandem_tools_spec::{GetStatus, Observe, Say, SendPlan, Tool, Wait, Walk};

    use super::*;

    fn operator(robot: &str, call: impl Into<ToolCall>) -> OperatorCall {
        OperatorCall::new(robot, Call::from(call.into())).unwrap()
    }

    #[test]
    fn what_is_written_is_read_back() {
        let commands = vec![operator("A", Walk::example()), operator("B", Wait { steps: 5 })];
        for called in [
            Called::Together(commands),
            Called::from(ToolCall::from(Say { text: "Ready.".into() })),
            Called::from(ToolCall::from(Wait { steps: 3 })),
        ] {
            let arguments = serde_json::from_str(&called.arguments().unwrap()).unwrap();
            assert_eq!(Called::parse(called.name(), arguments).unwrap(), called);
        }
    }

    #[test]
    fn of_a_command_that_is_cut_off_the_rest_is_left() {
        let rows = (0..3).map(|row| vec![f64::from(row); 35]).collect();
        let chunk = SendJointChunk { robots: vec![JointChunk { robot: "A".into(), rows }] };
        let rest = operator("A", chunk).rest(1).unwrap();
        let ToolCall::Act(ActCall::SendJointChunk(left)) = &rest.call().tool else { panic!("{rest:?}") };
        assert_eq!(left.robots[0].rows.iter().map(|row| row[0]).collect::<Vec<_>>(), [1.0, 2.0]);
        for call in [
            operator("A", Walk::example()),
            operator("A", MoveWrists::example()),
            operator("A", Wait { steps: 25 }),
        ] {
            assert_eq!(call.rest(5).unwrap().call().steps(), call.call().steps() - 5);
            assert_eq!(call.rest(25), None);
        }
        assert_eq!(operator("A", GetStatus::default()).rest(0), None);
    }

    #[test]
    fn what_is_no_command_is_refused() {
        let check = |command: Value, says: &str| {
            let text = Called::parse("together", json!({ "commands": [command] })).unwrap_err().to_string();
            assert!(text.contains(says), "{text}");
        };
        check(json!({ "robot": "A", "tool": "finish", "arguments": {} }), "finish is no command");
        check(json!({ "robot": "A", "tool": "wait", "arguments": { "steps": 0 } }), "at least 1");
        check(json!({ "robot": "A" }), "arguments that work");
        let plan = json!({ "robot": "A", "tool": "send_plan", "arguments": SendPlan::example() });
        assert!(Called::parse("together", json!({ "commands": [plan] })).is_ok(), "one that was refused");
    }

    /// Every example in the contract that names a robot names A.
    #[test]
    fn operators_call_for_their_own_robots() {
        let own =
            |call: &Call, robot: &str| OperatorCall::new(robot, call.clone()).map(OperatorCall::into_call);
        for call in ToolCall::examples().into_iter().map(Call::from) {
            assert_eq!(own(&call, "A").unwrap(), call);
            let foreign = own(&call, "B");
            match call.robots().is_empty() {
                true => assert_eq!(foreign.unwrap(), call),
                false => {
                    let text = foreign.unwrap_err().to_string();
                    assert!(text.contains("\"A\"") && text.contains("yours is \"B\""), "{text}");
                }
            }
        }
        let status = operator("B", GetStatus::default());
        assert_eq!((status.robot(), status.call().robots().len()), ("B", 0));
        let all = operator("B", Observe::of_all()).into_call();
        assert_eq!(all.tool, Observe { robots: Some(vec!["B".into()]), ..Observe::of_all() }.into());
    }
}
