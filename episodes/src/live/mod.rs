//! What those who look on see of an episode: its scene once, then steps, calls and phases as they come. Whoever plays it never learns
//! that somebody looks: a session hands over what it has made anyway, and all else is done on the onlooker's side.

mod frame;
mod geometry;
mod scene;

use std::sync::{Arc, OnceLock};

use serde_json::{Value, json};
use tandem_sim::Step;
use tandem_tools_spec::{Budget, PhaseReached, ResultReply};

use crate::commands::MotionState;
use crate::observation::Picture;
use crate::recording::{RecordedCall, ToolCallRecord};

pub use scene::LiveScene;

/// Where a session tells what happens.
pub trait Onlookers: Send {
    /// Whether anybody looks on; where nobody does, nothing is handed over.
    fn any(&self) -> bool;

    /// Must not wait for anybody.
    fn tell(&self, event: LiveEvent);
}

/// Every how many control steps onlookers get one: 25 a simulated second.
pub const STEPS_PER_FRAME: u64 = 2;

/// Something that has happened in an episode.
#[derive(Clone)]
pub enum LiveEvent {
    Step(Arc<LiveStep>),
    Call(Arc<LiveCall>),
    Phase(PhaseReached),
    /// It takes no more commands.
    Ended(Arc<ResultReply>),
}

/// A control step, and what the robots were told to do in it.
pub struct LiveStep {
    pub step: Arc<Step>,
    /// By robot.
    pub(crate) motions: Vec<MotionState>,
    pub(crate) budget: Option<Budget>,
    /// Made by the first onlooker who wants it.
    frame: OnceLock<Arc<[u8]>>,
}

impl LiveStep {
    pub(crate) fn new(step: Arc<Step>, motions: Vec<MotionState>, budget: Option<Budget>) -> LiveStep {
        LiveStep { step, motions, budget, frame: OnceLock::new() }
    }

    /// The step as [`LiveScene::frame`] has it.
    pub fn frame(&self, scene: &LiveScene) -> Arc<[u8]> {
        self.frame.get_or_init(|| scene.frame(self).into()).clone()
    }
}

/// A tool call with its answer.
pub struct LiveCall {
    /// The calls of an episode are counted from 1.
    pub number: u32,
    /// As a page reads it.
    pub told: Value,
    /// What was seen, with the name of the robot that saw it.
    pub pictures: Vec<(String, Arc<Picture>)>,
}

impl LiveCall {
    pub(crate) fn new(number: u32, record: &ToolCallRecord) -> LiveCall {
        let message = &record.message;
        let told = json!({
            "kind": "call", "number": number, "time_s": record.time_s, "thought_s": message.thought_ns as f64 / 1e9,
            "tool": message.tool, "arguments": message.arguments, "operator": message.operator, "ok": message.ok,
            "reply": message.reply,
        });
        LiveCall { number, told, pictures: record.pictures.clone() }
    }

    /// The call for who comes later: a picture is seen when it is made.
    pub(crate) fn without_pictures(&self) -> LiveCall {
        LiveCall { number: self.number, told: self.told.clone(), pictures: Vec::new() }
    }

    /// A call of a recording, as a page reads it.
    pub fn of_recorded(number: u32, call: &RecordedCall) -> Value {
        let (ok, reply) = match &call.outcome {
            Ok(reply) => (true, reply),
            Err(problem) => (false, problem),
        };
        json!({
            "kind": "call", "number": number, "time_s": call.time_s, "thought_s": call.thought.as_secs_f64(),
            "tool": call.tool, "arguments": call.arguments.to_string(), "operator": call.operator, "ok": ok,
            "reply": reply,
        })
    }
}

/// An episode as it stands when somebody begins to look on.
pub struct LiveView {
    pub scene: Arc<LiveScene>,
    pub now: Arc<LiveStep>,
    /// Its latest calls, the oldest first.
    pub calls: Vec<Arc<LiveCall>>,
    pub phases: Vec<PhaseReached>,
    /// What it came to, if it has ended.
    pub result: Option<ResultReply>,
}
