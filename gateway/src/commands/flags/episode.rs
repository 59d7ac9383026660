//! The flags that say which episodes to play, and by robots of which kind.

use std::{ops::RangeInclusive, path::PathBuf, str::FromStr};

use clap::Args;
use tandem_episodes::{
    Controller, RendererKind, RobotFile, SceneFile, Sensing, SensorModel, SimError, StateSource,
    evaluation::{EvaluationPlan, Shard, Starts},
    players::Policy,
    tasks::{self, Task},
};
use tandem_tools_spec::{Assistance, Disclosure, Hints, Protocol};

use crate::settings::{one_of, read_scene};

/// Which episodes to play.
#[derive(Debug, Args)]
pub struct EpisodeFlags {
    /// Task ids separated by commas, or `all`.
    #[arg(long, default_value = "all", value_name = "TASKS", value_parser = parse_tasks)]
    tasks: TaskList,
    /// One seed, or a range of seeds as 0-9 or 0..9, both ends included.
    #[arg(long, default_value = "0-9", value_name = "SEEDS")]
    seeds: Seeds,
    /// The rules.
    #[arg(long, value_parser = one_of(Protocol::ALL, Protocol::name), default_value = Protocol::Agentic.name())]
    protocol: Protocol,
    /// What policies are told, as for `serve` [default: paper for evaluate, full for collect].
    #[arg(long, env = "TANDEM_ASSISTANCE", value_name = "WHAT", value_parser = one_of(Assistance::ALL, Assistance::name))]
    assistance: Option<Assistance>,
    /// For experiments: what is told of phases, whatever the assistance has; only `live` ends an episode on success.
    #[arg(long, hide = true, env = "TANDEM_DISCLOSURE", value_name = "WHEN", value_parser = one_of(Disclosure::ALL, Disclosure::name))]
    disclosure: Option<Disclosure>,
    /// For experiments: whether texts say how to grasp, whatever the assistance has.
    #[arg(long, hide = true, env = "TANDEM_HINTS", value_name = "WHETHER", value_parser = one_of(Hints::ALL, Hints::name))]
    hints: Option<Hints>,
    /// Worlds that run side by side.
    #[arg(long, default_value_t = 1, value_name = "N")]
    jobs: usize,
    #[command(flatten)]
    scene: SceneFlag,
    #[command(flatten)]
    locomotion: LocomotionFlag,
    #[command(flatten)]
    sensing: SensingFlags,
    #[command(flatten)]
    renderer: RendererFlag,
}

/// The scene on the command line.
#[derive(Debug, Args)]
pub struct SceneFlag {
    /// MJCF file of a scene in place of the tasks' own; its site `task` says where.
    #[arg(long = "scene", env = "TANDEM_SCENE", value_name = "FILE")]
    pub file: Option<PathBuf>,
}

impl SceneFlag {
    /// Reads the scene from the file that the flag names.
    fn read(&self) -> Result<Option<SceneFile>, SimError> {
        self.file.as_deref().map(read_scene).transpose()
    }
}

/// The base controller on the command line.
#[derive(Debug, Args)]
pub struct LocomotionFlag {
    /// ONNX file with a velocity policy for the G1 in place of our own base controller; looped:FILE puts a loop over the robot's place around it.
    #[arg(long = "locomotion", env = "TANDEM_LOCOMOTION", value_name = "FILE")]
    pub file: Option<PathBuf>,
}

impl LocomotionFlag {
    /// Which controller the flag names; its file is not read yet.
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
    pub state_estimate: StateSource,
    /// What robots sense: everything exactly, or with noise, bias and latency as a G1 does.
    #[arg(long, env = "TANDEM_SENSORS", value_name = "NAME", value_parser = one_of(SensorModel::ALL, SensorModel::name))]
    #[arg(default_value = SensorModel::default().name())]
    pub sensors: SensorModel,
}

impl SensingFlags {
    /// Both as one value.
    pub fn sensing(&self) -> Sensing {
        Sensing { state_estimate: self.state_estimate, sensors: self.sensors }
    }
}

/// The renderer on the command line.
#[derive(Debug, Args)]
pub struct RendererFlag {
    /// Who draws pictures: a graphics processor, the embedded renderer, or whichever is there.
    #[arg(long = "renderer", env = "TANDEM_RENDERER", value_name = "NAME", value_parser = one_of(RendererKind::ALL, RendererKind::name),
          default_value = RendererKind::default().name())]
    pub kind: RendererKind,
}

/// Tasks named on the command line. The name keeps clap from taking it for a flag that is given several times.
#[derive(Debug, Clone)]
struct TaskList(Vec<&'static Task>);

/// The tasks that `text` names: `all`, or ids separated by commas.
fn parse_tasks(text: &str) -> Result<TaskList, String> {
    let found: Result<_, _> = match text {
        "all" => Ok(tasks::ALL.iter().collect()),
        ids => ids.split(',').map(|id| tasks::find(id.trim())).collect(),
    };
    found.map(TaskList).map_err(|error: tandem_episodes::EpisodeError| error.to_string())
}

impl EpisodeFlags {
    /// The plan to have `player` play these episodes, told as `assistance` says where no flag does.
    pub fn plan(
        self,
        player: &dyn Policy,
        record: bool,
        assistance: Assistance,
    ) -> Result<EvaluationPlan<'_>, SimError> {
        let assistance = self.assistance.unwrap_or(assistance);
        let disclosure = self.disclosure.unwrap_or(assistance.disclosure());
        let hints = self.hints.unwrap_or(assistance.hints());
        tracing::info!("{}", assistance.about(disclosure, hints));
        tracing::info!("{}", self.renderer.kind.describe()?);
        Ok(EvaluationPlan {
            player,
            protocol: self.protocol,
            scene: self.scene.read()?,
            robot: RobotFile::default(),
            locomotion: self.locomotion.controller(),
            sensing: self.sensing.sensing(),
            assistance,
            disclosure,
            hints,
            renderer: self.renderer.kind,
            tasks: self.tasks.0,
            seeds: self.seeds.0.collect(),
            starts: Starts::Task,
            shard: Shard::WHOLE,
            jobs: self.jobs,
            record,
            keep_failed: false,
        })
    }
}

/// Seeds on the command line, in every command that takes any: `3`, or `0-9`, or `0..9`, with both ends included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds(pub RangeInclusive<u32>);

/// A text that names no seeds.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("{0:?} names no seeds; give one, as 3, or a range with both ends included, as 0-9 or 0..9")]
pub struct SeedsError(String);

impl FromStr for Seeds {
    type Err = SeedsError;

    fn from_str(text: &str) -> Result<Self, SeedsError> {
        let number = |part: &str| part.parse::<u32>().map_err(|_| SeedsError(text.into()));
        let range = match text.split_once("..").or_else(|| text.split_once('-')) {
            Some((first, last)) => number(first)?..=number(last)?,
            None => number(text)?..=number(text)?,
        };
        if range.is_empty() {
            return Err(SeedsError(text.into()));
        }
        Ok(Seeds(range))
    }
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;
    use crate::cli::Cli;

    #[test]
    fn texts_name_seeds() {
        let check = |text: &str, expected: Option<RangeInclusive<u32>>| {
            assert_eq!(text.parse::<Seeds>().ok().map(|seeds| seeds.0), expected, "{text:?}");
        };
        check("0", Some(0..=0));
        check("7", Some(7..=7));
        check("0..9", Some(0..=9));
        check("0-9", Some(0..=9));
        check("4..4", Some(4..=4));
        check("9..0", None);
        check("-1", None);
        check("..9", None);
        check("ten", None);
        check("", None);
        check("4294967296", None);
    }

    /// What a flag for seeds says of itself in each command that has one, under the command.
    fn help_on_seeds(command: &clap::Command, path: &str, found: &mut Vec<(String, String)>) {
        for of in command.get_subcommands() {
            let path = format!("{path} {}", of.get_name());
            let is_seeds = |flag: &&clap::Arg| flag.get_long().is_some_and(|name| name.starts_with("seed"));
            if let Some(flag) = of.get_arguments().find(is_seeds) {
                let name = flag.get_long().unwrap_or_default();
                let help = flag.get_help().map(ToString::to_string).unwrap_or_default();
                // With what else has to be given.
                let required = of.get_arguments().filter(|flag| flag.is_required_set());
                let line: String = required
                    .filter_map(|flag| Some(format!(" --{} x", flag.get_long()?)))
                    .fold(path.clone(), |line, flag| line + &flag);
                found.push((line, format!("--{name}: {help}")));
            }
            help_on_seeds(of, &path, found);
        }
    }

    #[test]
    fn seeds_mean_the_same_in_every_command() {
        let mut found = Vec::new();
        help_on_seeds(&Cli::command(), "tandem", &mut found);
        assert!(found.len() >= 4, "{found:?}");
        let same = "--seeds: One seed, or a range of seeds as 0-9 or 0..9, both ends included";
        for (path, help) in &found {
            assert_eq!(help, same, "{path}");
            let read = |seeds: &str| Cli::try_parse_from(path.split(' ').chain(["--seeds", seeds])).is_ok();
            assert!(read("3") && read("0-9") && read("0..9"), "{path}");
            assert!(!read("9-0") && !read("ten"), "{path}");
        }
    }
}
