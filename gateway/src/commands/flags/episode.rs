//! The flags for the choice of episodes.

use std::{error::Error, ops::RangeInclusive, path::PathBuf, str::FromStr};

use clap::Args;
use tandem_episodes::{
    EpisodeError, Instructions, TANDEM_PLUS, Variation, tandem_plus,
    tasks::{self, Spread, Task, TaskSet},
};
use tandem_evaluation::evaluation::{EvaluationPlan, ExistingRun, KeptFiles, Shard, Starts};
use tandem_evaluation::policies::Policy;
use tandem_tools_spec::{Assistance, Disclosure, Hints, Protocol};

use super::{WorldFlags, read_seed_key};
use crate::settings::one_of;

/// Flags for the choice of episodes.
#[derive(Debug, Args)]
pub struct EpisodeFlags {
    /// Ids of built-in tasks separated by commas, or `all` for the benchmark's ten, or `tandem+` for that
    /// suite [default: none with --task-file, and else all].
    #[arg(long, value_name = "TASKS", value_parser = parse_tasks)]
    tasks: Option<TaskList>,
    /// One seed, or a range of seeds as 0-9 or 0..9, both ends included.
    #[arg(long, default_value = "0-9", value_name = "SEEDS")]
    seeds: Seeds,
    /// File with your own secret key, which changes the meaning of seeds, so that no one without it can
    /// simulate an episode in advance. Results name the key's fingerprint. Without a key, a seed means the
    /// same everywhere.
    #[arg(long, value_name = "FILE")]
    seed_key: Option<PathBuf>,
    /// Rules of play.
    #[arg(long, value_parser = one_of(Protocol::ALL, Protocol::name), default_value = Protocol::Agentic.name())]
    protocol: Protocol,
    /// Information for policies, as in `serve` [default: paper for evaluate, full for collect].
    #[arg(long, env = "TANDEM_ASSISTANCE", value_name = "WHAT", value_parser = one_of(Assistance::ALL, Assistance::name))]
    assistance: Option<Assistance>,
    /// For experiments: disclosure of phases, independent of the assistance; only `live` ends an episode on
    /// success.
    #[arg(long, hide = true, env = "TANDEM_DISCLOSURE", value_name = "WHEN", value_parser = one_of(Disclosure::ALL, Disclosure::name))]
    disclosure: Option<Disclosure>,
    /// For experiments: hints on grasping in texts, independent of the assistance.
    #[arg(long, hide = true, env = "TANDEM_HINTS", value_name = "WHETHER", value_parser = one_of(Hints::ALL, Hints::name))]
    hints: Option<Hints>,
    /// JSON file with instructions in place of the tasks' own, as in `serve`; results name them.
    #[arg(long, env = "TANDEM_INSTRUCTIONS", value_name = "FILE")]
    instructions: Option<PathBuf>,
    /// Range of the randomised object poses, as a multiple of the benchmark's; above 1, objects are also
    /// rotated.
    #[arg(long, value_name = "TIMES", value_parser = one_of(Spread::ALL, Spread::name), default_value = Spread::default().name())]
    spread: Spread,
    /// Limit on a policy's thinking time in an episode, for slow models; results name it [default: that of
    /// the protocol].
    #[arg(long, env = "TANDEM_THINKING_LIMIT", value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..))]
    thinking_limit: Option<u32>,
    /// Number of worlds that run in parallel.
    #[arg(long, default_value_t = 1, value_name = "N")]
    jobs: usize,
    #[command(flatten)]
    world: WorldFlags,
}

/// Tasks given on the command line. The separate type keeps clap from treating them as a flag that can be
/// given several times.
#[derive(Debug, Clone)]
struct TaskList(Vec<Task>);

/// Parses built-in tasks: `all` tasks of the benchmark, the name of a suite, or ids separated by commas.
fn parse_tasks(text: &str) -> Result<TaskList, String> {
    let found: Result<_, _> = match text {
        "all" => Ok(tasks::cohub().to_vec()),
        TANDEM_PLUS => Ok(tandem_plus().to_vec()),
        ids => {
            let known = TaskSet::default();
            ids.split(',').map(|id| known.find(id.trim()).cloned()).collect()
        }
    };
    let told = |error: EpisodeError| format!("{error}; those of --task-file are played without being named");
    found.map(TaskList).map_err(told)
}

/// Returns the tasks to play: the tasks of files, and the named built-in tasks that no file replaces. Without
/// either, returns all tasks of the benchmark.
fn played(named: Option<TaskList>, of_files: Vec<Task>) -> Vec<Task> {
    let named = match named {
        Some(TaskList(named)) => named,
        None if of_files.is_empty() => tasks::cohub().to_vec(),
        None => Vec::new(),
    };
    let replaced = |task: &Task| of_files.iter().any(|other| other.id == task.id);
    let built_in: Vec<Task> = named.into_iter().filter(|task| !replaced(task)).collect();
    built_in.into_iter().chain(of_files).collect()
}

impl EpisodeFlags {
    /// Returns the plan for `player` to play these episodes; `assistance` is the default assistance.
    pub fn plan(
        self,
        player: &dyn Policy,
        record: bool,
        assistance: Assistance,
    ) -> Result<EvaluationPlan<'_>, Box<dyn Error>> {
        let of_files = self.world.read_task_files()?;
        let known = TaskSet::with_files(of_files.clone());
        let instructions = self.instructions.as_deref().map(|path| Instructions::read(path, &known));
        let tasks = played(self.tasks, of_files);
        let robot = self.world.read_robot()?;
        let model = robot.model()?;
        tasks.iter().try_for_each(|task| robot.check_task(&model, task))?;
        let assistance = self.assistance.unwrap_or(assistance);
        let disclosure = self.disclosure.unwrap_or(assistance.disclosure());
        let hints = self.hints.unwrap_or(assistance.hints());
        tracing::info!("{}", assistance.about(disclosure, hints));
        tracing::info!("{}", self.world.renderer().describe()?);
        let seeds: Vec<u32> = self.seeds.0.collect();
        let seed_key = self.seed_key.map(|file| read_seed_key(&file, &seeds)).transpose()?;
        Ok(EvaluationPlan {
            player,
            protocol: self.protocol,
            scene: self.world.read_scene()?,
            robot,
            locomotion: self.world.controller(),
            sensing: self.world.sensing(),
            assistance,
            disclosure,
            hints,
            instructions: instructions.transpose()?.unwrap_or_default(),
            variation: Variation { spread: self.spread, ..Variation::default() },
            stress: None,
            thinking_limit_s: self.thinking_limit,
            renderer: self.world.renderer(),
            camera: self.world.camera(),
            tasks,
            seeds,
            starts: Starts::Task,
            shard: Shard::WHOLE,
            jobs: self.jobs,
            record,
            files: KeptFiles::default(),
            retries: EvaluationPlan::DEFAULT_RETRIES,
            seed_key,
            existing: ExistingRun::Refuse,
        })
    }
}

/// Seeds given on the command line, for every command with seeds: `3`, `0-9` or `0..9`, with both ends
/// included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds(pub RangeInclusive<u32>);

/// Maximum number of seeds of one command.
const MAX_SEEDS: u64 = 100_000;

/// A text that names no seeds, or too many.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum SeedsError {
    #[error(
        "{0:?} names no seeds; give one, for example 3, or a range with both ends included, for example 0-9 \
         or 0..9"
    )]
    NoSeeds(String),
    #[error("{text:?} names {seeds} seeds; give at most {MAX_SEEDS} in one command")]
    TooMany { text: String, seeds: u64 },
}

impl FromStr for Seeds {
    type Err = SeedsError;

    fn from_str(text: &str) -> Result<Self, SeedsError> {
        let number = |part: &str| part.parse::<u32>().map_err(|_| SeedsError::NoSeeds(text.into()));
        let range = match text.split_once("..").or_else(|| text.split_once('-')) {
            Some((first, last)) => number(first)?..=number(last)?,
            None => number(text)?..=number(text)?,
        };
        if range.is_empty() {
            return Err(SeedsError::NoSeeds(text.into()));
        }
        let seeds = u64::from(*range.end()) - u64::from(*range.start()) + 1;
        if seeds > MAX_SEEDS {
            return Err(SeedsError::TooMany { text: text.into(), seeds });
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
        check("0-99999", Some(0..=99_999));
        check("4294967295", Some(u32::MAX..=u32::MAX));
        check("0-4294967295", None);
        let told = "0-4294967295".parse::<Seeds>().unwrap_err().to_string();
        assert!(told.contains("4294967296 seeds; give at most 100000"), "{told}");
    }

    /// Collects the help text of the flag for seeds in each command that has one.
    fn help_on_seeds(command: &clap::Command, path: &str, found: &mut Vec<(String, String)>) {
        for of in command.get_subcommands() {
            let path = format!("{path} {}", of.get_name());
            let is_seeds = |flag: &&clap::Arg| flag.get_long().is_some_and(|name| name.starts_with("seed"));
            if let Some(flag) = of.get_arguments().find(is_seeds) {
                let name = flag.get_long().unwrap_or_default();
                let help = flag.get_help().map(ToString::to_string).unwrap_or_default();
                // Required flags are added, including one of each required group.
                let groups = of.get_groups().filter(|group| group.is_required_set());
                let of_groups: Vec<_> = groups.filter_map(|group| group.get_args().next()).collect();
                let is_required =
                    |flag: &&clap::Arg| flag.is_required_set() || of_groups.contains(&flag.get_id());
                let required = of.get_arguments().filter(is_required);
                let line: String = required
                    .map(|flag| flag.get_long().map_or(" x".into(), |name| format!(" --{name} x")))
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
