//! The flags for the scene, the robots and the renderer.

use std::path::PathBuf;

use clap::Args;
use tandem_episodes::{
    CameraModel, Controller, RendererKind, RobotFile, SceneFile, Sensing, SensorModel, SimError, StateSource,
    tasks::Task,
};

use crate::settings::{Layer, SettingsError, one_of, read_robot, read_scene, read_task_file};

/// Scene, robots and renderer of all episodes.
#[derive(Debug, Args)]
pub struct WorldFlags {
    /// MJCF file of a scene in place of the tasks' own; its site `task` marks the origin of tasks.
    #[arg(long, env = "TANDEM_SCENE", value_name = "FILE")]
    scene: Option<PathBuf>,
    /// File with a robot in place of the embedded one: MJCF with the embedded robot's joint names, or a TOML
    /// file that maps the joints of another MJCF.
    #[arg(long, env = "TANDEM_ROBOT", value_name = "FILE")]
    robot: Option<PathBuf>,
    /// TOML files with your own tasks, separated by commas; a task with the name of a built-in one replaces
    /// it.
    #[arg(long, env = "TANDEM_TASK_FILE", value_name = "FILES", value_delimiter = ',')]
    task_file: Option<Vec<PathBuf>>,
    #[command(flatten)]
    locomotion: LocomotionFlag,
    #[command(flatten)]
    sensing: SensingFlags,
    /// Renderer of images: `gpu`, `cpu` (embedded), `path` (path tracing on the CPU, a second per look), or
    /// `auto` (a GPU if there is one, otherwise `cpu`).
    #[arg(long, env = "TANDEM_RENDERER", value_name = "NAME", value_parser = one_of(RendererKind::ALL, RendererKind::name),
          default_value = RendererKind::default().name())]
    renderer: RendererKind,
    /// Model of the robots' cameras: a pinhole with a perfect sensor, or the G1's own Intel RealSense D435i
    /// with noise, motion blur, distortion and holes in its depth.
    #[arg(long, env = "TANDEM_CAMERA", value_name = "NAME", value_parser = one_of(CameraModel::ALL, CameraModel::name),
          default_value = CameraModel::default().name())]
    camera: CameraModel,
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
    pub fn read_task_files(&self) -> Result<Vec<Task>, SettingsError> {
        self.task_file.iter().flatten().map(|path| read_task_file(path)).collect()
    }

    /// Returns the controller that the flag names. Its file is not read yet.
    pub fn controller(&self) -> Controller {
        self.locomotion.controller()
    }

    /// Returns the source and the sensor model of the robots' state.
    pub fn sensing(&self) -> Sensing {
        self.sensing.sensing()
    }

    /// Returns the renderer.
    pub fn renderer(&self) -> RendererKind {
        self.renderer
    }

    /// Returns the model of the robots' cameras.
    pub fn camera(&self) -> CameraModel {
        self.camera
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
            camera: Some(self.camera),
            ..Layer::default()
        }
    }
}

/// The base controller on the command line.
#[derive(Debug, Args)]
pub struct LocomotionFlag {
    /// ONNX file with a velocity policy for the G1 in place of the built-in base controller; looped:FILE adds
    /// a position loop around it.
    #[arg(long = "locomotion", env = "TANDEM_LOCOMOTION", value_name = "FILE")]
    file: Option<PathBuf>,
}

impl LocomotionFlag {
    /// Returns the controller that the flag names. Its file is not read yet.
    pub fn controller(&self) -> Controller {
        Controller::from_file(self.file.as_deref())
    }
}

/// The robots' sensing of their own state, on the command line.
#[derive(Debug, Args)]
pub struct SensingFlags {
    /// Source of the robots' own state: an estimator on their sensors, or the simulator, which no real robot
    /// has.
    #[arg(long, env = "TANDEM_STATE_ESTIMATE", value_name = "SOURCE", value_parser = one_of(StateSource::ALL, StateSource::name))]
    #[arg(default_value = StateSource::default().name())]
    state_estimate: StateSource,
    /// Sensor model of the robots: exact, or with the noise, bias and latency of a G1.
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
