//! Test that one line defines a tool: a list like the real one, with a tool that exists only here.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::*;
use crate::parts::Assistance;

/// Wave with a robot's hand so many times; a tool to show what one line of the list gives, and nothing else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wave {
    /// Number of times.
    pub times: u32,
}

/// The reply to `wave`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WaveReply {
    /// True if somebody waved back.
    pub answered: bool,
}

impl Tool for Wave {
    type Reply = WaveReply;
    const NAME: &'static str = "wave";
    const READ_ONLY: bool = true;

    fn example() -> Self {
        Wave { times: 3 }
    }

    fn validate(&self) -> Result<(), String> {
        if self.times == 0 {
            return Err("times is 0; give at least 1".into());
        }
        Ok(())
    }
}

mod with_wave {
    use super::*;

    tools! {
        without_episode {
            ListTasks,
        }

        /// Asks.
        Look(LookCall) -> each LookReply {
            GetStatus,
            Wave,
        }

        /// Commands.
        Act(ActCall) -> all CommandReply {
            Wait,
        }
    }
}

#[test]
fn a_line_names_and_describes_the_tool() {
    assert_eq!(with_wave::EPISODE_TOOLS, ["get_status", "wave", "wait"]);
    assert_eq!(with_wave::LookCall::TOOLS, ["get_status", "wave"]);
    assert_eq!(with_wave::ActCall::TOOLS, ["wait"]);
    let specs = with_wave::operator_tool_specs(Assistance::Full);
    assert_eq!(specs, with_wave::tool_specs(Assistance::Full), "nobody here may talk");
    let names: Vec<_> = specs.iter().map(|spec| (spec.name, spec.on_episode)).collect();
    assert_eq!(names, [("list_tasks", false), ("get_status", true), ("wave", true), ("wait", true)]);
    let wave = &specs[2];
    assert!(wave.description.starts_with("Wave with a robot's hand"), "{}", wave.description);
    assert_eq!(wave.input_schema["required"], json!(["episode_id", "times", "short"]));
    assert_eq!(wave.reply_schema["properties"]["answered"]["type"], "boolean");
    let typed = with_wave::typed_tools();
    let [_, _, wave, wait] = &typed.tools[..] else { panic!("{:?}", typed.tools) };
    assert_eq!((wave.name, &*wave.reply, wave.on_episode), ("wave", "WaveReply", true));
    assert_eq!(wave.arguments["properties"]["times"]["type"], "integer");
    assert_eq!(typed.types["WaveReply"]["properties"]["answered"]["type"], "boolean");
    assert_eq!(wait.reply, "CommandReply");
    assert!(typed.types.contains_key("RobotReport"), "what a reply is made of");
}

#[test]
fn a_line_reads_and_checks_calls() {
    use with_wave::{LookCall, ToolCall};
    let call = ToolCall::parse("wave", json!({ "times": 2 })).unwrap();
    assert_eq!(call, ToolCall::Look(LookCall::Wave(Wave { times: 2 })));
    assert_eq!(call, Wave { times: 2 }.into());
    assert_eq!((call.name(), json!(call)), ("wave", json!({ "times": 2 })));
    assert_eq!(call.validate(), Ok(()));
    assert_eq!((call.robots().len(), call.steps()), (0, 0));
    assert_eq!(ToolCall::from(Wait { steps: 5 }).steps(), 5);
    assert!(ToolCall::examples().contains(&Wave { times: 3 }.into()));
    let refused = ToolCall::parse("wave", json!({ "times": 0 })).unwrap_err();
    assert_eq!(refused.to_string(), "wave: times is 0; give at least 1");
    assert_eq!(ToolCall::from(Wave { times: 0 }).validate(), Err(refused));
    let unknown = ToolCall::parse("nod", json!({})).unwrap_err();
    assert_eq!(unknown.to_string(), "no tool \"nod\"; have: get_status, wave, wait");
}

#[test]
fn a_line_reads_replies() {
    use with_wave::{LookReply, ToolCall, ToolReply};
    let call = ToolCall::from(Wave { times: 1 });
    let reply = call.parse_reply(json!({ "answered": true })).unwrap();
    assert_eq!(reply, ToolReply::Look(LookReply::Wave(WaveReply { answered: true })));
    assert_eq!(json!(reply), json!({ "answered": true }));
    let reply_to_a_command = json!({
        "executed_steps": 5, "stop_reason": "steps_done", "time_s": 0.1, "robots": [], "fallen": [], "phases": [],
        "budget": { "steps_left": 10, "wall_clock_left_s": null, "steps_per_command": 25 },
    });
    assert!(call.parse_reply(reply_to_a_command.clone()).is_err(), "the reply of another tool");
    match ToolCall::from(Wait { steps: 5 }).parse_reply(reply_to_a_command).unwrap() {
        ToolReply::Act(reply) => assert_eq!(reply.executed_steps, 5),
        ToolReply::Look(reply) => panic!("{reply:?} to a command"),
    }
}

#[test]
fn every_example_works_and_only_looking_promises_to_change_nothing() {
    let specs = every_tool_spec(Assistance::Full.into());
    for example in ToolCall::examples() {
        assert_eq!(ToolCall::parse(example.name(), json!(example)), Ok(example.clone()));
        let read_only = specs.iter().any(|spec| spec.name == example.name() && spec.read_only);
        match example {
            ToolCall::Look(call) => assert!(read_only, "{call:?}"),
            ToolCall::Act(call) => assert!(!read_only, "{call:?}"),
            ToolCall::Plan(call) => assert!(!read_only, "{call:?}"),
            ToolCall::Manage(_) | ToolCall::Talk(_) => {}
        }
    }
}
