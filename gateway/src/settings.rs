//! Settings. Flags take precedence over the environment (`TANDEM_*`), then a TOML file, then defaults.

mod check;
mod durability;
mod error;
mod tls;

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use clap::{
    Args, ValueEnum,
    builder::{PossibleValuesParser, TypedValueParser},
};
use serde::Deserialize;
use tandem_episodes::{
    BaseLimits, CameraModel, Controller, EpisodeError, EpisodeSpec, Instructions, InstructionsError,
    LiveViewer, MAX_TEXT_BYTES, RendererKind, RobotFile, RunFolder, SceneFile, Sensing, SensorModel,
    SimError, StateSource, Visibility, read_task, read_text,
    stress::{Stress, StressAxis, StressLevel},
    tasks::{Task, TaskSet},
};
use tandem_evaluation::check_task;
use tandem_tools_spec::{Assistance, Disclosure, Hints, Protocol, StartEpisode, Wording};

use crate::live_view::FoxgloveServer;
use crate::token::{Token, TokenError};
pub use durability::Durability;
pub use error::SettingsError;
pub use tls::{Certificate, TlsError};

/// One source of settings. Missing settings come from the next source. The doc comments are help texts of the
/// command line.
#[derive(Debug, Clone, Default, PartialEq, Args, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Address to serve on [default: 127.0.0.1:8700].
    #[arg(long, env = "TANDEM_LISTEN", value_name = "ADDRESS:PORT")]
    pub listen: Option<SocketAddr>,
    /// Additional names of the server, separated by commas; requests for other hosts are refused [default:
    /// the address of --listen and localhost].
    #[arg(long, env = "TANDEM_ALLOWED_HOST", value_name = "NAMES", value_delimiter = ',')]
    pub allowed_host: Option<Vec<String>>,
    /// PEM file with a certificate, to serve HTTPS instead of HTTP, as headsets require; needs --tls-key
    /// [default: none].
    #[arg(long, env = "TANDEM_TLS_CERT", value_name = "FILE")]
    pub tls_cert: Option<PathBuf>,
    /// PEM file with the certificate's private key [default: none].
    #[arg(long, env = "TANDEM_TLS_KEY", value_name = "FILE")]
    pub tls_key: Option<PathBuf>,
    /// File with the token that every request has to send as `Authorization: Bearer TOKEN`; the environment
    /// variable TANDEM_TOKEN can hold the token itself. Required if other machines can reach the address
    /// [default: none].
    #[arg(long, env = "TANDEM_TOKEN_FILE", value_name = "FILE")]
    pub token_file: Option<PathBuf>,
    /// The token itself. It can be neither a flag, because the process list would show it, nor a line of the
    /// settings file.
    #[arg(skip)]
    #[serde(skip)]
    pub token: Option<Token>,
    /// Folder for recordings, one folder per episode [default: runs].
    #[arg(long, env = "TANDEM_RUNS", value_name = "DIR")]
    pub runs: Option<PathBuf>,
    /// Time from which recordings are readable: during the episode, or only after it, which keeps them in
    /// memory until then [default: live].
    #[arg(long, env = "TANDEM_RECORD")]
    pub record: Option<Record>,
    /// Port on which Foxglove shows the episode that began last, live; it is open to this machine alone and
    /// needs no token, so a policy that runs here could read it; 0 picks a free one [default: none].
    #[arg(long, env = "TANDEM_FOXGLOVE", value_name = "PORT")]
    pub foxglove: Option<u16>,
    /// JSON file with instructions in place of the tasks' own: {"handover": {"joint": "...", "robots": {"A":
    /// "..."}}}.
    #[arg(long, env = "TANDEM_INSTRUCTIONS", value_name = "FILE")]
    pub instructions: Option<PathBuf>,
    /// MJCF file of a scene in place of the tasks' own; its site `task` marks the origin of tasks.
    #[arg(long, env = "TANDEM_SCENE", value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// File with a robot in place of the embedded one: MJCF with the embedded robot's joint names, or a TOML
    /// file that maps the joints of another MJCF [default: a Unitree G1 with Dex3-1 hands].
    #[arg(long, env = "TANDEM_ROBOT", value_name = "FILE")]
    pub robot: Option<PathBuf>,
    /// TOML files with your own tasks, separated by commas; a task with the name of a built-in one replaces
    /// it.
    #[arg(long, env = "TANDEM_TASK_FILE", value_name = "FILES", value_delimiter = ',')]
    pub task_file: Option<Vec<PathBuf>>,
    /// ONNX file with a velocity policy for the G1 in place of the built-in base controller; looped:FILE adds
    /// a position loop around it.
    #[arg(long, env = "TANDEM_LOCOMOTION", value_name = "FILE")]
    pub locomotion: Option<PathBuf>,
    /// Source of the robots' own state: an estimator on their sensors, or the simulator, which no real robot
    /// has [default: estimator].
    #[arg(long, env = "TANDEM_STATE_ESTIMATE", value_name = "SOURCE", value_parser = one_of(StateSource::ALL, StateSource::name))]
    pub state_estimate: Option<StateSource>,
    /// Sensor model of the robots: exact, or with the noise, bias and latency of a G1 [default: ideal].
    #[arg(long, env = "TANDEM_SENSORS", value_name = "NAME", value_parser = one_of(SensorModel::ALL, SensorModel::name))]
    pub sensors: Option<SensorModel>,
    /// Disturbance in every episode: one of the stress axes of `evaluate`; results name it [default:
    /// nothing].
    #[arg(long, env = "TANDEM_STRESS", value_name = "AXIS", value_parser = one_of(StressAxis::ALL, StressAxis::name))]
    pub stress: Option<StressAxis>,
    /// Level of the stress, from 1 to 3 [default: 1].
    #[arg(long, env = "TANDEM_LEVEL", value_name = "LEVEL")]
    pub level: Option<StressLevel>,
    /// Renderer of images: `gpu`, `cpu` (embedded), `path` (path tracing on the CPU, a second per look), or
    /// `auto` (a GPU if there is one, otherwise `cpu`) [default: auto].
    #[arg(long, env = "TANDEM_RENDERER", value_name = "NAME", value_parser = one_of(RendererKind::ALL, RendererKind::name))]
    pub renderer: Option<RendererKind>,
    /// Model of the robots' cameras: a pinhole with a perfect sensor, or the G1's own Intel RealSense D435i
    /// with noise, motion blur, distortion and holes in its depth [default: ideal].
    #[arg(long, env = "TANDEM_CAMERA", value_name = "NAME", value_parser = one_of(CameraModel::ALL, CameraModel::name))]
    pub camera: Option<CameraModel>,
    /// Information for policies: `paper` as in the benchmark, with success reported at the end; `full` with
    /// all sensor values, phases as they are reached, and hints on grasping [default: full].
    #[arg(long, env = "TANDEM_ASSISTANCE", value_name = "WHAT", value_parser = one_of(Assistance::ALL, Assistance::name))]
    pub assistance: Option<Assistance>,
    /// For experiments: disclosure of phases, independent of the assistance: `live` in every reply, `end` at
    /// the end, `never` only in files; only with `live` does success end the episode.
    #[arg(long, hide = true, env = "TANDEM_DISCLOSURE", value_name = "WHEN", value_parser = one_of(Disclosure::ALL, Disclosure::name))]
    pub disclosure: Option<Disclosure>,
    /// For experiments: hints on grasping in texts, independent of the assistance.
    #[arg(long, hide = true, env = "TANDEM_HINTS", value_name = "WHETHER", value_parser = one_of(Hints::ALL, Hints::name))]
    pub hints: Option<Hints>,
    /// Limit on a policy's thinking time in an episode, for slow models; results name it [default: that of
    /// the protocol].
    #[arg(long, env = "TANDEM_THINKING_LIMIT", value_name = "SECONDS")]
    pub thinking_limit: Option<u32>,
    /// Maximum number of episodes held at once; each takes a thread and about 7 MB, plus 40 MB shared by all
    /// [default: 8].
    #[arg(long, env = "TANDEM_MAX_EPISODES", value_name = "N")]
    pub max_episodes: Option<u32>,
    /// Maximum size of a request body in bytes [default: 2000000].
    #[arg(long, env = "TANDEM_MAX_BODY_BYTES", value_name = "BYTES")]
    pub max_body_bytes: Option<usize>,
    /// Time limit for the arrival of a request's header, and the same for its body [default: 30].
    #[arg(long, env = "TANDEM_REQUEST_TIMEOUT", value_name = "SECONDS")]
    pub request_timeout: Option<u32>,
    /// Maximum number of concurrent requests; further ones get 503 [default: 256].
    #[arg(long, env = "TANDEM_MAX_REQUESTS", value_name = "N")]
    pub max_requests: Option<usize>,
    /// Maximum number of requests per second from one address; further ones get 429 [default: unlimited].
    #[arg(long, env = "TANDEM_RATE_LIMIT", value_name = "N")]
    pub rate_limit: Option<u32>,
    /// Time without a call after which an episode is ended and its place is free [default: 900].
    #[arg(long, env = "TANDEM_IDLE_TIMEOUT", value_name = "SECONDS")]
    pub idle_timeout: Option<u32>,
    /// Time limit for closing the episodes when the server stops [default: 30].
    #[arg(long, env = "TANDEM_STOP_TIMEOUT", value_name = "SECONDS")]
    pub stop_timeout: Option<u32>,
    /// Durability of a call before it is answered: "system" survives the end of the process, "disk" also a
    /// power cut [default: system].
    #[arg(long, env = "TANDEM_DURABLE", value_name = "HOW")]
    pub durable: Option<Durability>,
    /// URL of this server for other servers on the same runs folder, and for clients that they redirect here
    /// [default: the address].
    #[arg(long, env = "TANDEM_ADVERTISE", value_name = "URL")]
    pub advertise: Option<String>,
}

/// Time from which recordings are readable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Record {
    /// During the episode, as `episode.mcap.partial`.
    Live,
    /// After the episode.
    After,
}

impl Layer {
    /// Default number of episodes that may be held at once.
    pub const MAX_EPISODES: u32 = 8;

    fn or(self, next: Layer) -> Layer {
        Layer {
            listen: self.listen.or(next.listen),
            allowed_host: self.allowed_host.or(next.allowed_host),
            tls_cert: self.tls_cert.or(next.tls_cert),
            tls_key: self.tls_key.or(next.tls_key),
            token_file: self.token_file.or(next.token_file.filter(|_| self.token.is_none())),
            token: self.token.or(next.token),
            runs: self.runs.or(next.runs),
            record: self.record.or(next.record),
            foxglove: self.foxglove.or(next.foxglove),
            instructions: self.instructions.or(next.instructions),
            scene: self.scene.or(next.scene),
            robot: self.robot.or(next.robot),
            task_file: self.task_file.or(next.task_file),
            locomotion: self.locomotion.or(next.locomotion),
            state_estimate: self.state_estimate.or(next.state_estimate),
            sensors: self.sensors.or(next.sensors),
            stress: self.stress.or(next.stress),
            level: self.level.or(next.level),
            renderer: self.renderer.or(next.renderer),
            camera: self.camera.or(next.camera),
            assistance: self.assistance.or(next.assistance),
            disclosure: self.disclosure.or(next.disclosure),
            hints: self.hints.or(next.hints),
            thinking_limit: self.thinking_limit.or(next.thinking_limit),
            max_episodes: self.max_episodes.or(next.max_episodes),
            max_body_bytes: self.max_body_bytes.or(next.max_body_bytes),
            request_timeout: self.request_timeout.or(next.request_timeout),
            max_requests: self.max_requests.or(next.max_requests),
            rate_limit: self.rate_limit.or(next.rate_limit),
            idle_timeout: self.idle_timeout.or(next.idle_timeout),
            stop_timeout: self.stop_timeout.or(next.stop_timeout),
            durable: self.durable.or(next.durable),
            advertise: self.advertise.or(next.advertise),
        }
    }

    /// Returns these settings, with missing settings filled in from the file at `config`.
    pub fn over_file(self, config: &Path) -> Result<Layer, SettingsError> {
        Ok(self.or(read_layer(config)?))
    }

    /// Returns the address to serve on.
    pub fn address(&self) -> SocketAddr {
        self.listen.unwrap_or(SocketAddr::from(([127, 0, 0, 1], 8700)))
    }

    /// Returns the token, if one is given. A token is required unless only this machine can reach the
    /// address.
    pub fn find_token(&self) -> Result<Option<Token>, SettingsError> {
        let token = match (&self.token_file, &self.token) {
            (Some(_), Some(_)) => return Err(SettingsError::TwoTokens),
            (Some(path), None) if path.as_os_str().is_empty() => {
                return Err(TokenError::Empty { setting: "token_file" }.into());
            }
            (Some(path), None) => Some(Token::read(path)?),
            (None, token) => token.clone(),
        };
        let listen = self.address();
        if token.is_none() && !listen.ip().to_canonical().is_loopback() {
            return Err(SettingsError::Open { listen });
        }
        Ok(token)
    }

    /// Returns the certificate for HTTPS, if there is one.
    pub fn certificate(&self) -> Result<Option<Certificate>, TlsError> {
        Certificate::of(self.tls_cert.as_deref(), self.tls_key.as_deref())
    }

    /// Returns the folder for recordings.
    pub fn runs_folder(&self) -> PathBuf {
        self.runs.clone().unwrap_or_else(|| "runs".into())
    }

    /// Reads the task files, and adds them to the benchmark's tasks.
    pub fn read_tasks(&self) -> Result<TaskSet, SettingsError> {
        let files = self.task_file.iter().flatten();
        Ok(TaskSet::with_files(files.map(|path| read_task_file(path)).collect::<Result<_, _>>()?))
    }

    /// Reads the instructions for `tasks` from the file. Without a file, the instructions in the tasks apply.
    pub fn read_instructions(&self, tasks: &TaskSet) -> Result<Instructions, InstructionsError> {
        let path = self.instructions.as_deref();
        path.map_or_else(|| Ok(Instructions::default()), |path| Instructions::read(path, tasks))
    }

    /// Reads the robots' description.
    pub fn read_robot(&self) -> Result<RobotFile, SimError> {
        read_robot(self.robot.as_deref())
    }

    /// Returns the base controller, whose file is not read yet.
    pub fn controller(&self) -> Controller {
        Controller::from_file(self.locomotion.as_deref())
    }

    /// Returns the state estimator and sensor model of the robots.
    pub fn sensing(&self) -> Sensing {
        Sensing {
            state_estimate: self.state_estimate.unwrap_or_default(),
            sensors: self.sensors.unwrap_or_default(),
        }
    }

    /// Returns the stress of every episode, if any.
    pub fn stress(&self) -> Option<Stress> {
        self.stress.map(|axis| Stress { axis, level: self.level.unwrap_or(StressLevel::One) })
    }

    /// Returns the renderer.
    pub fn renderer(&self) -> RendererKind {
        self.renderer.unwrap_or_default()
    }

    /// Returns the model of the robots' cameras.
    pub fn camera(&self) -> CameraModel {
        self.camera.unwrap_or_default()
    }
}

/// All settings, resolved.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Address to serve on; port 0 picks a free one.
    pub listen: SocketAddr,
    /// Host names of the server besides its address and localhost.
    pub allowed_hosts: Vec<String>,
    /// Certificate for HTTPS; `None` for plain HTTP.
    pub certificate: Option<Certificate>,
    /// Token that every request needs.
    pub token: Option<Token>,
    /// Folder for recordings, one folder per episode.
    pub runs: PathBuf,
    /// Time from which recordings are readable.
    pub record: Visibility,
    /// Live view in Foxglove.
    pub foxglove: Option<FoxgloveServer>,
    /// Tasks that can be played.
    pub tasks: TaskSet,
    /// Instructions that replace those of the tasks.
    pub instructions: Instructions,
    /// Scene that replaces those of the tasks.
    pub scene: Option<SceneFile>,
    /// Description of the robots.
    pub robot: RobotFile,
    /// The base controller of every robot.
    pub locomotion: Controller,
    /// State estimator and sensor model of the robots.
    pub sensing: Sensing,
    /// Stress of every episode.
    pub stress: Option<Stress>,
    /// Velocity limits of the base controller.
    pub base_limits: BaseLimits,
    /// Renderer of camera images.
    pub renderer: RendererKind,
    /// Model of the robots' cameras.
    pub camera: CameraModel,
    /// Amount of information that policies get.
    pub assistance: Assistance,
    /// Disclosure of success to policies.
    pub disclosure: Disclosure,
    /// Hints on grasping in policies' texts.
    pub hints: Hints,
    /// Limit on a policy's thinking time in seconds; `None` for the limit of the protocol.
    pub thinking_limit_s: Option<u32>,
    /// Maximum number of episodes held at once.
    pub max_episodes: u32,
    /// Maximum size of a request body in bytes.
    pub max_body_bytes: usize,
    /// Time limit for receiving a request's header, and again for its body.
    pub request_timeout: Duration,
    /// Maximum number of concurrent requests.
    pub max_requests: usize,
    /// Maximum number of requests per second from one address; `None` for no limit.
    pub rate_limit: Option<u32>,
    /// Time without a call after which an episode counts as abandoned.
    pub idle_timeout: Duration,
    /// Time limit for closing the episodes at shutdown.
    pub stop_timeout: Duration,
    /// Durability of a call before it is answered.
    pub durability: Durability,
    /// URL at which other servers and their clients reach this server; `None` if it is the address.
    pub advertised_url: Option<String>,
}

impl Settings {
    /// Returns the wording of the texts for policies.
    pub fn wording(&self) -> Wording {
        Wording { hints: self.hints, ..self.assistance.into() }
    }

    /// Returns the destination of an episode's files.
    pub fn run_folder(&self, path: PathBuf, visibility: Visibility) -> RunFolder {
        let live = self.foxglove.clone().map(|server| Arc::new(server) as Arc<dyn LiveViewer>);
        RunFolder { path, visibility, pages: true, live }
    }

    /// Returns the specification of an episode with these settings.
    pub fn spec(&self, start: &StartEpisode) -> Result<EpisodeSpec, EpisodeError> {
        let protocol = start.protocol.unwrap_or(Protocol::Agentic);
        Ok(EpisodeSpec {
            scene: self.scene.clone(),
            robot: self.robot.clone(),
            locomotion: self.locomotion.clone(),
            sensing: self.sensing,
            stress: self.stress,
            renderer: self.renderer,
            camera: self.camera,
            assistance: self.assistance,
            disclosure: self.disclosure,
            hints: self.hints,
            instructions: self.instructions.own_words(&start.task),
            thinking_limit_s: self.thinking_limit_s,
            ..EpisodeSpec::new(self.tasks.find(&start.task)?, start.seed, protocol)
        })
    }

    /// Fills settings missing in `flags` (which include the environment) from the file at `config`, then
    /// from defaults.
    pub fn resolve(flags: Layer, config: Option<&Path>) -> Result<Arc<Settings>, SettingsError> {
        let file = match config {
            Some(path) => read_layer(path)?,
            None => Layer::default(),
        };
        Settings::from_layer(flags.or(file))
    }

    fn from_layer(layer: Layer) -> Result<Arc<Settings>, SettingsError> {
        layer.check()?;
        let locomotion = layer.controller();
        let renderer = layer.renderer();
        let tasks = layer.read_tasks()?;
        let robot = layer.read_robot()?;
        let assistance = layer.assistance.unwrap_or_default();
        tracing::info!("{}", renderer.describe()?);
        let seconds = |given: Option<u32>, default: u32| Duration::from_secs(given.unwrap_or(default).into());
        Ok(Arc::new(Settings {
            listen: layer.address(),
            certificate: layer.certificate()?,
            token: layer.find_token()?,
            runs: layer.runs_folder(),
            record: match layer.record {
                None | Some(Record::Live) => Visibility::Live,
                Some(Record::After) => Visibility::After,
            },
            foxglove: layer.foxglove.map(FoxgloveServer::on),
            instructions: layer.read_instructions(&tasks)?,
            tasks,
            scene: layer.scene.as_deref().map(read_scene).transpose()?,
            base_limits: locomotion.limits(&robot)?,
            robot,
            locomotion,
            sensing: layer.sensing(),
            stress: layer.stress(),
            renderer,
            camera: layer.camera(),
            assistance,
            disclosure: layer.disclosure.unwrap_or(assistance.disclosure()),
            hints: layer.hints.unwrap_or(assistance.hints()),
            allowed_hosts: layer.allowed_host.unwrap_or_default(),
            thinking_limit_s: layer.thinking_limit,
            max_episodes: layer.max_episodes.unwrap_or(Layer::MAX_EPISODES),
            max_body_bytes: layer.max_body_bytes.unwrap_or(2_000_000),
            request_timeout: seconds(layer.request_timeout, 30),
            max_requests: layer.max_requests.unwrap_or(256),
            rate_limit: layer.rate_limit,
            idle_timeout: seconds(layer.idle_timeout, 15 * 60),
            stop_timeout: seconds(layer.stop_timeout, 30),
            durability: layer.durable.unwrap_or_default(),
            advertised_url: layer.advertise,
        }))
    }
}

/// Returns a parser for a flag whose value is the name of an element of `all`. `--help` and errors list the
/// names.
pub fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.map(name)).try_map(move |found: String| {
        all.into_iter().find(|value| name(*value) == found).ok_or("not one of the names")
    })
}

fn read_layer(path: &Path) -> Result<Layer, SettingsError> {
    let text = read_text(path, MAX_TEXT_BYTES)
        .map_err(|source| SettingsError::Read { path: path.into(), source })?;
    toml::from_str(&text).map_err(|source| SettingsError::Parse { path: path.into(), source })
}

/// Reads a task file and checks the task with seed 0. Logs problems that may be intended.
pub fn read_task_file(path: &Path) -> Result<Task, SettingsError> {
    let task = read_task(path)?;
    let check = check_task(&task, &[FIRST_SEED], None)
        .map_err(|source| SettingsError::Task { path: path.into(), source: source.into() })?;
    check.falls.iter().chain(&check.notes).for_each(|line| tracing::warn!("{}: {line}", task.id));
    Ok(task)
}

/// Seed with which a task file is checked.
const FIRST_SEED: u32 = 0;

/// Reads a scene, and logs where its file deviates from MuJoCo.
pub fn read_scene(path: &Path) -> Result<SceneFile, SimError> {
    let (scene, approximations) = SceneFile::with_approximations(path)?;
    approximations.iter().for_each(|line| tracing::warn!("not quite as in MuJoCo: {line}"));
    Ok(scene)
}

/// Reads the robot from a file, or returns the embedded one. Logs where the file deviates from MuJoCo.
pub fn read_robot(path: Option<&Path>) -> Result<RobotFile, SimError> {
    let Some(path) = path else { return Ok(RobotFile::default()) };
    let (robot, approximations) = RobotFile::with_approximations(path)?;
    approximations.iter().for_each(|line| tracing::warn!("not quite as in MuJoCo: {line}"));
    Ok(robot)
}

#[cfg(test)]
mod tests;
