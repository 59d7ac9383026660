//! The flags for the scene, the robots and the renderer.

use std::path::PathBuf;

use clap::Args;
use tandem_episodes::{
    Controller, RendererKind, RobotFile, SceneFile, Sensing, SensorModel, SimError, StateSource, tasks::Task,
};

use crate::settings::{Layer, SettingsError, one_of, read_robot, read_scene, read_task_file};

/// What episodes are played in, the same for each of them.
#[derive(Debug, Args)]
pub struct WorldFlags {
    /// MJCF file of a scene in place of the tasks' own; its site `task` says where.
    #[arg(long, env = "TANDEM_SCENE", value_name = "FILE")]
    scene: Option<PathBuf>,
    /// File that describes the robots in place of the embedded one: MJCF that names joints as the embedded robot's does, or a TOML file
    /// that says of another MJCF which of its joints are which.
    #[arg(long, env = "TANDEM_ROBOT", value_name = "FILE")]
    robot: Option<PathBuf>,
    /// TOML files with tasks of your own, separated by commas; one that is called as a built-in task takes its place.
    #[arg(long, env = "TANDEM_TASK_FILE", value_name = "FILES", value_delimiter = ',')]
    task_file: Option<Vec<PathBuf>>,
    #[command(flatten)]
    locomotion: LocomotionFlag,
    #[command(flatten)]
    sensing: SensingFlags,
    /// Who draws pictures: a graphics processor, the embedded renderer, or whichever is there.
    #[arg(long, env = "TANDEM_RENDERER", value_name = "NAME", value_parser = one_of(RendererKind::ALL, RendererKind::name),
          default_value = RendererKind::default().name())]
    renderer: RendererKind,
}

impl WorldFlags {
    /// Reads the scene from the file that the flag names.
    pub fn read_scene(&self) -> Result<Option<SceneFile>, SimError> {
        self.scene.as_deref().map(read_scene).transpose()
    }

    /// Reads the robot from the file that the flag names, or returns the embedded one.
    pub fn read_robot(&self) -> Result<RobotFile, SimError> {
        read_robot(self.robot.as_deref())
    }

    /// Reads the tasks from the files that the flag names.
    pub fn read_task_files(&self) -> Result<Vec<&'static Task>, SettingsError> {
        self.task_file.iter().flatten().map(|path| read_task_file(path)).collect()
    }

    /// Returns the controller that the flag names; its file is not read yet.
    pub fn controller(&self) -> Controller {
        self.locomotion.controller()
    }

    /// Returns the robots' sensing of their own state.
    pub fn sensing(&self) -> Sensing {
        self.sensing.sensing()
    }

    /// Returns the renderer.
    pub fn renderer(&self) -> RendererKind {
        self.renderer
    }

    /// Converts the flags to settings of a server.
    pub fn layer(self) -> Layer {
        Layer {
            scene: self.scene,
            robot: self.robot,
            task_file: self.task_file,
            locomotion: self.locomotion.file,
            state_estimate: Some(self.sensing.state_estimate),
            sensors: Some(self.sensing.sensors),
            renderer: Some(self.renderer),
            ..Layer::default()
        }
    }
}

/// The base controller on the command line.
#[derive(Debug, Args)]
pub struct LocomotionFlag {
    /// ONNX file with a velocity policy for the G1 in place of our own base controller; looped:FILE puts a loop over the robot's place around it.
    #[arg(long = "locomotion", env = "TANDEM_LOCOMOTION", value_name = "FILE")]
    file: Option<PathBuf>,
}

impl LocomotionFlag {
    /// Returns the controller that the flag names; its file is not read yet.
    pub fn controller(&self) -> Controller {
        Controller::from_file(self.file.as_deref())
    }
}

/// What robots know of themselves, on the command line.
#[derive(Debug, Args)]
pub struct SensingFlags {
    /// Where robots have their own state from: an estimator over what they sense, or the simulator, which no real robot has.
    #[arg(long, env = "TANDEM_STATE_ESTIMATE", value_name = "SOURCE", value_parser = one_of(StateSource::ALL, StateSource::name))]
    #[arg(default_value = StateSource::default().name())]
    state_estimate: StateSource,
    /// What robots sense: everything exactly, or with noise, bias and latency as a G1 does.
    #[arg(long, env = "TANDEM_SENSORS", value_name = "NAME", value_parser = one_of(SensorModel::ALL, SensorModel::name))]
    #[arg(default_value = SensorModel::default().name())]
    sensors: SensorModel,
}

impl SensingFlags {
    /// Returns both flags as one value.
    pub fn sensing(&self) -> Sensing {
        Sensing { state_estimate: self.state_estimate, sensors: self.sensors }
    }
}
