//! What is called on an episode: a tool, or what operators with a robot each do together. It is what a recording holds and a replay
//! calls again.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use tandem_tools_spec::{ActCall, Formats, Look, Observe, Say, SpecError, Tool, ToolCall, parse_args};

use super::own::own;
use super::{Command, Motion, find};
use crate::EpisodeError;
use crate::protocol::Rules;

/// A call on an episode.
#[derive(Clone, Debug, PartialEq)]
pub enum Called {
    /// One of the tools.
    Tool(ToolCall),
    /// A look whose pictures come in another form than that of PNGs.
    Look(Look),
    /// Commands of several operators, executed side by side for as long as the shortest of them; robots without one hold still.
    Together(Vec<OperatorCommand>),
    /// Words of an operator to the others.
    Say(Say),
}

/// The command of an operator to its own robot.
#[derive(Clone, Debug, PartialEq)]
pub struct OperatorCommand {
    pub robot: String,
    pub call: ActCall,
}

/// Arguments of [`Called::Together`] as a recording has them.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    commands: Vec<WrittenCommand>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenCommand {
    robot: String,
    tool: String,
    arguments: Value,
}

impl Called {
    /// What recordings call commands of several operators.
    pub const TOGETHER: &str = "together";

    /// The tool's name, or what stands for it.
    pub fn name(&self) -> &'static str {
        match self {
            Called::Tool(call) => call.name(),
            Called::Look(_) => Observe::NAME,
            Called::Together(_) => Called::TOGETHER,
            Called::Say(_) => Say::NAME,
        }
    }

    /// A look in whatever form.
    pub fn look(look: Look) -> Called {
        match look.formats == Formats::default() {
            true => Called::Tool(look.call()),
            false => Called::Look(look),
        }
    }

    /// What [`Called::parse`] reads.
    pub fn arguments(&self) -> Result<String, serde_json::Error> {
        match self {
            Called::Tool(call) => serde_json::to_string(call),
            Called::Look(look) => serde_json::to_string(look),
            Called::Together(commands) => {
                let commands = commands.iter().map(OperatorCommand::written).collect::<Result<_, _>>()?;
                serde_json::to_string(&Written { commands })
            }
            Called::Say(say) => serde_json::to_string(say),
        }
    }

    /// Reads what a recording holds of a call.
    pub fn parse(name: &str, arguments: Value) -> Result<Called, SpecError> {
        match name {
            Called::TOGETHER => {
                let malformed = |error: serde_json::Error| SpecError::Malformed {
                    tool: Called::TOGETHER,
                    place: String::new(),
                    reason: error.to_string(),
                    example: r#"{"commands":[{"robot":"A","tool":"wait","arguments":{"steps":25}}]}"#.into(),
                };
                let written: Written = serde_json::from_value(arguments).map_err(malformed)?;
                let commands = written.commands.into_iter().map(OperatorCommand::parse);
                Ok(Called::Together(commands.collect::<Result<_, _>>()?))
            }
            Say::NAME => parse_args(arguments).map(Called::Say),
            Observe::NAME => Look::parse(arguments).map(Called::look),
            _ => ToolCall::parse(name, arguments).map(Called::Tool),
        }
    }

    /// Checks what was built in Rust rather than read from JSON.
    pub fn validate(&self) -> Result<(), SpecError> {
        match self {
            Called::Tool(call) => call.validate(),
            Called::Look(look) => look.call().validate(),
            Called::Together(commands) => {
                commands.iter().try_for_each(|command| ToolCall::Act(command.call.clone()).validate())
            }
            Called::Say(say) => {
                say.validate().map_err(|reason| SpecError::Invalid { tool: Say::NAME, reason })
            }
        }
    }
}

impl From<ToolCall> for Called {
    fn from(call: ToolCall) -> Called {
        Called::Tool(call)
    }
}

impl OperatorCommand {
    /// Control steps that it asks for.
    pub fn asked_steps(&self) -> u32 {
        match &self.call {
            ActCall::MoveWrists(args) => args.steps,
            ActCall::Walk(args) => args.steps,
            ActCall::SendJointChunk(args) => args.robots.first().map_or(0, |chunk| chunk.rows.len() as u32),
            ActCall::Wait(args) => args.steps,
        }
    }

    /// Reads it for the robots that `motions` move: the operator's own, by its index, and what all would do if nobody else
    /// commanded.
    pub fn read(&self, rules: &Rules, motions: &[Motion]) -> Result<(usize, Command), EpisodeError> {
        own(ToolCall::Act(self.call.clone()), &self.robot)?;
        Ok((find(&self.robot, motions)?, Command::read(&self.call, rules, motions)?))
    }

    fn written(&self) -> Result<WrittenCommand, serde_json::Error> {
        let call = ToolCall::Act(self.call.clone());
        Ok(WrittenCommand {
            robot: self.robot.clone(),
            tool: call.name().into(),
            arguments: serde_json::to_value(&call)?,
        })
    }

    fn parse(written: WrittenCommand) -> Result<OperatorCommand, SpecError> {
        match ToolCall::parse(&written.tool, written.arguments)? {
            ToolCall::Act(call) => Ok(OperatorCommand { robot: written.robot, call }),
            other => Err(SpecError::Invalid {
                tool: Called::TOGETHER,
                reason: format!("{} is no command; operators command by move_wrists and such", other.name()),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use tandem_tools_spec::{Wait, Walk};

    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let walk = match Walk::example().into() {
            ToolCall::Act(call) => OperatorCommand { robot: "A".into(), call },
            other => panic!("{other:?} is no command"),
        };
        let wait = OperatorCommand { robot: "B".into(), call: ActCall::Wait(Wait { steps: 5 }) };
        assert_eq!((walk.asked_steps(), wait.asked_steps()), (25, 5));
        for called in [
            Called::Together(vec![walk, wait]),
            Called::Say(Say { text: "Ready.".into() }),
            Called::from(ToolCall::from(Wait { steps: 3 })),
        ] {
            let arguments = serde_json::from_str(&called.arguments().unwrap()).unwrap();
            assert_eq!(Called::parse(called.name(), arguments), Ok(called));
        }
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
    }
}
