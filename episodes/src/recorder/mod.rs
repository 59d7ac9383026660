//! Records an episode as MCAP with Foxglove's well-known schemas, so that it can be watched and plotted in Foxglove.
//!
//! Log times are simulated time. Frames: `world`, `A/pelvis` and every other link of robot A as `A/<link>`, its camera as
//! `A/egocentric`, objects by name. Numbers that have no well-known schema are JSON with a JSON Schema.
//!
//! The file is `episode.mcap.partial` until [`Recorder::finish`] renames it. A recorder that is dropped earlier still
//! writes the index, so the partial file can be opened, but an `episode.mcap` is always complete.

mod file;
mod messages;
mod scene;
#[cfg(test)]
mod tests;
mod transforms;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use foxglove::messages::{
    CameraCalibration, CompressedImage, FrameTransforms, JointState, JointStates, SceneUpdate,
};
use tandem_sim::{
    Pose, RobotCommand, RobotModel, RobotState, UPPER,
    mjcf::{Geom, MjcfCamera},
    render::robot_rgba,
};
use tandem_tools_spec::{Budget, PhaseReached, Protocol, ToolCall, ToolReply};

use crate::facts::Grip;
use crate::results::{EpisodeResult, OutputError};
use file::{McapFile, Topic};
use messages::{Action, Base, BudgetLeft, Hands, Json, Phase, ToolCallMessage};
use transforms::{EGOCENTRIC, robot_frame, timestamp};

/// What is known of an episode before its first step.
pub struct RecordingHeader {
    pub task: String,
    pub seed: u32,
    pub protocol: Protocol,
    /// Which base controller the robots have.
    pub locomotion: String,
    /// In the order of [`StepRecord::robots`].
    pub robots: Vec<RecordedRobot>,
}

/// A robot that is recorded.
pub struct RecordedRobot {
    pub name: String,
    pub model: Arc<RobotModel>,
}

/// Everything that is recorded at one control step.
pub struct StepRecord<'a> {
    pub time_s: f64,
    pub robots: &'a [RobotStep],
    pub objects: &'a [ObjectStep<'a>],
    pub budget: Budget,
}

/// One robot at one control step: what it measured after the step, and the command that the step executed.
pub struct RobotStep {
    pub state: RobotState,
    pub command: RobotCommand,
    /// Per object: what the left and the right hand do to it.
    pub grips: Vec<(String, [Grip; 2])>,
}

/// One object at one control step.
pub struct ObjectStep<'a> {
    pub name: &'a str,
    pub world_from_object: Pose,
}

/// A tool call and how it was answered: a reply, or the text of the problem.
pub struct ToolCallRecord<'a> {
    /// When it was answered.
    pub time_s: f64,
    pub call: &'a ToolCall,
    pub outcome: Result<&'a ToolReply, &'a str>,
}

/// A recording under way.
pub struct Recorder {
    file: McapFile,
    robots: Vec<RecordedRobot>,
    robot_topics: Vec<RobotTopics>,
    transforms: Topic<FrameTransforms>,
    scene: Topic<SceneUpdate>,
    phases: Topic<Json<Phase>>,
    budget: Topic<Json<BudgetLeft>>,
    tool_calls: Topic<Json<ToolCallMessage>>,
}

struct RobotTopics {
    joint_states: Topic<JointStates>,
    action: Topic<Json<Action>>,
    base_command: Topic<Json<Base>>,
    hands: Topic<Json<Hands>>,
    /// Opened by the first picture.
    camera: Option<CameraTopics>,
}

struct CameraTopics {
    image: Topic<CompressedImage>,
    calibration: Topic<CameraCalibration>,
}

impl Recorder {
    pub const FILE_NAME: &str = "episode.mcap";

    /// Opens a recording in an existing run folder and writes what the episode is and what its robots look like.
    pub fn create(folder: &Path, header: RecordingHeader) -> Result<Recorder, OutputError> {
        let mut file = McapFile::create(folder, Self::FILE_NAME)?;
        let names: Vec<&str> = header.robots.iter().map(|robot| robot.name.as_str()).collect();
        let entries = [
            ("task", header.task.as_str()),
            ("seed", &header.seed.to_string()),
            ("protocol", protocol_name(header.protocol)),
            ("locomotion", header.locomotion.as_str()),
            ("robots", &names.join(",")),
            ("tandem_version", env!("CARGO_PKG_VERSION")),
        ];
        file.metadata("episode", &entries)?;
        let robot_topics = header
            .robots
            .iter()
            .map(|robot| RobotTopics::open(&mut file, robot))
            .collect::<Result<_, _>>()?;
        let mut recorder = Recorder {
            transforms: file.topic("/tf", &[])?,
            scene: file.topic("/scene", &[])?,
            phases: file.topic("/phases", &[])?,
            budget: file.topic("/budget", &[])?,
            tool_calls: file.topic("/tool_calls", &[])?,
            robot_topics,
            robots: header.robots,
            file,
        };
        recorder.draw_robots()?;
        Ok(recorder)
    }

    /// Adds shapes that are drawn in frame `frame` from the start: `world` for the room, an object's name for an object.
    pub fn draw(&mut self, frame: &str, geoms: &[Geom]) -> Result<(), OutputError> {
        let update =
            SceneUpdate { entities: vec![scene::entity(frame, geoms, |geom| geom.rgba)], deletions: vec![] };
        self.file.write(&mut self.scene, 0.0, &update)
    }

    fn draw_robots(&mut self) -> Result<(), OutputError> {
        let mut entities = Vec::new();
        for (index, robot) in self.robots.iter().enumerate() {
            for link in &robot.model.links {
                let frame = robot_frame(&robot.name, &link.name);
                entities.push(scene::entity(&frame, &link.geoms, |geom| robot_rgba(geom, index)));
            }
        }
        self.file.write(&mut self.scene, 0.0, &SceneUpdate { entities, deletions: vec![] })
    }

    /// Appends one control step.
    pub fn step(&mut self, step: &StepRecord) -> Result<(), OutputError> {
        let time_s = step.time_s;
        self.file.write(&mut self.transforms, time_s, &transforms::transforms(&self.robots, step))?;
        for ((robot, topics), moved) in self.robots.iter().zip(&mut self.robot_topics).zip(step.robots) {
            let joints = joint_states(&robot.model, time_s, &moved.state);
            self.file.write(&mut topics.joint_states, time_s, &joints)?;
            self.file.write(&mut topics.action, time_s, &Json::from(&moved.command))?;
            self.file.write(&mut topics.base_command, time_s, &Json::from(&moved.command))?;
            self.file.write(&mut topics.hands, time_s, &Json::<Hands>::from(moved))?;
        }
        self.file.write(&mut self.budget, time_s, &Json::from(&step.budget))
    }

    /// Appends a phase at the time it was reached.
    pub fn phase(&mut self, phase: &PhaseReached) -> Result<(), OutputError> {
        self.file.write(&mut self.phases, phase.time_s, &Json::from(phase))
    }

    /// Appends a tool call and its answer. Pictures of the answer go to the topics of their robots' cameras.
    pub fn tool_call(&mut self, record: &ToolCallRecord) -> Result<(), OutputError> {
        self.file.write(&mut self.tool_calls, record.time_s, &ToolCallMessage::new(record)?)?;
        if let Ok(ToolReply::Observation(observation)) = record.outcome {
            for image in &observation.images {
                if let Some(robot) = self.robots.iter().position(|robot| robot.name == image.robot) {
                    self.egocentric(robot, record.time_s, image.png_base64.0.clone())?;
                }
            }
        }
        Ok(())
    }

    /// Appends a PNG seen through the head camera of robot number `robot`.
    fn egocentric(&mut self, robot: usize, time_s: f64, png: Vec<u8>) -> Result<(), OutputError> {
        let name = &self.robots[robot].name;
        let frame_id = robot_frame(name, EGOCENTRIC);
        let camera = match &mut self.robot_topics[robot].camera {
            Some(camera) => camera,
            unopened => {
                let mut camera = CameraTopics {
                    image: self.file.topic(&format!("/{name}/egocentric"), &[])?,
                    calibration: self.file.topic(&format!("/{name}/egocentric/calibration"), &[])?,
                };
                let calibration = calibration(&self.robots[robot].model.egocentric, &frame_id, time_s);
                self.file.write(&mut camera.calibration, time_s, &calibration)?;
                unopened.insert(camera)
            }
        };
        let image = CompressedImage {
            timestamp: Some(timestamp(time_s)),
            frame_id,
            data: png.into(),
            format: "png".into(),
        };
        self.file.write(&mut camera.image, time_s, &image)
    }

    /// Writes the result and the index, and gives the file its name.
    pub fn finish(mut self, result: &EpisodeResult) -> Result<PathBuf, OutputError> {
        self.file.metadata("result", &[("result.json", &serde_json::to_string(result)?)])?;
        self.file.finish()
    }
}

impl RobotTopics {
    fn open(file: &mut McapFile, robot: &RecordedRobot) -> Result<RobotTopics, OutputError> {
        let mut columns: Vec<&str> =
            UPPER.iter().map(|joint| robot.model.joints[*joint].name.as_str()).collect();
        columns.extend(["vx_m_s", "vy_m_s", "yaw_rate_rad_s", "pelvis_height_m"]);
        Ok(RobotTopics {
            joint_states: file.topic(&format!("/{}/joint_states", robot.name), &[])?,
            action: file.topic(&format!("/{}/action", robot.name), &[("columns", &columns.join(","))])?,
            base_command: file.topic(&format!("/{}/base_command", robot.name), &[])?,
            hands: file.topic(&format!("/{}/hands", robot.name), &[])?,
            camera: None,
        })
    }
}

fn joint_states(model: &RobotModel, time_s: f64, state: &RobotState) -> JointStates {
    let joints = model.joints.iter().enumerate().map(|(index, joint)| JointState {
        name: joint.name.clone(),
        position: Some(state.q_rad[index].into()),
        velocity: Some(state.qd_rad_s[index].into()),
        acceleration: None,
        effort: Some(state.torque_n_m[index].into()),
    });
    JointStates { timestamp: Some(timestamp(time_s)), joints: joints.collect() }
}

/// Pinhole calibration without distortion; the centre of pixel (0, 0) lies at (0, 0).
fn calibration(camera: &MjcfCamera, frame_id: &str, time_s: f64) -> CameraCalibration {
    let (width, height) = camera.resolution_px;
    let focal_px = f64::from(height) / 2.0 / (f64::from(camera.vertical_fov_rad) / 2.0).tan();
    let [cx, cy] = [width, height].map(|size| (f64::from(size) - 1.0) / 2.0);
    #[rustfmt::skip]
    let (k, p) = (
        vec![focal_px, 0.0, cx,  0.0, focal_px, cy,  0.0, 0.0, 1.0],
        vec![focal_px, 0.0, cx, 0.0,  0.0, focal_px, cy, 0.0,  0.0, 0.0, 1.0, 0.0],
    );
    CameraCalibration {
        timestamp: Some(timestamp(time_s)),
        frame_id: frame_id.into(),
        width,
        height,
        k,
        p,
        ..CameraCalibration::default()
    }
}

fn protocol_name(protocol: Protocol) -> &'static str {
    match protocol {
        Protocol::Agentic => "agentic",
        Protocol::Benchmark => "benchmark",
    }
}
