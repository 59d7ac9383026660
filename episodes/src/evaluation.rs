//! Episodes over seeds: plays them in parallel worlds, keeps each result, and counts.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, mpsc};

use serde::{Deserialize, Serialize};
use statrs::distribution::{Beta, ContinuousCDF};
use tandem_tools_spec::{PhaseTimes, Protocol, ToolCall, ToolReply, Wait};

use crate::experts::{self, Arena, ExpertError};
use crate::results::{EpisodeResult, OutputError, write_whole};
use crate::tasks::Task;
use crate::{EpisodeError, Facts, Session};

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
    /// Results of other versions are played again.
    pub version: String,
    #[serde(flatten)]
    pub result: EpisodeResult,
    /// Why the policy gave up, if it did.
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
    let work: Vec<(&'static Task, u32)> =
        plan.tasks.iter().flat_map(|task| plan.seeds.iter().map(|seed| (*task, *seed))).collect();
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let (done, played) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..plan.jobs.max(1) {
            let done = done.clone();
            let (work, next, failure, kept) = (&work, &next, &failure, &kept);
            scope.spawn(move || {
                while let Some((task, seed)) = work.get(next.fetch_add(1, Ordering::Relaxed)) {
                    match kept_or_played(plan, task, *seed, kept) {
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

fn kept_or_played(
    plan: &Plan,
    task: &'static Task,
    seed: u32,
    folder: &Path,
) -> Result<Played, EvaluationError> {
    let name = format!("{}-{seed}.json", task.id);
    let version = env!("CARGO_PKG_VERSION");
    let kept = std::fs::read(folder.join(&name))
        .ok()
        .and_then(|bytes| serde_json::from_slice::<Played>(&bytes).ok());
    if let Some(kept) = kept.filter(|kept| {
        (kept.policy, kept.protocol, kept.version.as_str()) == (plan.policy, plan.protocol, version)
    }) {
        return Ok(kept);
    }
    let recording = plan.record.then(|| folder.join(format!("{}-{seed}", task.id)));
    let session = Session::start(task, seed, plan.protocol, recording.as_deref())?;
    let mut arena = InProcess(session);
    let outcome = match plan.policy {
        Policy::Expert => experts::perform(task, &mut arena),
        Policy::Idle => idle(task, &mut arena),
    };
    let result = EpisodeResult::from(&arena.0.close()?);
    let note = outcome.err().map(|error| error.to_string());
    let episode =
        Played { policy: plan.policy, protocol: plan.protocol, version: version.into(), result, note };
    write_whole(folder, &name, serde_json::to_string_pretty(&episode)?.as_bytes())?;
    Ok(episode)
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
        match arena.call(ToolCall::Wait(Wait { steps: IDLE_STEPS })) {
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
    Evaluation { policy: plan.policy, protocol: plan.protocol, tasks, episodes }
}

fn was_reached(phases: &PhaseTimes, phase: &str) -> bool {
    phases.reached_s(phase).is_some()
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
}
