//! What to play: which episodes there are, and which of them are this process's share.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use tandem_sim::{Sensing, render::RendererKind};
use tandem_tools_spec::{Assistance, Disclosure, Hints, Protocol};

use super::retry::FailedEpisode;
use crate::instructions::Instructions;
use crate::players::Policy;
use crate::recording::Recorder;
use crate::scoring::Phase;
use crate::spec::{Controller, EpisodeSpec, KeyedSeed, MomentStart, PhaseStart, RobotFile, SceneFile, Start};
use crate::stress::Stress;
use crate::tasks::Task;
use crate::variation::Variation;

/// What to play.
#[derive(Clone, Debug)]
pub struct EvaluationPlan<'a> {
    /// Who plays.
    pub player: &'a dyn Policy,
    pub protocol: Protocol,
    /// The scene, in place of the tasks' own.
    pub scene: Option<SceneFile>,
    pub robot: RobotFile,
    pub locomotion: Controller,
    /// What robots know of themselves.
    pub sensing: Sensing,
    pub renderer: RendererKind,
    /// How much policies are told.
    pub assistance: Assistance,
    /// What they are told about their success, and whether success ends an episode.
    pub disclosure: Disclosure,
    /// Whether they are told how to grasp.
    pub hints: Hints,
    /// Words in place of the tasks' own.
    pub instructions: Instructions,
    /// In what episodes vary beyond the benchmark.
    pub variation: Variation,
    /// What goes wrong in them.
    pub stress: Option<Stress>,
    /// How long a policy may think in an episode, if not as long as the protocol has it.
    pub thinking_limit_s: Option<u32>,
    pub tasks: Vec<&'static Task>,
    pub seeds: Vec<u32>,
    pub starts: Starts,
    pub shard: Shard,
    /// Worlds that run side by side, each on a thread of its own.
    pub jobs: usize,
    /// Record every episode in a folder of its own (`episode.mcap`, `strip.png`, `report.html`).
    pub record: bool,
    /// Which of these files stay.
    pub files: KeptFiles,
    /// How often an episode in which the policy itself failed is played again, by one run after another, before it counts as a failure.
    pub retries: u32,
    /// What draws worlds for seeds that are public, if anything does.
    pub seed_key: Option<SeedKey>,
    /// What becomes of a run that the folder holds already.
    pub existing: ExistingRun,
}

/// What an evaluator's key makes of the seeds of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct SeedKey {
    /// Names the key in results and tells nothing of it.
    pub fingerprint: String,
    /// What it draws for each seed.
    pub drawn: BTreeMap<u32, u32>,
}

impl SeedKey {
    fn of(&self, seed: u32) -> Option<KeyedSeed> {
        let drawn = *self.drawn.get(&seed)?;
        Some(KeyedSeed { key_fingerprint: self.fingerprint.clone(), drawn })
    }
}

/// What becomes of a run that a folder holds already. The same run goes on in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExistingRun {
    /// Another run is left as it is, and the evaluation refused.
    #[default]
    Refuse,
    /// The same run of another build goes on with this build; what it holds is kept.
    ResumeWithNewBuild,
    /// It is deleted.
    Overwrite,
}

/// What is kept of episodes that are recorded; by default everything.
#[derive(Clone, Copy, Debug)]
pub struct KeptFiles {
    /// Whether each has `strip.png` and `report.html`.
    pub pages: bool,
    /// Whether of an episode that failed nothing is kept but what it came to.
    pub only_successful: bool,
}

impl Default for KeptFiles {
    fn default() -> KeptFiles {
        KeptFiles { pages: true, only_successful: false }
    }
}

/// Where the episodes begin.
#[derive(Clone, Debug)]
pub enum Starts {
    /// They begin at the task's own beginning, and every phase counts.
    Task,
    /// Each begins where one of these phases began in a demonstration of the same task and seed, and that phase alone counts.
    Phases {
        /// What `tandem collect` or `tandem serve` wrote.
        demonstrations: PathBuf,
        /// Numbers or ids, as `p2` or `transfer`; a task without such a phase has no episode of it.
        phases: Vec<String>,
        /// Begins in the training demonstrations, whose seeds replace the plan's.
        training: bool,
    },
    /// Each begins some seconds before the moment at which one of these went wrong, in its world; tasks and seeds are theirs.
    Moments { failed: Vec<FailedEpisode>, before_s: u32 },
}

/// The share of one process: every episode whose number leaves this remainder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub index: usize,
    pub of: usize,
}

impl Shard {
    /// The share of a process that plays everything.
    pub const WHOLE: Shard = Shard { index: 0, of: 1 };
}

impl EvaluationPlan<'_> {
    /// How often an episode is played again by default.
    pub const DEFAULT_RETRIES: u32 = 2;

    /// One of the episodes to play.
    pub fn spec(&self, task: &'static Task, seed: u32, start: Start) -> EpisodeSpec {
        EpisodeSpec {
            robot: self.robot.clone(),
            scene: self.scene.clone(),
            locomotion: self.locomotion.clone(),
            sensing: self.sensing,
            renderer: self.renderer,
            assistance: self.assistance,
            disclosure: self.disclosure,
            hints: self.hints,
            instructions: self.instructions.own_words(task.id),
            variation: self.variation,
            stress: self.stress,
            thinking_limit_s: self.thinking_limit_s,
            start,
            ..EpisodeSpec::new(task, seed, self.protocol)
        }
        .keyed(self.seed_key.as_ref().and_then(|key| key.of(seed)))
    }

    /// One that begins again where a recorded one had not gone wrong yet: its world, under this plan's rules.
    fn again(&self, failed: &FailedEpisode, before_s: u32) -> EpisodeSpec {
        let FailedEpisode { spec, recording, .. } = failed;
        let control_step = failed.step_before(before_s);
        let start = Start::Moment(MomentStart {
            recording: recording.clone(),
            control_step,
            before_s: Some(before_s),
        });
        EpisodeSpec {
            scene: spec.scene.clone(),
            robot: spec.robot.clone(),
            locomotion: spec.locomotion.clone(),
            sensing: spec.sensing,
            variation: spec.variation,
            stress: spec.stress,
            ..self.spec(spec.task, spec.seed, start)
        }
        .keyed(spec.keyed_seed.clone())
    }

    /// What in its episodes is not as the benchmark has it.
    pub fn departures(&self) -> Vec<String> {
        self.named(EpisodeSpec::departures)
    }

    /// What in its episodes is not as Tandem usually has it.
    pub fn peculiarities(&self) -> Vec<String> {
        self.named(EpisodeSpec::peculiarities)
    }

    /// What is named of its episodes: the same in all of them, but for the files of tasks, for words, and for what has been begun again.
    fn named(&self, of: fn(&EpisodeSpec) -> Vec<String>) -> Vec<String> {
        let specs: Vec<EpisodeSpec> = match &self.starts {
            Starts::Task | Starts::Phases { .. } => {
                let seed = self.seeds.first().copied().unwrap_or_default();
                self.tasks.iter().map(|task| self.spec(task, seed, Start::Task)).collect()
            }
            Starts::Moments { failed, before_s } => {
                failed.iter().map(|failed| self.again(failed, *before_s)).collect()
            }
        };
        let mut found: Vec<String> = Vec::new();
        for what in specs.iter().flat_map(of) {
            if !found.contains(&what) {
                found.push(what);
            }
        }
        found
    }

    /// This share of the episodes, and which of it are left out because nobody has demonstrated them.
    pub fn episodes(&self) -> (Vec<EpisodeSpec>, Vec<String>) {
        let (mut found, mut left_out) = (Vec::new(), Vec::new());
        let is_own = |number: &usize| number % self.shard.of == self.shard.index;
        if let Starts::Moments { failed, before_s } = &self.starts {
            let own = failed.iter().enumerate().filter(|(number, _)| is_own(number));
            return (own.map(|(_, failed)| self.again(failed, *before_s)).collect(), left_out);
        }
        let of_tasks =
            self.tasks.iter().flat_map(|task| self.seeds_of(task).into_iter().map(|seed| (*task, seed)));
        let everything = of_tasks
            .flat_map(|(task, seed)| self.starts_of(task).into_iter().map(move |phase| (task, seed, phase)));
        let own = everything.enumerate().filter(|(number, _)| is_own(number));
        for (_, (task, seed, phase)) in own {
            let start = match (&self.starts, phase) {
                (Starts::Phases { demonstrations, .. }, Some(phase)) => {
                    match demonstration(demonstrations, task, seed) {
                        Some(recording) => Start::Phase(PhaseStart { recording, phase }),
                        None => {
                            left_out.push(format!("{} seed {seed} {phase}: no demonstration", task.id));
                            continue;
                        }
                    }
                }
                (Starts::Task | Starts::Phases { .. } | Starts::Moments { .. }, _) => Start::Task,
            };
            found.push(self.spec(task, seed, start));
        }
        (found, left_out)
    }

    /// The seeds that are played of `task`.
    fn seeds_of(&self, task: &Task) -> Vec<u32> {
        match &self.starts {
            Starts::Phases { demonstrations, training: true, .. } => training_seeds(demonstrations, task),
            Starts::Task | Starts::Phases { .. } | Starts::Moments { .. } => self.seeds.clone(),
        }
    }

    /// Numbers of the phases that episodes of `task` begin at; `None` for its own beginning.
    fn starts_of(&self, task: &Task) -> Vec<Option<String>> {
        match &self.starts {
            Starts::Task | Starts::Moments { .. } => vec![None],
            Starts::Phases { phases, .. } => {
                let of_task =
                    task.phases.iter().enumerate().map(|(index, phase)| (Phase::number(index), phase.id));
                let named = |(number, id): (String, &str)| {
                    phases.iter().any(|name| *name == number || name == id).then_some(number)
                };
                of_task.filter_map(named).map(Some).collect()
            }
        }
    }
}

/// Number of training demonstrations of a task: the benchmark's, and that of the split by `tandem export`.
const MAX_TRAINING_DEMONSTRATIONS: usize = 50;

/// Folders of a task's demonstrations, each with the prefix of their names before the seed.
///
/// `collect` and `serve` write them so.
fn demonstration_folders(folder: &Path, task: &Task) -> [(PathBuf, String); 3] {
    let id = task.id;
    let (collected, served) = (format!("{id}-"), format!("{id}-seed"));
    [(folder.join("episodes"), collected.clone()), (folder.into(), collected), (folder.into(), served)]
}

/// The recording of a task and seed.
fn demonstration(folder: &Path, task: &Task, seed: u32) -> Option<PathBuf> {
    let recordings = demonstration_folders(folder, task)
        .map(|(folder, begins)| folder.join(format!("{begins}{seed}")).join(Recorder::FILE_NAME));
    recordings.into_iter().find(|recording| recording.exists())
}

/// Returns the seeds of a task's training demonstrations in a folder: the lowest ones.
pub fn training_seeds(folder: &Path, task: &Task) -> Vec<u32> {
    let mut seeds = BTreeSet::new();
    for (folder, begins) in demonstration_folders(folder, task) {
        let names = fs::read_dir(folder)
            .into_iter()
            .flatten()
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        seeds.extend(names.filter_map(|name| name.strip_prefix(&begins)?.parse::<u32>().ok()));
    }
    seeds
        .into_iter()
        .filter(|seed| demonstration(folder, task, *seed).is_some())
        .take(MAX_TRAINING_DEMONSTRATIONS)
        .collect()
}
