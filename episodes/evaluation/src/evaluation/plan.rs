//! Plan of an evaluation: its episodes, and this process's share of them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use tandem_episodes::{
    Controller, EpisodeSpec, Instructions, KeyedSeed, MomentStart, Phase, PhaseStart, Recorder, RobotFile,
    SceneFile, Start, Variation, stress::Stress, tasks::Task,
};
use tandem_sim::{
    Sensing,
    render::{CameraModel, RendererKind},
};
use tandem_tools_spec::{Assistance, Disclosure, Hints, Protocol};

use super::retry::FailedEpisode;
use crate::policies::Policy;

/// The plan of an evaluation.
#[derive(Clone, Debug)]
pub struct EvaluationPlan<'a> {
    /// The policy that plays.
    pub player: &'a dyn Policy,
    pub protocol: Protocol,
    /// Scene that replaces the tasks' own scenes.
    pub scene: Option<SceneFile>,
    pub robot: RobotFile,
    pub locomotion: Controller,
    /// Configuration of the robots' sensors and state estimate.
    pub sensing: Sensing,
    pub renderer: RendererKind,
    /// Model of the robots' cameras.
    pub camera: CameraModel,
    /// Level of assistance to policies.
    pub assistance: Assistance,
    /// Feedback to policies about their success, and whether success ends an episode.
    pub disclosure: Disclosure,
    /// Hints to policies on how to grasp.
    pub hints: Hints,
    /// Instructions that replace the tasks' own.
    pub instructions: Instructions,
    /// Variation of the episodes beyond the benchmark.
    pub variation: Variation,
    /// Stress on the episodes.
    pub stress: Option<Stress>,
    /// Limit of a policy's thinking time in an episode; `None` for the protocol's limit.
    pub thinking_limit_s: Option<u32>,
    pub tasks: Vec<Task>,
    pub seeds: Vec<u32>,
    pub starts: Starts,
    pub shard: Shard,
    /// Number of worlds that run in parallel, each on a separate thread.
    pub jobs: usize,
    /// True if every episode is recorded in a separate folder (`episode.mcap`, `strip.png`, `report.html`).
    pub record: bool,
    /// Selection of these files to keep.
    pub files: KeptFiles,
    /// Maximum number of retries, over all runs, of an episode in which the policy itself failed. After these
    /// retries, it counts as a failure.
    pub retries: u32,
    /// Key by which worlds are drawn for public seeds; `None` if the seeds are used directly.
    pub seed_key: Option<SeedKey>,
    /// Treatment of a run that the folder already holds.
    pub existing: ExistingRun,
}

/// Seeds drawn by an evaluator's key.
#[derive(Clone, Debug, PartialEq)]
pub struct SeedKey {
    /// Fingerprint that identifies the key in results without revealing it.
    pub fingerprint: String,
    /// Drawn seed for each seed.
    pub drawn: BTreeMap<u32, u32>,
}

impl SeedKey {
    fn of(&self, seed: u32) -> Option<KeyedSeed> {
        let drawn = *self.drawn.get(&seed)?;
        Some(KeyedSeed { key_fingerprint: self.fingerprint.clone(), drawn })
    }
}

/// Treatment of a run that the folder already holds. If it is the same run, the evaluation continues it in
/// any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExistingRun {
    /// A different run is left as it is, and the evaluation is refused.
    #[default]
    Refuse,
    /// The same run of another build is continued with this build, and its episodes are kept.
    ResumeWithNewBuild,
    /// A different run is deleted.
    Overwrite,
}

/// Files of recorded episodes that are kept; by default all.
#[derive(Clone, Copy, Debug)]
pub struct KeptFiles {
    /// True if each episode gets `strip.png` and `report.html`.
    pub pages: bool,
    /// True if only the result of a failed episode is kept.
    pub only_successful: bool,
}

impl Default for KeptFiles {
    fn default() -> KeptFiles {
        KeptFiles { pages: true, only_successful: false }
    }
}

/// Starts of the episodes.
#[derive(Clone, Debug)]
pub enum Starts {
    /// Episodes begin at the task's own beginning, and every phase counts.
    Task,
    /// Each episode begins at the start of one of these phases in a demonstration of the same task and seed.
    /// Only that phase counts.
    Phases {
        /// Folder written by `tandem collect` or `tandem serve`.
        demonstrations: PathBuf,
        /// Numbers or ids of phases, for example `p2` or `transfer`. A task that lacks a phase has no episode
        /// for it.
        phases: Vec<String>,
        /// True if episodes begin in the training demonstrations. The demonstrations' seeds replace the
        /// plan's.
        training: bool,
    },
    /// Each episode begins `before_s` seconds before the failure of one of these episodes, in the same world.
    /// Tasks and seeds are those of the failed episodes.
    Moments { failed: Vec<FailedEpisode>, before_s: u32 },
}

/// The share of one process: every episode whose index divided by `of` leaves the remainder `index`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub index: usize,
    pub of: usize,
}

impl Shard {
    /// Share of a process that plays all episodes.
    pub const WHOLE: Shard = Shard { index: 0, of: 1 };
}

impl EvaluationPlan<'_> {
    /// Default number of retries of an episode.
    pub const DEFAULT_RETRIES: u32 = 2;

    /// Returns the spec of one episode.
    pub fn spec(&self, task: &Task, seed: u32, start: Start) -> EpisodeSpec {
        EpisodeSpec {
            robot: self.robot.clone(),
            scene: self.scene.clone(),
            locomotion: self.locomotion.clone(),
            sensing: self.sensing,
            renderer: self.renderer,
            camera: self.camera,
            assistance: self.assistance,
            disclosure: self.disclosure,
            hints: self.hints,
            instructions: self.instructions.own_words(&task.id),
            variation: self.variation,
            stress: self.stress,
            thinking_limit_s: self.thinking_limit_s,
            start,
            ..EpisodeSpec::new(task, seed, self.protocol)
        }
        .keyed(self.seed_key.as_ref().and_then(|key| key.of(seed)))
    }

    /// Returns the spec of an episode that begins shortly before a recorded failure. It has the world of the
    /// failed episode and the rules of this plan.
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
            camera: spec.camera,
            variation: spec.variation,
            stress: spec.stress,
            ..self.spec(&spec.task, spec.seed, start)
        }
        .keyed(spec.keyed_seed.clone())
    }

    /// Returns the departures of its episodes from the benchmark.
    pub fn departures(&self) -> Vec<String> {
        self.named(EpisodeSpec::departures)
    }

    /// Returns the departures of its episodes from Tandem's defaults.
    pub fn peculiarities(&self) -> Vec<String> {
        self.named(EpisodeSpec::peculiarities)
    }

    /// Applies `of` to one spec of each kind of episode and collects the results. They depend only on task
    /// files, instructions and retried episodes.
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

    /// Returns the episodes of this share, and the names of those that are left out for lack of a
    /// demonstration.
    pub fn episodes(&self) -> (Vec<EpisodeSpec>, Vec<String>) {
        let (mut found, mut left_out) = (Vec::new(), Vec::new());
        let is_own = |number: &usize| number % self.shard.of == self.shard.index;
        if let Starts::Moments { failed, before_s } = &self.starts {
            let own = failed.iter().enumerate().filter(|(number, _)| is_own(number));
            return (own.map(|(_, failed)| self.again(failed, *before_s)).collect(), left_out);
        }
        let of_tasks =
            self.tasks.iter().flat_map(|task| self.seeds_of(task).into_iter().map(move |seed| (task, seed)));
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

    /// Returns the seeds with which `task` is played.
    fn seeds_of(&self, task: &Task) -> Vec<u32> {
        match &self.starts {
            Starts::Phases { demonstrations, training: true, .. } => training_seeds(demonstrations, task),
            Starts::Task | Starts::Phases { .. } | Starts::Moments { .. } => self.seeds.clone(),
        }
    }

    /// Returns the numbers of the phases at which episodes of `task` begin; `None` for the start of the task.
    fn starts_of(&self, task: &Task) -> Vec<Option<String>> {
        match &self.starts {
            Starts::Task | Starts::Moments { .. } => vec![None],
            Starts::Phases { phases, .. } => {
                let named = |(index, phase): (usize, &Phase)| {
                    let number = Phase::number(index);
                    phases.iter().any(|name| *name == number || *name == phase.id).then_some(number)
                };
                task.phases.iter().enumerate().filter_map(named).map(Some).collect()
            }
        }
    }
}

/// Maximum number of training demonstrations of a task, in the benchmark and in the split by `tandem export`.
const MAX_TRAINING_DEMONSTRATIONS: usize = 50;

/// Returns the folders of a task's demonstrations, each with the part of the demonstrations' names before the
/// seed.
///
/// `collect` and `serve` write them in this layout.
fn demonstration_folders(folder: &Path, task: &Task) -> [(PathBuf, String); 3] {
    let id = &task.id;
    let (collected, served) = (format!("{id}-"), format!("{id}-seed"));
    [(folder.join("episodes"), collected.clone()), (folder.into(), collected), (folder.into(), served)]
}

/// Returns the recording of a task and seed.
fn demonstration(folder: &Path, task: &Task, seed: u32) -> Option<PathBuf> {
    let recordings = demonstration_folders(folder, task)
        .map(|(folder, begins)| folder.join(format!("{begins}{seed}")).join(Recorder::FILE_NAME));
    recordings.into_iter().find(|recording| recording.exists())
}

/// Returns the lowest seeds of a task's demonstrations in a folder, which are used for training.
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
