//! The live view of an episode: its scene once, then steps, calls and phases as they occur. Viewers do
//! not affect the episode. A session passes on data that it has computed anyway; all other work is done
//! on the viewer's side.

mod frame;
mod geometry;
mod light;
mod scene;
mod textures;

use std::sync::{Arc, OnceLock};

use serde_json::{Value, json};
use tandem_sim::Step;
use tandem_tools_spec::{Budget, NextPhase, PhaseReached, ResultReply};

use crate::commands::MotionState;
use crate::observation::Picture;
use crate::recording::{NoteMessage, ToolCallMessage, ToolCallRecord, TranscriptEntry};

pub use scene::LiveScene;
pub(crate) use textures::SceneTextures;
pub use textures::{ImageFile, LiveTexture};

/// Receiver of a session's events.
pub trait Onlookers: Send {
    /// Returns true while there are viewers; without them, no events are sent.
    fn any(&self) -> bool;

    /// Returns true if viewers want the control step with this number, which has just been made. The last
    /// step of a call is always sent.
    fn wants_step(&self, control_step: u64) -> bool;

    /// Sends an event to the viewers. Must not block.
    fn tell(&self, event: LiveEvent);
}

/// Control steps between two frames of the live view, which has 25 frames a simulated second.
pub const STEPS_PER_FRAME: u64 = 2;
/// Control steps between two messages on the next phase.
pub(crate) const STEPS_PER_EXPLANATION: u64 = 50;

/// An event of an episode.
#[derive(Clone)]
pub enum LiveEvent {
    Step(Arc<LiveStep>),
    /// A tool call with its reply, or a note.
    Entry(Arc<LiveEntry>),
    Phase(PhaseReached),
    /// The next phase, and its conditions that do not hold.
    NextPhase(Arc<NextPhase>),
    /// The result. The episode takes no more commands.
    Ended(Arc<ResultReply>),
}

/// A control step, and the motions commanded in it.
pub struct LiveStep {
    pub step: Arc<Step>,
    /// Motion of each robot.
    pub(crate) motions: Vec<MotionState>,
    pub(crate) budget: Option<Budget>,
    /// Computed on the first request.
    frame: OnceLock<Arc<[u8]>>,
}

impl LiveStep {
    pub(crate) fn new(step: Arc<Step>, motions: Vec<MotionState>, budget: Option<Budget>) -> LiveStep {
        LiveStep { step, motions, budget, frame: OnceLock::new() }
    }

    /// Returns the frame of the step, as [`LiveScene::frame`] encodes it.
    pub fn frame(&self, scene: &LiveScene) -> Arc<[u8]> {
        self.frame.get_or_init(|| scene.frame(self).into()).clone()
    }
}

/// A tool call with its reply, or a note.
pub struct LiveEntry {
    /// Number of the entry in its episode, counted from 1.
    pub entry: u32,
    /// Entry in JSON, for pages.
    pub told: Value,
    /// Images returned by the call, with the name of the robot.
    pub pictures: Vec<(String, Arc<Picture>)>,
}

impl LiveEntry {
    /// Returns the entry of a call. `number` is set for counted calls.
    pub(crate) fn of_call(entry: u32, number: Option<u32>, record: &ToolCallRecord) -> LiveEntry {
        let told = told_call(entry, number, record.time_s, &record.message);
        LiveEntry { entry, told, pictures: record.pictures.clone() }
    }

    pub(crate) fn of_note(entry: u32, time_s: f64, note: &NoteMessage) -> LiveEntry {
        LiveEntry { entry, told: told_note(entry, time_s, note), pictures: Vec::new() }
    }

    /// Returns the entry without its images, for viewers that connect later.
    pub(crate) fn without_pictures(&self) -> LiveEntry {
        LiveEntry { entry: self.entry, told: self.told.clone(), pictures: Vec::new() }
    }
}

/// Converts a transcript to JSON, for pages.
pub(crate) fn told_transcript(transcript: &[TranscriptEntry]) -> Vec<Value> {
    let told = |(entry, told): (u32, &TranscriptEntry)| match told {
        TranscriptEntry::Call { number, time_s, call } => told_call(entry, *number, *time_s, call),
        TranscriptEntry::Note { time_s, note } => told_note(entry, *time_s, note),
    };
    (1..).zip(transcript).map(told).collect()
}

fn told_call(entry: u32, number: Option<u32>, time_s: f64, call: &ToolCallMessage) -> Value {
    let seen: Vec<&str> = call.pictures.iter().map(|picture| picture.robot.as_str()).collect();
    json!({
        "kind": "call", "entry": entry, "number": number, "time_s": time_s, "step": call.control_step,
        "thought_s": call.thought_ns as f64 / 1e9, "tool": call.tool, "arguments": call.arguments,
        "operator": call.operator, "ok": call.ok, "reply": call.reply, "seen": seen,
    })
}

fn told_note(entry: u32, time_s: f64, note: &NoteMessage) -> Value {
    json!({
        "kind": "note", "entry": entry, "time_s": time_s, "step": note.control_step,
        "thought_s": note.thought().as_secs_f64(), "note": note,
    })
}

/// State of an episode at the moment when a viewer connects.
pub struct LiveView {
    pub scene: Arc<LiveScene>,
    pub now: Arc<LiveStep>,
    /// Latest calls and notes, the oldest first.
    pub entries: Vec<Arc<LiveEntry>>,
    pub phases: Vec<PhaseReached>,
    /// Next phase, if there is one and phases are disclosed.
    pub next_phase: Option<NextPhase>,
    /// Result of an episode that has ended.
    pub result: Option<ResultReply>,
}
