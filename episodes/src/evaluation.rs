//! Episodes over seeds: plays them in parallel worlds, keeps each result, and counts.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, mpsc};

use serde::{Deserialize, Serialize};
use statrs::distribution::{Beta, ContinuousCDF};
use tandem_tools_spec::{PhaseTimes, Protocol, ToolCall, ToolReply, Wait};

use crate::experts::{self, Arena, ExpertError};
use crate::results::{EpisodeResult, OutputError, write_whole};
use crate::tasks::Task;
use crate::{EpisodeError, Facts, LocomotionChoice, Session};

/// Who plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Policy {
    /// The task's scripted expert, which sees object poses.
    Expert,
    /// Nobody: robots hold still until the steps of the benchmark protocol are used up.
    Idle,
}

/// What to play.
#[derive(Clone, Debug)]
pub struct Plan {
    pub policy: Policy,
    pub protocol: Protocol,
    pub locomotion: LocomotionChoice,
    pub tasks: Vec<&'static Task>,
    pub seeds: Vec<u32>,
    /// Worlds that run side by side, each on a thread of its own.
    pub jobs: usize,
    /// Record every episode in a folder of its own (`episode.mcap`, `strip.png`, `report.html`).
    pub record: bool,
}

/// One episode that was played, as it is kept in a file of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Played {
    pub policy: Policy,
    pub protocol: Protocol,
    /// Which base controller the robots had.
    pub locomotion: String,
    /// Version and fingerprint of the program; what another build played is played again.
    pub build: String,
    #[serde(flatten)]
    pub result: EpisodeResult,
    /// Why the episode fell short: what stopped the policy, or the first phase that was missed.
    pub note: Option<String>,
}

/// How a task went over its seeds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TaskSummary {
    pub episodes: usize,
    pub p1: usize,
    pub p2: usize,
    pub p3: usize,
    pub falls: u32,
    pub mean_env_steps: f64,
}

/// The content of `results.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    pub policy: Policy,
    pub protocol: Protocol,
    pub locomotion: String,
    pub tasks: BTreeMap<String, TaskSummary>,
    pub episodes: Vec<Played>,
}

/// Why an evaluation stopped. Episodes that were played are kept, and the next run goes on from there.
#[derive(Debug, thiserror::Error)]
pub enum EvaluationError {
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("cannot write {path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    #[error("an episode cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error("cannot read this program's own file, which tells its results from those of other builds: {0}")]
    Build(#[source] std::io::Error),
}

const RESULTS: &str = "results.json";
const EPISODES: &str = "episodes";

/// Plays what `folder` does not hold yet, writes `results.json` there, and calls `progress` after each episode.
pub fn evaluate(
    plan: &Plan,
    folder: &Path,
    progress: &(dyn Fn(&Played) + Sync),
) -> Result<Evaluation, EvaluationError> {
    let kept = folder.join(EPISODES);
    std::fs::create_dir_all(&kept).map_err(|source| EvaluationError::Io { path: kept.clone(), source })?;
    let keeper = Keeper { plan, folder: &kept, build: build()? };
    let work: Vec<(&'static Task, u32)> =
        plan.tasks.iter().flat_map(|task| plan.seeds.iter().map(|seed| (*task, *seed))).collect();
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let (done, played) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..plan.jobs.max(1) {
            let done = done.clone();
            let (work, next, failure, keeper) = (&work, &next, &failure, &keeper);
            scope.spawn(move || {
                while let Some((task, seed)) = work.get(next.fetch_add(1, Ordering::Relaxed)) {
                    match keeper.kept_or_played(task, *seed) {
                        Ok(episode) => drop(done.send(episode)),
                        Err(error) => {
                            // Nobody else begins another episode.
                            next.store(work.len(), Ordering::Relaxed);
                            failure
                                .lock()
                                .unwrap_or_else(|poisoned| poisoned.into_inner())
                                .get_or_insert(error);
                        }
                    }
                }
            });
        }
        drop(done);
        let mut episodes: Vec<Played> = played.iter().inspect(progress).collect();
        if let Some(error) = failure.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take() {
            return Err(error);
        }
        let rank = |episode: &Played| plan.tasks.iter().position(|task| task.id == episode.result.task);
        episodes.sort_by_key(|episode| (rank(episode), episode.result.seed));
        let evaluation = summarise(plan, episodes);
        write_whole(folder, RESULTS, serde_json::to_string_pretty(&evaluation)?.as_bytes())?;
        Ok(evaluation)
    })
}

/// Which program this is: two builds of one version may differ in physics, and their results must not mix in one table.
fn build() -> Result<String, EvaluationError> {
    let path = std::env::current_exe().map_err(EvaluationError::Build)?;
    let mut hasher = DefaultHasher::new();
    hasher.write(&std::fs::read(path).map_err(EvaluationError::Build)?);
    Ok(format!("{}+{:016x}", env!("CARGO_PKG_VERSION"), hasher.finish()))
}

/// The folder of single episodes, and what has to agree for one of them to be taken instead of played.
struct Keeper<'a> {
    plan: &'a Plan,
    folder: &'a Path,
    build: String,
}

impl Keeper<'_> {
    fn kept_or_played(&self, task: &'static Task, seed: u32) -> Result<Played, EvaluationError> {
        match self.kept(task, seed) {
            Some(kept) => Ok(kept),
            None => self.play(task, seed),
        }
    }

    /// An earlier run's episode, if it is this one: a file that is torn, renamed or from other rules counts as missing.
    fn kept(&self, task: &Task, seed: u32) -> Option<Played> {
        let bytes = std::fs::read(self.folder.join(file_name(task, seed))).ok()?;
        let kept: Played = serde_json::from_slice(&bytes).ok()?;
        let plan = self.plan;
        let rules = (kept.policy, kept.protocol, kept.locomotion.as_str(), kept.build.as_str());
        let same = rules == (plan.policy, plan.protocol, plan.locomotion.name(), &self.build)
            && (kept.result.task.as_str(), kept.result.seed) == (task.id, seed)
            && self.recording(task, seed).is_none_or(|folder| folder.join(EpisodeResult::FILE_NAME).exists());
        same.then_some(kept)
    }

    /// Where the episode is recorded, if it is. Its `result.json` is written last.
    fn recording(&self, task: &Task, seed: u32) -> Option<PathBuf> {
        self.plan.record.then(|| self.folder.join(format!("{}-{seed}", task.id)))
    }

    fn play(&self, task: &'static Task, seed: u32) -> Result<Played, EvaluationError> {
        let plan = self.plan;
        let recording = self.recording(task, seed);
        let session = Session::start(task, seed, plan.protocol, &plan.locomotion, recording.as_deref())?;
        let mut arena = InProcess(session);
        let outcome = match plan.policy {
            Policy::Expert => experts::perform(task, &mut arena),
            Policy::Idle => idle(task, &mut arena),
        };
        let result = EpisodeResult::from(&arena.0.close()?);
        let episode = Played {
            policy: plan.policy,
            protocol: plan.protocol,
            locomotion: plan.locomotion.name().into(),
            build: self.build.clone(),
            note: outcome.err().map(|error| error.to_string()).or_else(|| missed(&result)),
            result,
        };
        let text = serde_json::to_string_pretty(&episode)?;
        write_whole(self.folder, &file_name(task, seed), text.as_bytes())?;
        Ok(episode)
    }
}

fn file_name(task: &Task, seed: u32) -> String {
    format!("{}-{seed}.json", task.id)
}

/// An episode in this process.
pub struct InProcess(pub Session);

impl Arena for InProcess {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, ExpertError> {
        let tool = call.name();
        self.0.call(call).map_err(|error| match error {
            EpisodeError::Ended { .. } => ExpertError::EpisodeOver,
            error => ExpertError::Call { tool, reason: error.to_string() },
        })
    }

    fn facts(&mut self) -> Result<Facts, ExpertError> {
        Ok(self.0.facts())
    }
}

const IDLE_STEPS: u32 = 25;

fn idle(task: &Task, arena: &mut dyn Arena) -> Result<(), ExpertError> {
    for _ in 0..task.benchmark_steps.div_ceil(IDLE_STEPS) {
        match arena.call(Wait { steps: IDLE_STEPS }.into()) {
            Ok(_) => {}
            Err(ExpertError::EpisodeOver) => return Ok(()),
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

fn summarise(plan: &Plan, episodes: Vec<Played>) -> Evaluation {
    let mut tasks: BTreeMap<String, TaskSummary> = BTreeMap::new();
    for episode in &episodes {
        let task = tasks.entry(episode.result.task.clone()).or_default();
        let reached = |phase: &str| usize::from(was_reached(&episode.result.phases, phase));
        task.episodes += 1;
        task.p1 += reached("p1");
        task.p2 += reached("p2");
        task.p3 += reached("p3");
        task.falls += episode.result.falls;
        task.mean_env_steps += f64::from(episode.result.env_steps);
    }
    for task in tasks.values_mut() {
        task.mean_env_steps /= task.episodes as f64;
    }
    Evaluation {
        policy: plan.policy,
        protocol: plan.protocol,
        locomotion: plan.locomotion.name().into(),
        tasks,
        episodes,
    }
}

fn was_reached(phases: &PhaseTimes, phase: &str) -> bool {
    phases.reached_s(phase).is_some()
}

/// The first phase that was not reached.
fn missed(result: &EpisodeResult) -> Option<String> {
    let (phase, _) = result.phases.0.iter().find(|(_, time_s)| time_s.is_none())?;
    Some(format!("{phase} was not reached in {} steps", result.env_steps))
}

/// Exact 95 % interval of a rate, `successes` of `trials` (Clopper and Pearson, 1934).
pub fn clopper_pearson(successes: usize, trials: usize) -> [f64; 2] {
    const TAIL: f64 = 0.025;
    let (k, n) = (successes as f64, trials as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    let low = if successes == 0 { 0.0 } else { quantile(k, n - k + 1.0, TAIL) };
    let high = if successes == trials { 1.0 } else { quantile(k + 1.0, n - k, 1.0 - TAIL) };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against R's `binom.test(k, n)$conf.int`.
    #[test]
    fn intervals_are_clopper_and_pearsons() {
        for (successes, trials, [low, high]) in [
            (10, 10, [0.6915, 1.0]),
            (0, 10, [0.0, 0.3085]),
            (17, 20, [0.6211, 0.9679]),
            (95, 100, [0.8872, 0.9836]),
        ] {
            let interval = clopper_pearson(successes, trials);
            assert!((interval[0] - low).abs() < 1e-4 && (interval[1] - high).abs() < 1e-4, "{interval:?}");
        }
    }

    fn result(task: &str, seed: u32, phases: Vec<(String, Option<f64>)>) -> EpisodeResult {
        EpisodeResult {
            task: task.into(),
            seed,
            phases: PhaseTimes(phases),
            env_steps: 812,
            tool_calls: 61,
            falls: 0,
            realtime_factor: 3.5,
            state_hash: "00c0ffee00c0ffee".into(),
        }
    }

    /// An episode that was played under `keeper`'s rules.
    fn played(keeper: &Keeper, task: &Task, seed: u32) -> Played {
        let result = result(task.id, seed, vec![("p1".into(), Some(4.2))]);
        let (policy, protocol) = (keeper.plan.policy, keeper.plan.protocol);
        let locomotion = keeper.plan.locomotion.name().into();
        Played { policy, protocol, locomotion, build: keeper.build.clone(), result, note: None }
    }

    #[test]
    fn the_first_phase_that_was_missed_is_noted() {
        let note = |times: [Option<f64>; 3]| {
            let phases = ["p1", "p2", "p3"].into_iter().map(String::from).zip(times).collect();
            missed(&result("handover", 7, phases))
        };
        let second = note([Some(4.2), None, None]);
        assert_eq!(second.as_deref(), Some("p2 was not reached in 812 steps"));
        assert_eq!(note([Some(4.2), Some(5.0), Some(6.0)]), None);
    }

    #[test]
    fn only_the_same_episode_of_the_same_build_is_taken_from_an_earlier_run() {
        let folder = tempfile::tempdir().unwrap();
        let task = crate::tasks::find("pouring").unwrap();
        let plan = Plan {
            policy: Policy::Expert,
            protocol: Protocol::Agentic,
            locomotion: LocomotionChoice::Balance,
            tasks: vec![task],
            seeds: vec![7],
            jobs: 1,
            record: false,
        };
        let keeper = Keeper { plan: &plan, folder: folder.path(), build: build().unwrap() };
        let kept_after = |text: &str| {
            std::fs::write(folder.path().join("pouring-7.json"), text).unwrap();
            keeper.kept(task, 7)
        };
        assert_eq!(keeper.kept(task, 7), None, "nothing was played");
        let same = played(&keeper, task, 7);
        let text = serde_json::to_string(&same).unwrap();
        assert_eq!(kept_after(&text), Some(same.clone()));
        assert_eq!(kept_after(&text[..text.len() / 2]), None, "a torn file");
        type Change = fn(&mut Played);
        for (what, change) in [
            ("task", (|played| played.result.task = "handover".into()) as Change),
            ("seed", |played| played.result.seed = 8),
            ("protocol", |played| played.protocol = Protocol::Benchmark),
            ("policy", |played| played.policy = Policy::Idle),
            ("controller", |played| played.locomotion.push('0')),
            ("build", |played| played.build.push('0')),
        ] {
            let mut other = same.clone();
            change(&mut other);
            assert_eq!(kept_after(&serde_json::to_string(&other).unwrap()), None, "another {what}");
        }

        // One that was played without a recording is no demonstration.
        let recorded = Plan { record: true, ..plan.clone() };
        let collector = Keeper { plan: &recorded, ..keeper };
        std::fs::write(folder.path().join("pouring-7.json"), &text).unwrap();
        assert_eq!(collector.kept(task, 7), None, "no recording");
        std::fs::create_dir(folder.path().join("pouring-7")).unwrap();
        same.result.write(&folder.path().join("pouring-7")).unwrap();
        assert_eq!(collector.kept(task, 7), Some(same));
    }
}
