//! Phase-level rates: how often episodes that began at a phase reached that phase. These rates do not depend
//! on earlier failures in a task, so phases that need several robots can be compared with other phases.

use std::collections::BTreeMap;

use serde::Serialize;
use tandem_episodes::{Phase, tasks};

use super::PlayedEpisode;

/// The rates of all phases at which episodes began.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhaseLevel {
    /// The rates in the order of the tasks and their phases.
    pub phases: Vec<PhaseRate>,
    /// Means over the tasks for two robots, as in the benchmark.
    #[serde(flatten)]
    pub two_robots: PhaseMeans,
    /// Means over the tasks for three robots; `None` if no such task was played.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub three_robots: Option<PhaseMeans>,
}

/// Means of phases' rates. Every phase has the same weight, whatever its number of episodes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhaseMeans {
    /// Mean of the rates of phases that need one robot at a time; `None` if there is no such phase.
    pub non_collaborative_share: Option<f64>,
    /// Mean of the rates of phases on which robots collaborate.
    pub collaborative_share: Option<f64>,
    /// Relative drop from the first mean to the second, as a share of the first.
    pub drop_share: Option<f64>,
}

/// One phase of one task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhaseRate {
    pub task: String,
    /// Number of robots of the task.
    pub robots: usize,
    /// The phase's id, for example `transfer`.
    pub id: String,
    /// The phase's number, for example `p2`.
    pub number: String,
    pub collaborative: bool,
    pub episodes: usize,
    pub reached: usize,
}

impl PhaseRate {
    pub fn share(&self) -> f64 {
        self.reached as f64 / self.episodes as f64
    }
}

impl PhaseLevel {
    /// Counts the episodes that began at a phase and count; `None` if there are no such episodes.
    pub fn of<'a>(episodes: impl Iterator<Item = &'a PlayedEpisode>) -> Option<PhaseLevel> {
        let mut counts: BTreeMap<(usize, usize), [usize; 2]> = BTreeMap::new();
        let counted: Vec<&PlayedEpisode> = episodes.filter(|played| played.counts()).collect();
        let order = tasks::in_order(counted.iter().map(|played| &played.spec.task));
        for played in counted {
            let task = order.iter().position(|task| **task == played.spec.task);
            let Some((key, phase)) = task.zip(played.start_phase()) else { continue };
            let [episodes, reached] = counts.entry((key, phase)).or_default();
            *episodes += 1;
            *reached += usize::from(played.reached(phase));
        }
        let rate = |((task, phase), [episodes, reached]): ((usize, usize), [usize; 2])| {
            let task = order[task];
            let Phase { id, collaborative, .. } = &task.phases[phase];
            PhaseRate {
                task: task.id.clone(),
                robots: task.robots.len(),
                id: id.clone(),
                number: Phase::number(phase),
                collaborative: *collaborative,
                episodes,
                reached,
            }
        };
        let phases: Vec<PhaseRate> = counts.into_iter().map(rate).collect();
        let of_robots = |robots: usize| phases.iter().filter(move |rate| rate.robots == robots);
        let three_robots = of_robots(3).next().map(|_| PhaseMeans::of(of_robots(3)));
        let two_robots = PhaseMeans::of(of_robots(2));
        (!phases.is_empty()).then_some(PhaseLevel { phases, two_robots, three_robots })
    }

    /// Returns the means for each number of robots that was played.
    pub fn means(&self) -> Vec<(usize, &PhaseMeans)> {
        let two = self.phases.iter().any(|rate| rate.robots == 2).then_some((2, &self.two_robots));
        two.into_iter().chain(self.three_robots.iter().map(|means| (3, means))).collect()
    }
}

impl PhaseMeans {
    fn of<'a>(rates: impl Iterator<Item = &'a PhaseRate> + Clone) -> PhaseMeans {
        let mean = |together: bool| mean(rates.clone().filter(|rate| rate.collaborative == together));
        let (non_collaborative_share, collaborative_share) = (mean(false), mean(true));
        let drop = |(alone, together): (f64, f64)| (alone > 0.0).then(|| (alone - together) / alone);
        let drop_share = non_collaborative_share.zip(collaborative_share).and_then(drop);
        PhaseMeans { non_collaborative_share, collaborative_share, drop_share }
    }
}

fn mean<'a>(rates: impl Iterator<Item = &'a PhaseRate>) -> Option<f64> {
    let shares: Vec<f64> = rates.map(PhaseRate::share).collect();
    (!shares.is_empty()).then(|| shares.iter().sum::<f64>() / shares.len() as f64)
}
