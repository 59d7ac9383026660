//! The complete definition of an episode in one value, from requests and flags to recordings and results.

mod keyed_seed;
mod start;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tandem_sim::{
    BaseLimits, LocomotionChoice, RobotModel, RobotSource, Sensing, SensorModel, SimError, StateSource,
    render::{CameraModel, RendererKind},
};
use tandem_tools_spec::{Assistance, Disclosure, Hints, Operators, Protocol, Wording};

use crate::error::RobotError;
use crate::protocol::{Rules, rules};
use crate::scoring::Phase;
use crate::stress::{self, Stress};
use crate::tasks::{SceneFile, Spread, Task, TaskOrigin, TaskWords};
use crate::variation::Variation;
use crate::words::OwnWords;

pub use keyed_seed::KeyedSeed;
pub use start::{MomentStart, PhaseStart, Start};

/// Prefixes of a base controller and of instructions in results.
const CONTROLLER: &str = "controller: ";
const INSTRUCTIONS: &str = "instructions: ";
/// Departures from the benchmark for Tandem's own controller and wording.
pub const OWN_CONTROLLER: &str = "controller: Tandem's own";
pub const OWN_WORDS: &str = "instructions: Tandem's own";

/// The complete definition of an episode. Equal specs and calls on one build end in the same state, bit
/// for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeSpec {
    #[serde(with = "crate::tasks::by_id_or_file")]
    pub task: Task,
    pub seed: u32,
    pub protocol: Protocol,
    /// Scene in place of the task's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<SceneFile>,
    pub robot: RobotFile,
    pub locomotion: Controller,
    /// Source of the robots' state. Recordings of builds without this choice used the simulator's own.
    #[serde(default = "before_there_was_a_choice")]
    pub sensing: Sensing,
    /// Renderer of the robots' images. It has no other effect.
    pub renderer: RendererKind,
    /// Model of the robots' cameras.
    #[serde(default, skip_serializing_if = "CameraModel::is_ideal")]
    pub camera: CameraModel,
    pub start: Start,
    /// Assistance of the policy. Recordings without this field had full assistance.
    #[serde(default)]
    pub assistance: Assistance,
    /// Disclosure of phases to the policy; experiments may set it apart from the assistance.
    #[serde(default)]
    pub disclosure: Disclosure,
    /// Hints on grasping for the policy; experiments may set them apart from the assistance.
    #[serde(default)]
    pub hints: Hints,
    /// Instructions in place of the task's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instructions: Option<OwnWords>,
    /// Variation beyond the benchmark.
    #[serde(default, skip_serializing_if = "Variation::is_benchmarks")]
    pub variation: Variation,
    /// Stress: faults injected into the episode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<Stress>,
    /// Limit of the policy's thinking time, in place of the protocol's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thinking_limit_s: Option<u32>,
    /// Seed drawn by an evaluator's key, if there is a key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub keyed_seed: Option<KeyedSeed>,
    /// Kind of command over the robots: by one policy, or by one operator for each robot. Operators have
    /// separate clocks, which the host keeps.
    #[serde(default, skip_serializing_if = "Operators::is_one")]
    pub operators: Operators,
}

/// Source of the robot's description.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RobotFile {
    /// Robot embedded in the binary, by name.
    Embedded(String),
    /// A user's file.
    File(OwnRobot),
}

/// A robot in a file: MJCF with the elements required of a robot, or a TOML description of other MJCF.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OwnRobot {
    pub path: PathBuf,
    /// Hash of the robot's files when the episode was planned; see [`RobotSource::fingerprint`].
    pub xxh3: String,
}

/// Base controller of the robots.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Controller {
    /// Our own controller.
    #[default]
    Balance,
    /// A velocity policy in an ONNX file.
    File(PathBuf),
    /// A velocity policy in an ONNX file, with a position loop around it.
    Looped(PathBuf),
}

impl EpisodeSpec {
    /// Returns the spec of an episode with the embedded robot and our own controller, from the task's start.
    pub fn new(task: &Task, seed: u32, protocol: Protocol) -> EpisodeSpec {
        EpisodeSpec {
            task: task.under(seed),
            seed,
            protocol,
            scene: None,
            robot: RobotFile::default(),
            locomotion: Controller::default(),
            sensing: Sensing::default(),
            renderer: RendererKind::default(),
            camera: CameraModel::default(),
            start: Start::default(),
            assistance: Assistance::default(),
            disclosure: Assistance::default().disclosure(),
            hints: Assistance::default().hints(),
            instructions: None,
            variation: Variation::default(),
            stress: None,
            thinking_limit_s: None,
            keyed_seed: None,
            operators: Operators::One,
        }
    }

    /// Returns the spec with another seed, and the options which that seed chooses.
    pub fn seeded(&self, seed: u32) -> EpisodeSpec {
        EpisodeSpec { task: self.task.under(seed), seed, keyed_seed: None, ..self.clone() }
    }

    /// Returns the spread of the randomisation, including stress.
    pub fn spread(&self) -> Spread {
        let plain = self.variation.spread;
        self.stress.map_or(plain, |stress| stress.spread(plain))
    }

    /// Returns the sensing of the robots, including stress.
    pub fn stressed_sensing(&self) -> Sensing {
        self.stress.map_or(self.sensing, |stress| stress.sensing(self.sensing))
    }

    /// Returns the wording of the task for the policy.
    pub fn task_words(&self) -> TaskWords {
        let words = stress::task_words(self.stress, &self.task);
        match &self.instructions {
            Some(own) => own.over(&self.task, words),
            None => words,
        }
    }

    /// Returns the protocol's rules for the task, with the spec's own limit of thinking time if it has one.
    pub fn rules(&self) -> Rules {
        let rules = rules(self.protocol, &self.task);
        let own = self.thinking_limit_s.map(|limit_s| Duration::from_secs(limit_s.into()));
        Rules { thinking: own.or(rules.thinking), ..rules }
    }

    /// Returns the spec with another assistance, and with the disclosure and hints of that assistance.
    pub fn assisted(self, assistance: Assistance) -> EpisodeSpec {
        EpisodeSpec { assistance, disclosure: assistance.disclosure(), hints: assistance.hints(), ..self }
    }

    /// Returns the selection of texts for the policy.
    pub fn wording(&self) -> Wording {
        Wording { hints: self.hints, ..self.assistance.into() }
    }

    /// Lists the departures from the benchmark, each as results name it. Tandem's own base controller and
    /// wording come first; every result without other choices has these two.
    pub fn departures(&self) -> Vec<String> {
        let own_controller = (self.locomotion == Controller::Balance).then(|| OWN_CONTROLLER.to_owned());
        let own_words =
            (self.instructions.is_none() && self.task.is_benchmark()).then(|| OWN_WORDS.to_owned());
        let others = self.peculiarities().into_iter().filter(|what| !self.is_the_benchmarks(what));
        own_controller.into_iter().chain(own_words).chain(others).collect()
    }

    /// Returns true if a peculiarity matches the benchmark.
    fn is_the_benchmarks(&self, what: &str) -> bool {
        let words = self.instructions.as_ref().filter(|words| words.are_the_benchmarks(&self.task));
        let of_file = matches!(self.locomotion, Controller::File(_));
        (of_file && what.starts_with(CONTROLLER)) || (words.is_some() && what.starts_with(INSTRUCTIONS))
    }

    /// Lists the departures from Tandem's defaults, each as shown after the policy's name. A new setting
    /// must be classified here.
    pub fn peculiarities(&self) -> Vec<String> {
        // The pattern has no `..`, so the compiler reports every new field. It leaves out fields that are
        // shown elsewhere and fields without an effect that a policy could notice.
        let EpisodeSpec {
            task,
            seed: _,
            protocol: _,
            scene,
            robot,
            locomotion,
            sensing: Sensing { state_estimate, sensors },
            renderer: _,
            camera,
            start,
            assistance,
            disclosure,
            hints,
            instructions,
            variation,
            stress,
            thinking_limit_s,
            keyed_seed,
            operators: _,
        } = self;
        let found = [
            match task.origin {
                TaskOrigin::Benchmark => None,
                TaskOrigin::Suite(suite) => Some(format!("suite: {suite}")),
                TaskOrigin::File => Some(format!("task file: {} {}", task.source.name, task.xxh3)),
            },
            (*assistance != Assistance::Paper).then(|| format!("assistance: {assistance}")),
            (*disclosure != assistance.disclosure()).then(|| format!("phases told: {disclosure}")),
            (*hints != assistance.hints()).then(|| format!("hints: {hints}")),
            scene.as_ref().map(|scene| format!("scene: {}", file_name(&scene.path))),
            (*robot != RobotFile::default()).then(|| format!("robot: {}", robot.kind())),
            match locomotion {
                Controller::Balance => None,
                Controller::File(path) => Some(format!("{CONTROLLER}{}", file_name(path))),
                Controller::Looped(path) => {
                    Some(format!("{CONTROLLER}{} in a loop over its place", file_name(path)))
                }
            },
            (*state_estimate != StateSource::default())
                .then(|| format!("state estimate: {}", state_estimate.name())),
            (*sensors != SensorModel::default()).then(|| format!("sensors: {}", sensors.name())),
            (!camera.is_ideal()).then(|| format!("camera: {}", camera.name())),
            instructions.as_ref().map(|words| format!("{INSTRUCTIONS}{}", words.xxh3)),
            thinking_limit_s.map(|limit_s| format!("thinking limit: {limit_s} s")),
            keyed_seed.as_ref().map(|keyed| format!("seed key: {}", keyed.key_fingerprint)),
            stress.map(|stress| format!("stress: {stress}")),
            start.peculiarity(),
        ];
        found.into_iter().flatten().chain(variation.departures()).collect()
    }

    /// Returns the index of the phase at which the episode starts, and which alone counts; `None` for other
    /// starts.
    pub fn start_phase(&self) -> Option<usize> {
        match &self.start {
            Start::Phase(start) => {
                (0..self.task.phases.len()).find(|phase| Phase::number(*phase) == start.phase)
            }
            Start::Task | Start::Checkpoint(_) | Start::Moment(_) => None,
        }
    }
}

fn before_there_was_a_choice() -> Sensing {
    Sensing::TRUTH
}

impl Default for RobotFile {
    fn default() -> RobotFile {
        RobotFile::Embedded(tandem_sim::assets::DEFAULT_ROBOT.into())
    }
}

impl RobotFile {
    /// Returns the embedded robot's name or the path, for messages.
    pub fn name(&self) -> String {
        match self {
            RobotFile::Embedded(name) => name.clone(),
            RobotFile::File(own) => own.path.display().to_string(),
        }
    }

    /// Returns the name of the kind of robot for policies: the file's name without its folder.
    pub fn kind(&self) -> String {
        match self {
            RobotFile::Embedded(name) => name.clone(),
            RobotFile::File(own) => own.path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        }
    }

    /// Returns the robot that a file currently describes.
    pub fn of(path: &Path) -> Result<RobotFile, SimError> {
        RobotFile::with_approximations(path).map(|(robot, _)| robot)
    }

    /// Returns the robot that a file currently describes, and each deviation from MuJoCo in a line.
    pub fn with_approximations(path: &Path) -> Result<(RobotFile, Vec<String>), SimError> {
        let source = RobotSource::read(path)?;
        let xxh3 = format!("{:016x}", source.fingerprint);
        // A replay may run in another folder.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
        Ok((RobotFile::File(OwnRobot { path, xxh3 }), source.model.approximations))
    }

    /// Reads the robot. Its file must be unchanged.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, or [`RobotError::Changed`].
    pub fn load(&self) -> Result<RobotSource, RobotError> {
        let own = match self {
            RobotFile::Embedded(name) => return Ok(RobotSource::embedded(name)?),
            RobotFile::File(own) => own,
        };
        let source = RobotSource::read(&own.path)?;
        let now = format!("{:016x}", source.fingerprint);
        match now == own.xxh3 {
            true => Ok(source),
            false => Err(RobotError::Changed { path: own.path.clone(), was: own.xxh3.clone(), now }),
        }
    }

    /// Returns the robot's model.
    pub fn model(&self) -> Result<Arc<RobotModel>, RobotError> {
        Ok(Arc::new(self.load()?.model))
    }

    /// Checks that this robot, read as `model`, has the hands that a task needs.
    pub fn check_task(&self, model: &RobotModel, task: &Task) -> Result<(), RobotError> {
        if !task.needs_fingers() || model.has_fingers() {
            return Ok(());
        }
        Err(RobotError::NoFingers { task: task.id.clone(), robot: self.kind() })
    }

    /// Returns a name that distinguishes files of different content.
    pub fn identity(&self) -> String {
        match self {
            RobotFile::Embedded(name) => name.clone(),
            RobotFile::File(own) => format!("{}-{}", self.name(), own.xxh3),
        }
    }
}

impl Controller {
    /// Returns the controller of a file, or our own without one. The prefix `looped:` before the path
    /// selects the position loop.
    pub fn from_file(path: Option<&Path>) -> Controller {
        let Some(path) = path else { return Controller::Balance };
        match path.to_str().and_then(|text| text.strip_prefix("looped:")) {
            Some(file) => Controller::Looped(file.into()),
            None => Controller::File(path.into()),
        }
    }

    /// Returns the limits of the base commands that this controller follows with this robot.
    pub fn limits(&self, robot: &RobotFile) -> Result<BaseLimits, RobotError> {
        Ok(self.load()?.limits(&robot.load()?.model.scale))
    }

    /// Reads and checks the file.
    pub fn load(&self) -> Result<LocomotionChoice, SimError> {
        match self {
            Controller::Balance => Ok(LocomotionChoice::Balance),
            Controller::File(path) => LocomotionChoice::from_file(path, false),
            Controller::Looped(path) => LocomotionChoice::from_file(path, true),
        }
    }
}

/// Returns the last part of a path, for readers.
fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks::{self, Spread};

    #[test]
    fn controllers_are_named_as_they_were_asked_for() {
        let asked = |file: Option<&str>| Controller::from_file(file.map(Path::new));
        assert_eq!(asked(None), Controller::Balance);
        assert_eq!(asked(Some("a/walk.onnx")), Controller::File("a/walk.onnx".into()));
        assert_eq!(asked(Some("looped:a/walk.onnx")), Controller::Looped("a/walk.onnx".into()));

        let own = EpisodeSpec::new(&tasks::cohub()[0], 0, Protocol::Benchmark).assisted(Assistance::Paper);
        let named = |file: Option<&str>| {
            let spec = EpisodeSpec { locomotion: asked(file), ..own.clone() };
            (spec.peculiarities(), spec.departures())
        };
        let words = || OWN_WORDS.to_owned();
        assert_eq!(named(None), (vec![], vec![OWN_CONTROLLER.into(), words()]));
        // The benchmark's own kind of controller departs from Tandem's default, but not from the benchmark.
        assert_eq!(named(Some("a/walk.onnx")), (vec!["controller: walk.onnx".into()], vec![words()]));
        let looped = "controller: walk.onnx in a loop over its place".to_owned();
        assert_eq!(named(Some("looped:a/walk.onnx")), (vec![looped.clone()], vec![words(), looped]));
    }

    #[test]
    fn other_words_are_named() {
        let own = EpisodeSpec::new(&tasks::cohub()[0], 0, Protocol::Benchmark).assisted(Assistance::Paper);
        let words = OwnWords { xxh3: "00ff".into(), ..OwnWords::default() };
        let told = EpisodeSpec { instructions: Some(words), ..own };
        assert_eq!(told.peculiarities(), ["instructions: 00ff"]);
        assert_eq!(told.departures(), [OWN_CONTROLLER, "instructions: 00ff"]);
    }

    #[test]
    fn what_varies_as_in_the_benchmark_leaves_no_trace_and_what_does_not_is_named() {
        let own = EpisodeSpec::new(&tasks::cohub()[0], 0, Protocol::Benchmark).assisted(Assistance::Paper);
        assert_eq!(serde_json::to_value(&own).unwrap().get("variation"), None);
        let variation = Variation { spread: Spread::Double, variety: 1, disturb: 0.8 };
        let wide = EpisodeSpec { variation, ..own };
        assert_eq!(wide.peculiarities(), ["spread: 2", "variety: 1", "disturbed: 0.8"]);
        let text = serde_json::to_string(&wide).unwrap();
        assert!(text.contains(r#""variation":{"spread":2,"variety":1,"disturb":0.8}"#), "{text}");
        assert_eq!(serde_json::from_str::<EpisodeSpec>(&text).unwrap(), wide);
        let refused = serde_json::from_str::<EpisodeSpec>(&text.replace(r#""spread":2"#, r#""spread":5"#));
        assert!(refused.unwrap_err().to_string().contains("no spread 5; have: 1, 2, 3, 4"));
    }
}
