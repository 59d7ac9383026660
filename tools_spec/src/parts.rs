//! What several replies share: poses, budgets, phases, pictures and the report on a command.

use base64::{Engine, prelude::BASE64_STANDARD};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::Error as _};
use serde_json::{Map, Value};

/// The rules an episode is run under.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Protocol {
    /// For agents that think between commands: at most 25 steps a command, 6000 steps of which 300 are an initial hold,
    /// and 1800 s of the policy's own time.
    Agentic,
    /// For learned policies: at most 50 steps a command, and the task's own number of steps.
    Benchmark,
}

impl Protocol {
    /// Every protocol.
    pub const ALL: [Protocol; 2] = [Protocol::Agentic, Protocol::Benchmark];

    /// As requests and results write it.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Agentic => "agentic",
            Protocol::Benchmark => "benchmark",
        }
    }
}

/// A pose in the frame that the field which holds it names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pose {
    /// [x, y, z] in metres.
    pub position_m: [f64; 3],
    /// [w, x, y, z], norm 1.
    pub quaternion_wxyz: [f64; 4],
}

/// What is left of the episode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Budget {
    /// Control steps of 20 ms.
    pub steps_left: u32,
    /// Seconds that the policy may still spend between calls; the simulator's own time is not counted. Null where the
    /// protocol sets no limit.
    pub wall_clock_left_s: Option<f64>,
    /// The most steps that one command may ask for.
    pub steps_per_command: u32,
}

/// A phase of the task, and when it was reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PhaseReached {
    /// `p1`, `p2`, ... in the order they have to be reached.
    pub id: String,
    /// What the phase is called, as `grasp_and_lift`.
    pub name: String,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
}

/// Why a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// Every step that was asked for was executed.
    StepsDone,
    /// The last phase of the task was reached; the episode has ended.
    TaskComplete,
    /// The episode's steps ran out; the episode has ended.
    StepBudgetExhausted,
}

/// How one hand did under a command, at its last step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HandReport {
    /// The wrist pose that was asked for, in the pelvis frame; after a joint chunk, the pose its last row stands for.
    pub target: Pose,
    /// The wrist pose that was measured, in the pelvis frame.
    pub measured: Pose,
    /// Distance from target to measured, in metres.
    pub position_error_m: f64,
    /// Angle from target to measured, in radians.
    pub orientation_error_rad: f64,
    /// Joints of this arm and hand whose target lay beyond a limit and was moved to it.
    pub joints_clamped: Vec<String>,
    /// Joints of this arm and hand that rest at a limit.
    pub joints_at_limit: Vec<String>,
}

/// How one robot did under a command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotReport {
    /// The robot, as "A".
    pub robot: String,
    /// Its left arm and hand.
    pub left: HandReport,
    /// Its right arm and hand.
    pub right: HandReport,
    /// Waist joints whose target lay beyond a limit and was moved to it.
    pub waist_joints_clamped: Vec<String>,
    /// Waist joints that rest at a limit.
    pub waist_joints_at_limit: Vec<String>,
    /// Fields of the base command that lay beyond what locomotion accepts and were moved to it, as `vx_m_s`.
    pub base_command_clamped: Vec<String>,
}

/// Whether a robot has fallen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotFallen {
    /// The robot, as "A".
    pub robot: String,
    /// True from the moment it fell.
    pub fallen: bool,
}

/// The reply to every command: `move_wrists`, `walk`, `send_joint_chunk` and `wait`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CommandReply {
    /// Control steps of 20 ms that were executed.
    pub executed_steps: u32,
    /// Why the command ended.
    pub stop_reason: StopReason,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// One report per robot that the command named.
    pub robots: Vec<RobotReport>,
    /// Every robot of the episode.
    pub fallen: Vec<RobotFallen>,
    /// Every phase reached so far.
    pub phases: Vec<PhaseReached>,
    /// What is left of the episode.
    pub budget: Budget,
}

/// One number per joint, in the robot's published joint order; JSON object from joint name to number. JSON carries them
/// to six decimals: the drives measure no finer, and a model reads a third of the text.
#[derive(Debug, Clone, PartialEq)]
pub struct JointValues(pub Vec<(String, f64)>);

impl JointValues {
    /// The value of one joint.
    pub fn get(&self, joint: &str) -> Option<f64> {
        self.0.iter().find(|(name, _)| name == joint).map(|(_, value)| *value)
    }
}

impl Serialize for JointValues {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // Adding zero makes the zero of tiny negative values a positive one.
        let rounded = |value: f64| (value * 1e6).round() / 1e6 + 0.0;
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, rounded(*value))))
    }
}

impl<'de> Deserialize<'de> for JointValues {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let object = Map::<String, Value>::deserialize(deserializer)?;
        let number = |(name, value): (String, Value)| match value.as_f64() {
            Some(value) => Ok((name, value)),
            None => Err(D::Error::custom(format!("joint {name} holds {value}; expected a number"))),
        };
        object.into_iter().map(number).collect::<Result<_, _>>().map(JointValues)
    }
}

impl JsonSchema for JointValues {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "JointValues".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "object", "additionalProperties": { "type": "number" } })
    }
}

/// A PNG file; base64 in JSON.
#[derive(Debug, Clone, PartialEq)]
pub struct Png(pub Vec<u8>);

impl Png {
    /// The file as base64, as JSON and MCP carry it.
    pub fn to_base64(&self) -> String {
        BASE64_STANDARD.encode(&self.0)
    }
}

impl Serialize for Png {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.to_base64())
    }
}

impl<'de> Deserialize<'de> for Png {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        BASE64_STANDARD.decode(String::deserialize(deserializer)?).map(Png).map_err(D::Error::custom)
    }
}

impl JsonSchema for Png {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Png".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "contentEncoding": "base64", "contentMediaType": "image/png" })
    }
}
