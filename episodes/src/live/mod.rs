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
use crate::recording::{NoteMessage, ToolCallMessage, ToolCallRecord, TranscriptEntry};

pub use scene::LiveScene;

/// Where a session tells what happens.
pub trait Onlookers: Send {
    /// Whether anybody looks on; where nobody does, nothing is handed over.
    fn any(&self) -> bool;

    /// Whether the control step of this number is wanted, which has just been made. The last one of a call is told in any case.
    fn wants_step(&self, control_step: u64) -> bool;

    /// Must not wait for anybody.
    fn tell(&self, event: LiveEvent);
}

/// Every how many control steps onlookers get one: 25 a simulated second.
pub const STEPS_PER_FRAME: u64 = 2;

/// Something that has happened in an episode.
#[derive(Clone)]
pub enum LiveEvent {
    Step(Arc<LiveStep>),
    /// A call that has been answered, or a note.
    Entry(Arc<LiveEntry>),
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

/// A tool call with its answer, or a note.
pub struct LiveEntry {
    /// The entries of an episode are counted from 1.
    pub entry: u32,
    /// As a page reads it.
    pub told: Value,
    /// What was seen, with the name of the robot that saw it.
    pub pictures: Vec<(String, Arc<Picture>)>,
}

impl LiveEntry {
    /// A call; those that count have a number.
    pub(crate) fn of_call(entry: u32, number: Option<u32>, record: &ToolCallRecord) -> LiveEntry {
        let told = told_call(entry, number, record.time_s, &record.message);
        LiveEntry { entry, told, pictures: record.pictures.clone() }
    }

    pub(crate) fn of_note(entry: u32, time_s: f64, note: &NoteMessage) -> LiveEntry {
        LiveEntry { entry, told: told_note(entry, time_s, note), pictures: Vec::new() }
    }

    /// The entry for who comes later: a picture is seen when it is made.
    pub(crate) fn without_pictures(&self) -> LiveEntry {
        LiveEntry { entry: self.entry, told: self.told.clone(), pictures: Vec::new() }
    }
}

/// A transcript as a page reads it.
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

/// An episode as it stands when somebody begins to look on.
pub struct LiveView {
    pub scene: Arc<LiveScene>,
    pub now: Arc<LiveStep>,
    /// Its latest calls and notes, the oldest first.
    pub entries: Vec<Arc<LiveEntry>>,
    pub phases: Vec<PhaseReached>,
    /// What it came to, if it has ended.
    pub result: Option<ResultReply>,
}
