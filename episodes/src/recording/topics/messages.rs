//! Messages that have no well-known schema. They are flat JSON objects, because Foxglove's plots address
//! numbers by field name and its schema reader supports neither references nor nullable types.

use std::sync::Arc;
use std::time::Duration;

use base64::{DecodeError, Engine, prelude::BASE64_STANDARD};
use foxglove::{Encode, Schema, bytes::BufMut};
use schemars::{JsonSchema, generate::SchemaSettings};
use serde::{Deserialize, Serialize};
use tandem_sim::{BaseCommand, MotorSetpoints, RobotCommand, RobotStep, Side, Step};
use tandem_tools_spec::{Budget, ExtraInformation, PhaseReached, ToolReply};

use crate::commands::{Called, base_row, drive_row};
use crate::observation::{Picture, TeamObservation};
use crate::output::OutputError;
use crate::scoring::{Facts, Grip};

/// A message written as JSON.
pub struct Json<T>(pub T);

/// A type that has a schema in the recording.
pub trait JsonMessage: Serialize + JsonSchema {
    const SCHEMA_NAME: &str;
}

impl<T: JsonMessage> Encode for Json<T> {
    type Error = serde_json::Error;

    fn get_schema() -> Option<Schema> {
        let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
        let schema = settings.into_generator().into_root_schema_for::<T>().to_value().to_string();
        Some(Schema::new(T::SCHEMA_NAME, "jsonschema", schema.into_bytes()))
    }

    fn get_message_encoding() -> String {
        "json".into()
    }

    fn encode(&self, buffer: &mut impl BufMut) -> Result<(), serde_json::Error> {
        serde_json::to_writer(buffer.writer(), &self.0)
    }
}

/// Formats the hash of a state.
pub fn state_hash_text(state_hash: u64) -> String {
    format!("{state_hash:016x}")
}

/// A control step as in recordings of earlier versions; [`super::steps`] replaces it.
#[derive(Deserialize)]
pub struct StepMessage {
    control_step: u64,
    /// Hash of the whole state that determines the future, which is more than the step shows; 16 hexadecimal
    /// digits.
    state_hash: String,
    /// [`Step`] in postcard's encoding, base64.
    postcard: String,
}

/// Reason why a message has no readable [`Step`].
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    #[error("no base64: {0}")]
    Base64(#[from] DecodeError),
    #[error("not a step of this build: {0}")]
    Postcard(#[from] postcard::Error),
    #[error("not a step as JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error("a step is cut short, or of a later version of Tandem")]
    Cut,
    #[error("a step before it cannot be read")]
    Lost,
}

impl StepMessage {
    pub fn step(&self) -> Result<Step, StepError> {
        Ok(postcard::from_bytes(&BASE64_STANDARD.decode(&self.postcard)?)?)
    }

    /// Returns the number of the step, and the hash of the state after it.
    pub fn state(self) -> (u64, String) {
        (self.control_step, self.state_hash)
    }
}

/// Command of one robot for one control step, 35 numbers; the channel's metadata names the columns.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Action")]
pub struct ActionMessage {
    row: Vec<f32>,
}

impl JsonMessage for ActionMessage {
    const SCHEMA_NAME: &str = "tandem.Action";
}

impl From<&RobotCommand> for Json<ActionMessage> {
    fn from(command: &RobotCommand) -> Self {
        Json(ActionMessage { row: command.upper_rad.into_iter().chain(base_row(&command.base)).collect() })
    }
}

/// Setpoints of one robot's motors in one control step: a row of `send_joint_drives`, or one for each
/// physics step. The action of such a step is the posture that the robot had.
#[derive(Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "MotorSetpoints")]
pub struct SetpointsMessage {
    pub rows: Vec<Vec<f32>>,
}

impl JsonMessage for SetpointsMessage {
    const SCHEMA_NAME: &str = "tandem.MotorSetpoints";
}

impl From<&[MotorSetpoints]> for Json<SetpointsMessage> {
    fn from(setpoints: &[MotorSetpoints]) -> Self {
        let rows = setpoints.iter().map(|setpoints| drive_row(setpoints).collect());
        Json(SetpointsMessage { rows: rows.collect() })
    }
}

/// The base command alone, with a name for each number.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Base")]
pub struct BaseCommandMessage {
    vx_m_s: f32,
    vy_m_s: f32,
    yaw_rate_rad_s: f32,
    pelvis_height_m: f32,
}

impl JsonMessage for BaseCommandMessage {
    const SCHEMA_NAME: &str = "tandem.BaseCommand";
}

impl From<&RobotCommand> for Json<BaseCommandMessage> {
    fn from(command: &RobotCommand) -> Self {
        let BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m } = command.base;
        Json(BaseCommandMessage { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m })
    }
}

/// Hands of a robot: forces of the world on them (world frame), estimated from the arms' torques, and objects
/// that they hold or touch.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Hands")]
pub struct HandsMessage {
    left_force_n: [f32; 3],
    right_force_n: [f32; 3],
    left_holds: Vec<String>,
    right_holds: Vec<String>,
    left_touches: Vec<String>,
    right_touches: Vec<String>,
}

impl JsonMessage for HandsMessage {
    const SCHEMA_NAME: &str = "tandem.Hands";
}

impl HandsMessage {
    /// Returns the message on the hands of robot number `robot`, from its step `moved` and the scoring's
    /// `facts`.
    pub fn of(moved: &RobotStep, robot: usize, facts: &Facts) -> Json<HandsMessage> {
        let felt_n = moved.hand_force_in_world_n().map(|force_n| force_n.to_array());
        let named = |side: Side, wanted: Grip| {
            let objects = facts.objects.iter().filter(|object| object.hands[robot][side] == wanted);
            objects.map(|object| object.name.clone()).collect()
        };
        Json(HandsMessage {
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
#[derive(Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Phase")]
pub struct PhaseMessage {
    pub id: String,
    pub number: String,
    pub time_s: f64,
}

impl JsonMessage for PhaseMessage {
    const SCHEMA_NAME: &str = "tandem.Phase";
}

impl From<&PhaseReached> for Json<PhaseMessage> {
    fn from(phase: &PhaseReached) -> Self {
        Json(PhaseMessage { id: phase.id.clone(), number: phase.number.clone(), time_s: phase.time_s })
    }
}

/// Remaining budget of the episode.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "BudgetLeft")]
pub struct BudgetMessage {
    steps_left: u32,
    /// Absent where the protocol sets no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64")]
    wall_clock_left_s: Option<f64>,
}

impl JsonMessage for BudgetMessage {
    const SCHEMA_NAME: &str = "tandem.Budget";
}

impl From<&Budget> for Json<BudgetMessage> {
    fn from(budget: &Budget) -> Self {
        Json(BudgetMessage { steps_left: budget.steps_left, wall_clock_left_s: budget.wall_clock_left_s })
    }
}

/// Outcome of a tool call.
pub enum CallOutcome<'a> {
    Reply(&'a ToolReply),
    Observation(&'a TeamObservation),
    /// The text of the problem.
    Problem(String),
}

impl<'a> CallOutcome<'a> {
    /// Returns the outcome of a call with this answer.
    pub fn of<T, E: ToString>(answer: &'a Result<T, E>) -> CallOutcome<'a>
    where
        &'a T: Into<CallOutcome<'a>>,
    {
        answer.as_ref().map_or_else(CallOutcome::refused, Into::into)
    }

    /// Returns the outcome of a call that was refused or failed.
    pub fn refused(error: &impl ToString) -> CallOutcome<'a> {
        CallOutcome::Problem(error.to_string())
    }

    /// Returns `true` if the call was answered.
    pub fn is_ok(&self) -> bool {
        !matches!(self, CallOutcome::Problem(_))
    }

    /// Returns the outcome as text. Images have separate topics, and would make this one unreadable.
    fn text(&self) -> Result<String, serde_json::Error> {
        match self {
            CallOutcome::Reply(reply) => serde_json::to_string(reply),
            CallOutcome::Observation(seen) => {
                let states: Vec<_> = seen.robots.iter().map(|robot| &robot.state).collect();
                let robots: Vec<_> = states.iter().map(|state| state.robot.as_str()).collect();
                let states = serde_json::to_value(&states)?;
                let told =
                    serde_json::json!({ "time_s": seen.time_s, "states": states, "pictures_of": robots });
                Ok(told.to_string())
            }
            CallOutcome::Problem(problem) => Ok(problem.clone()),
        }
    }

    /// Returns the images of an observation, by robot.
    fn pictures(&self) -> Vec<(String, Arc<Picture>)> {
        match self {
            CallOutcome::Observation(seen) => {
                let seen = seen.robots.iter();
                seen.map(|robot| (robot.state.robot.clone(), robot.view.picture.clone())).collect()
            }
            CallOutcome::Reply(_) | CallOutcome::Problem(_) => Vec::new(),
        }
    }
}

impl<'a> From<&'a TeamObservation> for CallOutcome<'a> {
    fn from(seen: &'a TeamObservation) -> CallOutcome<'a> {
        CallOutcome::Observation(seen)
    }
}

/// Origin of a call, and the information that it was shown.
#[derive(Clone, Copy)]
pub enum CallerRecord<'a> {
    /// The policy that directs all robots. It is shown the reply.
    Policy,
    /// The operator of this robot, which is shown the reply.
    Operator(&'a str),
    /// A caller that executes the decisions of a policy in this process. The policy itself is shown this
    /// information about every observed robot, which the benchmark withholds from its policies.
    InProcess(&'a [ExtraInformation]),
}

impl<'a> CallerRecord<'a> {
    /// Returns the robot whose operator made the call.
    pub fn operator(self) -> Option<&'a str> {
        match self {
            CallerRecord::Operator(robot) => Some(robot),
            CallerRecord::Policy | CallerRecord::InProcess(_) => None,
        }
    }

    /// Returns the extra information that was shown; see [`RecordedCall::shown`](crate::RecordedCall).
    fn shown(self) -> Option<&'a [ExtraInformation]> {
        match self {
            CallerRecord::Policy | CallerRecord::Operator(_) => None,
            CallerRecord::InProcess(shown) => Some(shown),
        }
    }
}

/// Moment of a call or note in an episode.
#[derive(Clone, Copy, Debug)]
pub struct CallMoment {
    pub time_s: f64,
    /// Number of control steps before the call.
    pub control_step: u64,
    /// The policy's thinking time since the episode began.
    pub thought: Duration,
}

impl CallMoment {
    pub fn thought_ns(&self) -> u64 {
        u64::try_from(self.thought.as_nanos()).unwrap_or(u64::MAX)
    }
}

/// Maximum length of the recorded arguments of a call that was refused before it reached the episode. A
/// caller may send anything.
const MAX_UNREAD_BYTES: usize = 10_000;
/// Maximum length of the recorded name of a tool that may not exist.
const MAX_NAME_BYTES: usize = 100;

/// Returns the beginning of a text that is too long; `None` if it is short enough.
fn beginning(text: &str, most_bytes: usize) -> Option<&str> {
    let cut = (text.len() > most_bytes).then(|| text.floor_char_boundary(most_bytes))?;
    Some(&text[..cut])
}

/// A recorded tool call: the call with its reply, and the reply's images, which have their own topics.
pub struct ToolCallRecord {
    /// Simulated time of the reply.
    pub time_s: f64,
    pub message: ToolCallMessage,
    /// Images that were shown, with the name of the robot that saw them.
    pub pictures: Vec<(String, Arc<Picture>)>,
}

impl ToolCallRecord {
    /// Creates the record of a call, its caller and its outcome.
    pub fn new(
        at: CallMoment,
        caller: CallerRecord,
        called: &Called,
        outcome: CallOutcome,
    ) -> Result<ToolCallRecord, OutputError> {
        let pictures = outcome.pictures();
        let shown = |(robot, picture): &(String, Arc<Picture>)| ShownPicture {
            robot: robot.clone(),
            width: picture.width,
            height: picture.height,
        };
        let message = ToolCallMessage {
            tool: called.name().into(),
            control_step: at.control_step,
            thought_ns: at.thought_ns(),
            arguments: called.arguments()?,
            operator: caller.operator().map(str::to_owned),
            shown: caller.shown().map(|shown| shown.iter().map(|what| what.name().into()).collect()),
            counted: true,
            ok: outcome.is_ok(),
            reply: outcome.text()?,
            pictures: pictures.iter().map(shown).collect(),
        };
        Ok(ToolCallRecord { time_s: at.time_s, message, pictures })
    }

    /// Creates the record of a request that is no call of the episode, with its raw arguments. This is a
    /// plan, or a call that was refused before it reached the episode.
    pub fn beside(
        at: CallMoment,
        caller: CallerRecord,
        tool: &str,
        arguments: &str,
        outcome: Result<&str, &str>,
    ) -> Result<ToolCallRecord, OutputError> {
        let is_json = serde_json::from_str::<serde::de::IgnoredAny>(arguments).is_ok();
        let arguments = match beginning(arguments, MAX_UNREAD_BYTES) {
            Some(beginning) => serde_json::to_string(&format!("{beginning}... ({} bytes)", arguments.len()))?,
            None if is_json => arguments.to_owned(),
            None => serde_json::to_string(arguments)?,
        };
        let message = ToolCallMessage {
            tool: beginning(tool, MAX_NAME_BYTES).unwrap_or(tool).into(),
            control_step: at.control_step,
            thought_ns: at.thought_ns(),
            arguments,
            operator: caller.operator().map(str::to_owned),
            shown: None,
            counted: false,
            ok: outcome.is_ok(),
            reply: outcome.unwrap_or_else(|problem| problem).into(),
            pictures: Vec::new(),
        };
        Ok(ToolCallRecord { time_s: at.time_s, message, pictures: Vec::new() })
    }
}

/// An image shown by a call: the robot's camera after the call's control steps, stored in the camera's topic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShownPicture {
    pub robot: String,
    pub width: u32,
    pub height: u32,
}

fn counted() -> bool {
    true
}

/// A tool call and its answer. Arguments and reply are JSON texts, since they differ between tools.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ToolCallMessage {
    pub tool: String,
    /// Number of control steps before the reply.
    #[serde(default)]
    pub control_step: u64,
    /// Thinking time of the policy since the episode began, including that before this call.
    pub thought_ns: u64,
    pub arguments: String,
    /// The robot whose operator made the call; absent if one policy directs all robots.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub operator: Option<String>,
    /// Information shown to a policy in the simulator's process that the benchmark withholds; absent if the
    /// policy was shown the whole reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Vec<String>")]
    pub shown: Option<Vec<String>>,
    /// True for a call of the episode, which counts and which a replay repeats. False for a call refused
    /// before it reached the episode, and for a plan, which follows its commands.
    #[serde(default = "counted")]
    pub counted: bool,
    pub ok: bool,
    /// The reply without images, or the text of the problem.
    pub reply: String,
    /// Images shown, one for each robot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pictures: Vec<ShownPicture>,
}

impl JsonMessage for ToolCallMessage {
    const SCHEMA_NAME: &str = "tandem.ToolCall";
}
