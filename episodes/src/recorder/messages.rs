//! Messages that have no well-known schema: flat JSON objects, because Foxglove's plots address numbers by field name and
//! its schema reader takes neither references nor nullable types.

use foxglove::{Encode, Schema, bytes::BufMut};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use tandem_sim::{BaseCommand, RobotCommand, Side};
use tandem_tools_spec::{Budget, PhaseReached, ToolReply};

use super::{RobotStep, ToolCallRecord};
use crate::facts::Grip;
use crate::results::OutputError;

/// A message written as JSON.
pub struct Json<T>(pub T);

/// A type that has a schema of its own in the recording.
pub trait JsonMessage: Serialize + JsonSchema {
    const SCHEMA_NAME: &str;
}

impl<T: JsonMessage> Encode for Json<T> {
    type Error = serde_json::Error;

    fn get_schema() -> Option<Schema> {
        let schema = schemars::schema_for!(T).to_value().to_string();
        Some(Schema::new(T::SCHEMA_NAME, "jsonschema", schema.into_bytes()))
    }

    fn get_message_encoding() -> String {
        "json".into()
    }

    fn encode(&self, buffer: &mut impl BufMut) -> Result<(), serde_json::Error> {
        serde_json::to_writer(buffer.writer(), &self.0)
    }
}

/// The 35 numbers one robot was commanded for one control step; the channel's metadata names the columns.
#[derive(Serialize, JsonSchema)]
pub struct Action {
    row: Vec<f32>,
}

impl JsonMessage for Action {
    const SCHEMA_NAME: &str = "tandem.Action";
}

impl From<&RobotCommand> for Json<Action> {
    fn from(command: &RobotCommand) -> Self {
        let BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m } = command.base;
        let base = [vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m];
        Json(Action { row: command.upper_rad.into_iter().chain(base).collect() })
    }
}

/// The base command alone, with a name for each number.
#[derive(Serialize, JsonSchema)]
pub struct Base {
    vx_m_s: f32,
    vy_m_s: f32,
    yaw_rate_rad_s: f32,
    pelvis_height_m: f32,
}

impl JsonMessage for Base {
    const SCHEMA_NAME: &str = "tandem.BaseCommand";
}

impl From<&RobotCommand> for Json<Base> {
    fn from(command: &RobotCommand) -> Self {
        let BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m } = command.base;
        Json(Base { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m })
    }
}

/// What a robot's hands feel and hold: forces of the world on them (world frame), estimated from the arms' torques.
#[derive(Serialize, JsonSchema)]
pub struct Hands {
    left_force_n: [f32; 3],
    right_force_n: [f32; 3],
    left_holds: Vec<String>,
    right_holds: Vec<String>,
    left_touches: Vec<String>,
    right_touches: Vec<String>,
}

impl JsonMessage for Hands {
    const SCHEMA_NAME: &str = "tandem.Hands";
}

impl From<&RobotStep> for Json<Hands> {
    fn from(step: &RobotStep) -> Self {
        let felt_n = step.state.hand_force_n.map(|force_n| force_n.to_array());
        let named = |side: Side, wanted: Grip| {
            let grips = step.grips.iter().filter(|(_, grips)| grips[side.index()] == wanted);
            grips.map(|(object, _)| object.clone()).collect()
        };
        Json(Hands {
            left_force_n: felt_n.left,
            right_force_n: felt_n.right,
            left_holds: named(Side::Left, Grip::Holding),
            right_holds: named(Side::Right, Grip::Holding),
            left_touches: named(Side::Left, Grip::Touching),
            right_touches: named(Side::Right, Grip::Touching),
        })
    }
}

/// A phase that was reached.
#[derive(Serialize, JsonSchema)]
pub struct Phase {
    id: String,
    name: String,
    time_s: f64,
}

impl JsonMessage for Phase {
    const SCHEMA_NAME: &str = "tandem.Phase";
}

impl From<&PhaseReached> for Json<Phase> {
    fn from(phase: &PhaseReached) -> Self {
        Json(Phase { id: phase.id.clone(), name: phase.name.clone(), time_s: phase.time_s })
    }
}

/// What is left of the episode.
#[derive(Serialize, JsonSchema)]
pub struct BudgetLeft {
    steps_left: u32,
    /// Absent where the protocol sets no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64")]
    wall_clock_left_s: Option<f64>,
}

impl JsonMessage for BudgetLeft {
    const SCHEMA_NAME: &str = "tandem.Budget";
}

impl From<&Budget> for Json<BudgetLeft> {
    fn from(budget: &Budget) -> Self {
        Json(BudgetLeft { steps_left: budget.steps_left, wall_clock_left_s: budget.wall_clock_left_s })
    }
}

/// A tool call and its answer. Arguments and reply are JSON texts, since every tool has others.
#[derive(Serialize, JsonSchema)]
pub struct ToolCallMessage {
    tool: String,
    arguments: String,
    ok: bool,
    /// The reply without pictures, or the text of the problem.
    reply: String,
}

impl JsonMessage for ToolCallMessage {
    const SCHEMA_NAME: &str = "tandem.ToolCall";
}

impl ToolCallMessage {
    pub fn new(record: &ToolCallRecord) -> Result<Json<Self>, OutputError> {
        let (ok, reply) = match record.outcome {
            Ok(reply) => (true, without_pictures(reply)?.to_string()),
            Err(problem) => (false, problem.to_string()),
        };
        let arguments = serde_json::to_string(record.call)?;
        Ok(Json(ToolCallMessage { tool: record.call.name().into(), arguments, ok, reply }))
    }
}

/// A reply as JSON. Pictures have a topic of their own and would make this one unreadable.
fn without_pictures(reply: &ToolReply) -> Result<Value, serde_json::Error> {
    match reply {
        ToolReply::Observation(observation) => {
            let states = serde_json::to_value(&observation.states)?;
            let robots: Vec<&str> = observation.images.iter().map(|image| image.robot.as_str()).collect();
            Ok(serde_json::json!({ "time_s": observation.time_s, "states": states, "pictures_of": robots }))
        }
        other => serde_json::to_value(other),
    }
}
