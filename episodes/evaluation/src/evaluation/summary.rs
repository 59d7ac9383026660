//! Summary of episodes: counts per task, and the phase-level rates.

use std::collections::{BTreeMap, BTreeSet};

use crate::results::{Exclusion, PhaseLevel, PlayedEpisode, PolicyCard, named, shown_in};
use serde::Serialize;
use tandem_sim::Sensing;
use tandem_tools_spec::{Assistance, Protocol};

use super::cache::EpisodeCache;

/// Counts of a task over its seeds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TaskSummary {
    /// Number of episodes that count. All other counts except the last two refer to these episodes.
    pub episodes: usize,
    pub p1: usize,
    pub p2: usize,
    pub p3: usize,
    pub falls: u32,
    pub mean_env_steps: f64,
    /// Episodes that do not count, because the policy itself failed.
    pub policy_failed: usize,
    /// Episodes that do not count, because the simulator failed.
    pub simulator_failed: usize,
}

/// The content of `results.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// The policy.
    #[serde(flatten)]
    pub policy: PolicyCard,
    pub protocol: Protocol,
    pub locomotion: String,
    #[serde(flatten)]
    pub sensing: Sensing,
    pub assistance: Assistance,
    /// Departures from the benchmark.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub departures: Vec<String>,
    /// Departures from Tandem's defaults, for display after the policy's name.
    #[serde(skip)]
    pub peculiarities: Vec<String>,
    /// Information that the policy was shown in any episode, but that the benchmark withholds from its own
    /// policies.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub extra_information: BTreeSet<String>,
    /// Summary of the episodes that began at their task's beginning, by task.
    pub tasks: BTreeMap<String, TaskSummary>,
    /// Summary of the episodes that began at a phase.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_level: Option<PhaseLevel>,
    /// Episodes that could not be started, with the reasons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// Number of episodes that other builds have played, by build.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub other_builds: BTreeMap<String, usize>,
    pub episodes: Vec<PlayedEpisode>,
}

impl Evaluation {
    /// Returns the policy's name with its extra information and departures, as in reports.
    pub fn full_name(&self) -> String {
        let shown = shown_in(self.episodes.iter());
        named(&named(&self.policy.name, &shown), &self.peculiarities)
    }
}

pub fn summarise(cache: &EpisodeCache, episodes: Vec<PlayedEpisode>, left_out: Vec<String>) -> Evaluation {
    let mut tasks: BTreeMap<String, TaskSummary> = BTreeMap::new();
    for episode in episodes.iter().filter(|played| played.start_phase().is_none()) {
        let task = tasks.entry(episode.result.task.clone()).or_default();
        match episode.exclusion() {
            Some(Exclusion::PolicyFailed) => task.policy_failed += 1,
            Some(Exclusion::SimulatorFailed) => task.simulator_failed += 1,
            None => task.episodes += 1,
        }
        if !episode.counts() {
            continue;
        }
        let reached = |phase: usize| usize::from(episode.reached(phase));
        task.p1 += reached(0);
        task.p2 += reached(1);
        task.p3 += reached(2);
        task.falls += episode.result.falls;
        task.mean_env_steps += f64::from(episode.result.env_steps);
    }
    for task in tasks.values_mut() {
        task.mean_env_steps /= task.episodes.max(1) as f64;
    }
    Evaluation {
        policy: cache.plan.player.card(),
        protocol: cache.plan.protocol,
        locomotion: cache.locomotion.clone(),
        sensing: cache.plan.sensing,
        assistance: cache.plan.assistance,
        departures: departures(cache, &episodes),
        peculiarities: cache.plan.peculiarities(),
        extra_information: episodes
            .iter()
            .flat_map(|played| played.result.extra_information.clone())
            .collect(),
        tasks,
        phase_level: PhaseLevel::of(episodes.iter()),
        left_out,
        other_builds: other_builds(cache.build, &episodes),
        episodes,
    }
}

/// Returns the departures of all episodes, including those that the policy requested in any of them.
fn departures(cache: &EpisodeCache, episodes: &[PlayedEpisode]) -> Vec<String> {
    let mut found = cache.plan.departures();
    for departure in episodes.iter().flat_map(|played| &played.result.departures) {
        if !found.contains(departure) {
            found.push(departure.clone());
        }
    }
    found
}

fn other_builds(build: &str, episodes: &[PlayedEpisode]) -> BTreeMap<String, usize> {
    let mut found = BTreeMap::new();
    for other in episodes.iter().map(|played| &played.build).filter(|other| *other != build) {
        *found.entry(other.clone()).or_default() += 1;
    }
    found
}
