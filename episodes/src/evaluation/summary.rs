//! How the episodes went: counts per task, and the intervals that counts of this size leave open.

use std::collections::BTreeMap;

use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};
use tandem_tools_spec::{Disclosure, Hints, Protocol};

use super::keep::{Keeper, Played};

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
    /// Name of the player.
    pub policy: String,
    pub protocol: Protocol,
    pub locomotion: String,
    pub disclosure: Disclosure,
    pub hints: Hints,
    pub tasks: BTreeMap<String, TaskSummary>,
    pub episodes: Vec<Played>,
}

pub fn summarise(keeper: &Keeper, episodes: Vec<Played>) -> Evaluation {
    let mut tasks: BTreeMap<String, TaskSummary> = BTreeMap::new();
    for episode in &episodes {
        let task = tasks.entry(episode.result.task.clone()).or_default();
        let reached = |phase: &str| usize::from(episode.result.phases.reached_s(phase).is_some());
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
        policy: keeper.plan.player.name.into(),
        protocol: keeper.plan.protocol,
        locomotion: keeper.locomotion.clone(),
        disclosure: keeper.plan.disclosure,
        hints: keeper.plan.hints,
        tasks,
        episodes,
    }
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
