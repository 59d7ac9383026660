//! Writing of a recording while the episode runs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use base64::{Engine, prelude::BASE64_STANDARD};
use foxglove::messages::{FrameTransforms, SceneUpdate};
use tandem_sim::{Step, mjcf::Geom, render::robot_rgba};
use tandem_tools_spec::{Budget, PhaseReached, ResultReply};

use super::mcap_file::{LiveViewer, McapFile, Topic, Visibility};
use super::topics::messages::{BudgetMessage, Json, PhaseMessage, ToolCallMessage, ToolCallRecord};
use super::topics::notes::NoteMessage;
use super::topics::robot::RobotTopics;
use super::topics::steps::{StepEncoder, StepRow};
use super::topics::transforms::{self, robot_frame};
use super::topics::{self, scene};
use super::{checkpoint_name, metadata};
use crate::commands::{Executed, RobotSheet};
use crate::output::OutputError;
use crate::result_file::RESULT_FILE;
use crate::scoring::{Facts, ScoreMemory};
use crate::spec::EpisodeSpec;

/// Interval in steps between transforms. The poses of links follow from the joint states of every step.
/// Transforms are for display, and take the most bytes of a recording.
const TRANSFORMS_EVERY: u64 = 5;

/// Description of an episode before its first step.
pub struct RecordingHeader {
    pub spec: EpisodeSpec,
    /// Name of the robots' base controller; files of different content have different names.
    pub locomotion: String,
    /// Renderer of the images, and its device.
    pub renderer: String,
    /// Build of Tandem that plays the episode.
    pub build: String,
    /// The robots, in their order in the world.
    pub robots: Vec<RobotSheet>,
    /// State of the scoring at the start of the recording.
    pub scores: ScoreMemory,
    /// True if robots do not always execute the policy's commands.
    pub executes_otherwise: bool,
}

/// A recording that is being written.
pub struct Recorder {
    file: McapFile,
    /// Simulated time at which the recording begins.
    start_s: f64,
    /// Simulated time at the end of the last step.
    last_s: f64,
    robots: Vec<RobotSheet>,
    robot_topics: Vec<RobotTopics>,
    steps: Topic<StepRow>,
    step_encoder: StepEncoder,
    transforms: Topic<FrameTransforms>,
    scene: Topic<SceneUpdate>,
    phases: Topic<Json<PhaseMessage>>,
    budget: Topic<Json<BudgetMessage>>,
    tool_calls: Topic<Json<ToolCallMessage>>,
    notes: Topic<Json<NoteMessage>>,
}

impl Recorder {
    pub const FILE_NAME: &str = "episode.mcap";

    /// Opens a recording in an existing run folder. Writes the episode's description, the robots' shapes,
    /// and `start`, the state before the first recorded step. `live` shows it from then on.
    ///
    /// # Errors
    ///
    /// If the file cannot be created or written.
    pub fn create(
        folder: &Path,
        visibility: Visibility,
        live: Option<&dyn LiveViewer>,
        header: RecordingHeader,
        start: &Step,
        state_hash: u64,
    ) -> Result<Recorder, OutputError> {
        let mut file = McapFile::create(&folder.join(Self::FILE_NAME), visibility, live)?;
        write_header(&mut file, &header)?;
        let robot_topics = header
            .robots
            .iter()
            .map(|robot| RobotTopics::open(&mut file, robot, header.spec.camera, header.executes_otherwise))
            .collect::<Result<_, _>>()?;
        let mut recorder = Recorder {
            steps: file.topic(topics::STEPS, &[])?,
            step_encoder: StepEncoder::default(),
            transforms: file.topic("/tf", &[])?,
            scene: file.topic("/scene", &[])?,
            phases: file.topic(topics::PHASES, &[])?,
            budget: file.topic("/budget", &[])?,
            tool_calls: file.topic(topics::TOOL_CALLS, &[])?,
            notes: file.topic(topics::NOTES, &[])?,
            start_s: start.time_s,
            robot_topics,
            last_s: start.time_s,
            robots: header.robots,
            file,
        };
        recorder.draw_robots()?;
        let row = recorder.step_encoder.encode(start, state_hash)?;
        recorder.file.write(&mut recorder.steps, start.time_s, &row)?;
        Ok(recorder)
    }

    /// Adds shapes that are drawn in frame `frame` from the start: `world` for the room, an object's name
    /// for an object.
    pub fn draw(&mut self, frame: &str, geoms: &[Geom]) -> Result<(), OutputError> {
        let entity = scene::entity(frame, geoms, |geom| geom.rgba);
        self.file.write(
            &mut self.scene,
            self.start_s,
            &SceneUpdate { entities: vec![entity], deletions: vec![] },
        )
    }

    fn draw_robots(&mut self) -> Result<(), OutputError> {
        let mut entities = Vec::new();
        for (index, robot) in self.robots.iter().enumerate() {
            for link in &robot.model.links {
                let frame = robot_frame(&robot.name, &link.name);
                entities.push(scene::entity(&frame, &link.geoms, |geom| robot_rgba(geom, index)));
            }
        }
        self.file.write(&mut self.scene, self.start_s, &SceneUpdate { entities, deletions: vec![] })
    }

    /// Appends one control step with the scoring's `facts` and the hash of the whole state after the step.
    /// `executed` are the commands that the robots executed, which may differ from the policy's, and
    /// setpoints of their motors.
    pub fn step(
        &mut self,
        step: &Step,
        executed: &Executed,
        state_hash: u64,
        facts: &Facts,
        budget: Budget,
    ) -> Result<(), OutputError> {
        let time_s = step.time_s;
        let row = self.step_encoder.encode(step, state_hash)?;
        self.file.write(&mut self.steps, time_s, &row)?;
        if self.last_s == self.start_s || step.control_step.is_multiple_of(TRANSFORMS_EVERY) {
            self.file.write(&mut self.transforms, time_s, &transforms::transforms(&self.robots, step))?;
        }
        let robots = self.robots.iter().zip(&mut self.robot_topics).zip(&step.robots);
        for (index, ((robot, topics), moved)) in robots.enumerate() {
            topics.step(&mut self.file, robot, index, time_s, moved, facts)?;
            if let Some(executed) = executed.commands.get(index) {
                topics.executed(&mut self.file, time_s, executed)?;
            }
            if let Some(setpoints) = executed.setpoints.get(index).filter(|given| !given.is_empty()) {
                topics.setpoints(&mut self.file, &robot.name, time_s, setpoints)?;
            }
        }
        self.last_s = time_s;
        self.file.write(&mut self.budget, time_s, &Json::from(&budget))
    }

    /// Appends a phase at the time it was reached.
    pub fn phase(&mut self, phase: &PhaseReached) -> Result<(), OutputError> {
        self.file.write(&mut self.phases, phase.time_s, &Json::from(phase))
    }

    /// Attaches a checkpoint of the episode at `time_s`.
    pub fn checkpoint(&mut self, name: &str, time_s: f64, bytes: &[u8]) -> Result<(), OutputError> {
        self.file.attach(&checkpoint_name(name), time_s, bytes)
    }

    /// Appends a tool call and its reply. Images of the reply go to the topics of their robots' cameras,
    /// one for each state.
    pub fn tool_call(&mut self, record: ToolCallRecord) -> Result<(), OutputError> {
        let ToolCallRecord { time_s, message, pictures } = record;
        self.file.write(&mut self.tool_calls, time_s, &Json(message))?;
        for (name, picture) in pictures {
            let robots = self.robots.iter().zip(&mut self.robot_topics);
            if let Some((robot, topics)) = robots.into_iter().find(|(robot, _)| robot.name == name) {
                topics.picture(&mut self.file, robot, time_s, &picture)?;
            }
        }
        Ok(())
    }

    /// Appends a note at this time.
    pub fn note(&mut self, time_s: f64, note: NoteMessage) -> Result<(), OutputError> {
        self.file.write(&mut self.notes, time_s, &Json(note))
    }

    /// Writes all appended data to the system.
    pub fn flush(&mut self) -> Result<(), OutputError> {
        self.file.flush()
    }

    /// Writes the result and the index, and gives the file its name.
    ///
    /// # Errors
    ///
    /// If the file cannot be written.
    pub fn finish(mut self, result: &ResultReply) -> Result<PathBuf, OutputError> {
        self.file.metadata(metadata::RESULT, &[(RESULT_FILE, &serde_json::to_string(result)?)])?;
        self.file.finish()
    }
}

/// Writes the episode's description: one value for programs, and single texts for people.
fn write_header(file: &mut McapFile, header: &RecordingHeader) -> Result<(), OutputError> {
    let names: Vec<&str> = header.robots.iter().map(|robot| robot.name.as_str()).collect();
    let words = header.spec.task_words();
    let instructions: BTreeMap<&str, &String> = header.spec.task.robot_names().zip(&words.robots).collect();
    let scores = postcard::to_stdvec(&header.scores).map_err(|source| OutputError::Encode(source.into()))?;
    let entries = [
        ("task", header.spec.task.id.as_str()),
        ("seed", &header.spec.seed.to_string()),
        ("protocol", header.spec.protocol.name()),
        (metadata::LOCOMOTION, header.locomotion.as_str()),
        ("renderer", &header.renderer),
        ("robots", &names.join(",")),
        ("tandem_version", env!("CARGO_PKG_VERSION")),
        (metadata::BUILD, header.build.as_str()),
        ("instruction", &words.joint),
        ("instructions", &serde_json::to_string(&instructions)?),
        (metadata::SPEC, &serde_json::to_string(&header.spec)?),
        (metadata::SCORES, &BASE64_STANDARD.encode(scores)),
    ];
    file.metadata(metadata::EPISODE, &entries)
}
