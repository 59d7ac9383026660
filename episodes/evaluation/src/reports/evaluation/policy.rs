//! Results of one policy: rates of phases, averages, effort, and causes of failures.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use serde_json::Value;
use tandem_episodes::{
    Phase,
    tasks::{self, Task},
};
use tandem_tools_spec::EndReason;
use xxhash_rust::xxh3::xxh3_64;

use super::costs::{AskedCosts, EpisodeCosts, ModelCosts};
use super::load::{FoundEpisode, LoadedEpisodes};
use super::rate::{MeanRate, Rate};
use crate::results::{Exclusion, PhaseLevel, PlayedEpisode, PolicyCard, missed_phase_note, named, shown_in};
use crate::statistics::Count;

/// Episodes of one policy, with the same rules and build.
pub struct PolicyGroup<'a> {
    pub name: String,
    /// Episodes that count.
    pub episodes: Vec<&'a FoundEpisode>,
    /// Episodes that do not count and were not played again.
    pub excluded: Vec<&'a PlayedEpisode>,
    /// Episodes that do not count and were played again elsewhere.
    pub superseded: Vec<&'a PlayedEpisode>,
}

/// Results and costs of a policy's episodes.
#[derive(Debug, Serialize)]
pub struct PolicyReport {
    pub name: String,
    /// Address of a policy server; `None` for other policies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    pub protocol: &'static str,
    pub locomotion: String,
    pub build: String,
    /// Number of episodes that count. All figures except those about excluded episodes refer to them.
    pub episodes: usize,
    pub falls: u32,
    /// The tasks that were played, in the order of the task list.
    pub tasks: Vec<TaskReport>,
    /// Averages over the tasks for two robots, and over the tasks for three.
    pub averages: Vec<TaskAverage>,
    /// Rates by collaboration: over the tasks for two robots, as in the benchmark, then over the tasks for
    /// three. Only task sets that were played have an entry.
    pub together: Vec<ByCollaboration>,
    /// Rates of single phases; `None` if no episodes began at phases.
    pub phase_level: Option<PhaseLevel>,
    /// Information that the policy was shown, but that the benchmark withholds from its own policies.
    pub shown: Vec<ShownReport>,
    pub reasons: Vec<FailureReason>,
    /// Episodes that are excluded as evidence of the policy's performance, by reason.
    pub excluded: Vec<ExcludedEpisodes>,
    /// Episodes that were played more than once because earlier attempts did not count.
    pub played_again: Vec<RepeatedEpisode>,
    /// Total model costs; `None` if no notes report them.
    pub asked: Option<AskedCosts>,
}

/// One task.
#[derive(Debug, Serialize)]
pub struct TaskReport {
    pub task: String,
    pub robots: usize,
    /// Number of episodes that began at the task's beginning.
    pub episodes: usize,
    pub phases: Vec<PhaseReport>,
    pub effort: Option<EpisodeCosts>,
    /// Model costs; `None` if no notes report them.
    pub models: Option<ModelCosts>,
    pub falls: u32,
    /// Mean share of the joint targets beyond the joints' limits; `None` if no target was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joints_clamped_share: Option<f64>,
}

/// One phase of a task.
#[derive(Debug, Serialize)]
pub struct PhaseReport {
    /// The phase's id, for example `transfer`.
    pub id: String,
    /// The phase's number, for example `p2`.
    pub number: String,
    pub collaborative: bool,
    /// Rate among all episodes.
    pub cumulative: Option<Rate>,
    /// Simulated times at which whole episodes reached the phase, in ascending order.
    pub reached_s: Vec<f64>,
    /// Rate among the episodes that reached the previous phase.
    pub conditional: Option<Rate>,
    /// Rate among the episodes that began at this phase.
    pub from_its_beginning: Option<Rate>,
}

/// Mean rates of each phase over the tasks for one number of robots.
#[derive(Debug, Serialize)]
pub struct TaskAverage {
    pub robots: usize,
    pub tasks: usize,
    pub phases: Vec<Option<MeanRate>>,
}

/// Mean conditional rates over the tasks for one number of robots: of the phases on which robots collaborate,
/// and of all other phases.
#[derive(Debug, Serialize)]
pub struct ByCollaboration {
    pub robots: usize,
    pub alone: Option<MeanRate>,
    pub together: Option<MeanRate>,
}

/// One kind of information that the benchmark withholds from its own policies.
#[derive(Debug, Serialize)]
pub struct ShownReport {
    /// The name in results, for example `odometry`.
    pub what: String,
    /// Number of counted episodes that showed it.
    pub episodes: usize,
    /// Number of replies that showed it, by the robot that the information is about.
    pub replies: BTreeMap<String, u32>,
}

/// A cause of failed episodes.
#[derive(Debug, Serialize)]
pub struct FailureReason {
    pub task: String,
    /// Number of the first counted phase that was not reached.
    pub phase: String,
    pub why: String,
    pub seeds: Vec<u32>,
}

/// Episodes that do not count, for the same reason.
#[derive(Debug, Serialize)]
pub struct ExcludedEpisodes {
    pub task: String,
    pub what: Exclusion,
    pub why: String,
    pub seeds: Vec<u32>,
}

/// An episode that was played more than once.
#[derive(Debug, Serialize)]
pub struct RepeatedEpisode {
    pub task: String,
    pub seed: u32,
    /// Causes of the earlier attempts' failures, oldest first.
    pub earlier: Vec<String>,
    /// Outcome of the last attempt.
    pub last: String,
}

/// Groups episodes by policy, in the order in which policies were found. The groups have distinct names.
pub fn groups<'a>(episodes: impl Iterator<Item = &'a FoundEpisode>) -> Vec<PolicyGroup<'a>> {
    let mut groups: Vec<(Vec<String>, Vec<&FoundEpisode>)> = Vec::new();
    for found in episodes {
        let key = rules_of(&found.played);
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, group)) => group.push(found),
            None => groups.push((key, vec![found])),
        }
    }
    let keys: Vec<Vec<String>> = groups.iter().map(|(key, _)| key.clone()).collect();
    let apart = |key: &Vec<String>| {
        let namesakes: Vec<&Vec<String>> = keys.iter().filter(|other| other[0] == key[0]).collect();
        let differs = |part: &usize| namesakes.iter().any(|other| other[*part] != key[*part]);
        let parts: Vec<&str> = (1..key.len()).filter(differs).map(|part| key[part].as_str()).collect();
        match parts.is_empty() {
            true => String::new(),
            false => format!(" ({})", parts.join(", ")),
        }
    };
    let group = |(key, episodes): (Vec<String>, Vec<&'a FoundEpisode>)| {
        let (policy, settings) = (&episodes[0].played.policy.name, &episodes[0].played.spec);
        let policy = split_address(policy).0;
        let shown = shown_in(episodes.iter().map(|found| &found.played));
        let full_name = named(&named(policy, &shown), &settings.peculiarities());
        PolicyGroup::new(full_name + &apart(&key), episodes)
    };
    groups.into_iter().map(group).collect()
}

impl<'a> PolicyGroup<'a> {
    fn new(name: String, found: Vec<&'a FoundEpisode>) -> PolicyGroup<'a> {
        let (episodes, excluded): (Vec<_>, Vec<_>) = found.into_iter().partition(|one| one.played.counts());
        let key =
            |played: &PlayedEpisode| (played.spec.task.id.clone(), played.spec.seed, played.start_phase());
        let again: BTreeSet<_> = episodes.iter().map(|one| key(&one.played)).collect();
        let excluded = excluded.into_iter().map(|one| &one.played);
        let (superseded, excluded) = excluded.partition(|one| again.contains(&key(one)));
        PolicyGroup { name, excluded, superseded, episodes }
    }

    /// Returns all episodes: those that count, then the others.
    pub fn all(&self) -> impl Iterator<Item = &'a PlayedEpisode> {
        let counted = self.episodes.iter().map(|found| &found.played);
        counted.chain(self.excluded.iter().copied()).chain(self.superseded.iter().copied())
    }
}

/// Returns the properties that all episodes of one policy share: the policy's name, followed by everything
/// that may distinguish policies of the same name.
pub fn rules_of(played: &PlayedEpisode) -> Vec<String> {
    let spec = &played.spec;
    let short = played.build.chars().rev().take(6).collect::<Vec<_>>();
    let (name, address) = split_address(&played.policy.name);
    let card = PolicyCard { name: name.into(), ..played.policy.clone() };
    vec![
        named(&card.full_name(), &spec.peculiarities()),
        address.unwrap_or("in this process").into(),
        spec.protocol.name().into(),
        // Departures contain only file names. Files of one name may differ in content or folder.
        played.locomotion.clone(),
        spec.robot.name(),
        spec.scene.as_ref().map(|scene| format!("scene {}", scene.xxh3)).unwrap_or_default(),
        settings_of(&played.policy),
        format!("build ..{}", short.iter().rev().collect::<String>()),
    ]
}

/// Splits a policy's name at its address: `openpi:ws://host:8000` into `openpi` and `ws://host:8000`.
fn split_address(name: &str) -> (&str, Option<&str>) {
    let parts = name.split_once(':').filter(|(_, address)| {
        let scheme = address.split_once("://").map_or("", |(scheme, _)| scheme);
        !scheme.is_empty() && scheme.chars().all(|character| character.is_ascii_alphanumeric())
    });
    parts.map_or((name, None), |(name, address)| (name, Some(address)))
}

/// Returns a short label for a policy's settings.
fn settings_of(card: &PolicyCard) -> String {
    let text = card.settings.as_ref().map(Value::to_string).unwrap_or_default();
    format!("settings {:06x}", xxh3_64(text.as_bytes()) & 0xff_ffff)
}

fn count<'a>(episodes: impl Iterator<Item = &'a PlayedEpisode>, phase: usize) -> Count {
    let reached: Vec<bool> = episodes.map(|played| played.reached(phase)).collect();
    Count { successes: reached.iter().filter(|reached| **reached).count(), trials: reached.len() }
}

impl PolicyReport {
    pub fn of(group: &PolicyGroup) -> PolicyReport {
        let played: Vec<&PlayedEpisode> = group.episodes.iter().map(|found| &found.played).collect();
        let first = played.first().or(group.excluded.first());
        let order = tasks::in_order(played.iter().map(|played| &played.spec.task));
        let of_tasks = order.into_iter().map(|task| TaskReport::of(task, &played));
        let tasks: Vec<TaskReport> = of_tasks.flatten().collect();
        PolicyReport {
            name: group.name.clone(),
            address: first.and_then(|played| split_address(&played.policy.name).1).map(str::to_owned),
            protocol: first.map_or("", |played| played.spec.protocol.name()),
            locomotion: first.map(|played| played.locomotion.clone()).unwrap_or_default(),
            build: first.map(|played| played.build.clone()).unwrap_or_default(),
            episodes: played.len(),
            falls: played.iter().map(|played| played.result.falls).sum(),
            averages: averages(&tasks),
            together: [2, 3].into_iter().filter_map(|robots| ByCollaboration::of(&tasks, robots)).collect(),
            phase_level: PhaseLevel::of(played.iter().copied()),
            shown: shown(&played),
            reasons: reasons(&played),
            excluded: excluded(&group.excluded),
            played_again: played_again(group),
            asked: AskedCosts::of(&played, &group.excluded),
            tasks,
        }
    }
}

impl TaskReport {
    /// Creates the report of a task; `None` if it was not played.
    fn of(task: &Task, played: &[&PlayedEpisode]) -> Option<TaskReport> {
        let of_task: Vec<&PlayedEpisode> =
            played.iter().copied().filter(|one| one.spec.task == *task).collect();
        let whole: Vec<&PlayedEpisode> =
            of_task.iter().copied().filter(|one| one.start_phase().is_none()).collect();
        let phase = |(index, phase): (usize, &Phase)| {
            let before = whole.iter().filter(|one| index == 0 || one.reached(index - 1)).copied();
            let mut reached_s: Vec<f64> =
                whole.iter().filter_map(|one| one.result.phases.reached_s(&Phase::number(index))).collect();
            reached_s.sort_by(f64::total_cmp);
            let from_it = of_task.iter().filter(|one| one.start_phase() == Some(index)).copied();
            PhaseReport {
                id: phase.id.clone(),
                number: Phase::number(index),
                collaborative: phase.collaborative,
                cumulative: Rate::of(count(whole.iter().copied(), index)),
                reached_s,
                conditional: Rate::of(count(before, index)),
                from_its_beginning: Rate::of(count(from_it, index)),
            }
        };
        (!of_task.is_empty()).then(|| TaskReport {
            task: task.id.clone(),
            robots: task.robots.len(),
            episodes: whole.len(),
            phases: task.phases.iter().enumerate().map(phase).collect(),
            effort: EpisodeCosts::of(&whole),
            models: ModelCosts::of(&whole),
            falls: of_task.iter().map(|one| one.result.falls).sum(),
            joints_clamped_share: mean_clamped_share(&of_task),
        })
    }
}

/// Returns the mean share of joint targets beyond the joints' limits in these episodes; `None` if no target
/// was.
fn mean_clamped_share(episodes: &[&PlayedEpisode]) -> Option<f64> {
    let shares: Vec<f64> =
        episodes.iter().map(|one| one.result.joints_clamped_share.unwrap_or_default()).collect();
    let mean = shares.iter().sum::<f64>() / shares.len().max(1) as f64;
    (mean > 0.0).then_some(mean)
}

fn averages(tasks: &[TaskReport]) -> Vec<TaskAverage> {
    let mut by_robots: BTreeMap<usize, Vec<&TaskReport>> = BTreeMap::new();
    for task in tasks.iter().filter(|task| task.episodes > 0) {
        by_robots.entry(task.robots).or_default().push(task);
    }
    let average = |(robots, tasks): (usize, Vec<&TaskReport>)| {
        let phases = tasks.iter().map(|task| task.phases.len()).max().unwrap_or_default();
        let rates = |phase: usize| {
            let of_task = tasks.iter().filter_map(move |task| task.phases.get(phase)?.cumulative);
            MeanRate::of(of_task.map(Rate::count))
        };
        TaskAverage { robots, tasks: tasks.len(), phases: (0..phases).map(rates).collect() }
    };
    by_robots.into_iter().map(average).collect()
}

impl ByCollaboration {
    /// Creates the means; `None` if no phase of the tasks has a conditional rate.
    fn of(tasks: &[TaskReport], robots: usize) -> Option<ByCollaboration> {
        let mean = |together: bool| {
            let phases = tasks.iter().filter(|task| task.robots == robots).flat_map(|task| &task.phases);
            let phases = phases.filter(|phase| phase.collaborative == together);
            MeanRate::of(phases.filter_map(|phase| phase.conditional).map(Rate::count))
        };
        let (alone, together) = (mean(false), mean(true));
        (alone.is_some() || together.is_some()).then_some(ByCollaboration { robots, alone, together })
    }
}

fn shown(episodes: &[&PlayedEpisode]) -> Vec<ShownReport> {
    let mut shown: BTreeMap<&String, ShownReport> = BTreeMap::new();
    for played in episodes {
        let (result, asked) = (&played.result, &played.policy.extra_information);
        let kinds: BTreeSet<&String> = result.extra_information.iter().chain(asked).collect();
        for what in kinds {
            let report = shown.entry(what).or_insert_with(|| ShownReport {
                what: what.clone(),
                episodes: 0,
                replies: BTreeMap::new(),
            });
            report.episodes += 1;
            for (robot, count) in result.extra_information_replies.get(what).into_iter().flatten() {
                *report.replies.entry(robot.clone()).or_default() += count;
            }
        }
    }
    shown.into_values().collect()
}

fn reasons(episodes: &[&PlayedEpisode]) -> Vec<FailureReason> {
    let mut reasons: Vec<FailureReason> = Vec::new();
    for played in episodes.iter().filter(|played| !played.succeeded()) {
        let (phase, why) = (first_missed_phase(played), failure_cause(played));
        let same = |known: &&mut FailureReason| {
            (&known.task, &known.phase, &known.why) == (&played.spec.task.id, &phase, &why)
        };
        match reasons.iter_mut().find(same) {
            Some(known) => known.seeds.push(played.spec.seed),
            None => reasons.push(FailureReason {
                task: played.spec.task.id.clone(),
                phase,
                why,
                seeds: vec![played.spec.seed],
            }),
        }
    }
    let rank = |reason: &FailureReason| tasks::cohub().iter().position(|task| task.id == reason.task);
    reasons.sort_by_key(|reason| (rank(reason), reason.phase.clone()));
    reasons
}

/// Returns at most `most` failures for which `wanted` returns `true`, with their policies. They are taken in
/// turn from each policy and task.
pub fn failed_by_turns(
    loaded: &LoadedEpisodes,
    most: usize,
    wanted: fn(&FoundEpisode) -> bool,
) -> Vec<(String, &FoundEpisode)> {
    let groups = groups(loaded.episodes.iter());
    let mut all: Vec<(String, &FoundEpisode)> = Vec::new();
    for group in &groups {
        let of_group = failed(group).into_iter().filter(|found| wanted(found));
        all.extend(of_group.map(|found| (group.name.clone(), found)));
    }
    let turn = |index: usize| {
        let (policy, found) = &all[index];
        let same = |(other, one): &&(String, &FoundEpisode)| {
            other == policy && one.played.spec.task == found.played.spec.task
        };
        all[..index].iter().filter(same).count()
    };
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by_key(|index| turn(*index));
    order.truncate(most);
    order.sort_unstable();
    order.into_iter().map(|index| all[index].clone()).collect()
}

/// Returns the failed episodes of a policy that count.
pub fn failed<'a>(group: &PolicyGroup<'a>) -> Vec<&'a FoundEpisode> {
    group.episodes.iter().copied().filter(|found| !found.played.succeeded()).collect()
}

fn excluded(episodes: &[&PlayedEpisode]) -> Vec<ExcludedEpisodes> {
    let mut listed: Vec<ExcludedEpisodes> = Vec::new();
    for (played, what) in episodes.iter().filter_map(|played| Some((played, played.exclusion()?))) {
        let (task, seed, why) = (&played.spec.task.id, played.spec.seed, failure_cause(played));
        let same =
            |known: &&mut ExcludedEpisodes| (&known.task, known.what, &known.why) == (task, what, &why);
        match listed.iter_mut().find(same) {
            Some(known) => known.seeds.push(seed),
            None => listed.push(ExcludedEpisodes { task: task.clone(), what, why, seeds: vec![seed] }),
        }
    }
    listed.sort_by_key(|entry| (tasks::cohub().iter().position(|task| task.id == entry.task), entry.what));
    listed
}

/// Lists the episodes that were played again. This reveals a policy that crashes when it is about to fail and
/// succeeds in a later attempt.
fn played_again(group: &PolicyGroup) -> Vec<RepeatedEpisode> {
    let counted = group.episodes.iter().map(|found| &found.played);
    let repeated = counted.chain(group.excluded.iter().copied()).filter_map(|played| {
        let key =
            |played: &PlayedEpisode| (played.spec.task.id.clone(), played.spec.seed, played.start_phase());
        let elsewhere = group.superseded.iter().filter(|other| key(other) == key(played));
        let noted = |note: &Option<String>| note.clone().unwrap_or_else(|| "it failed".into());
        let earlier: Vec<String> = elsewhere
            .flat_map(|other| other.attempts.iter().map(|attempt| &attempt.note).chain([&other.note]))
            .chain(played.attempts.iter().map(|attempt| &attempt.note))
            .map(noted)
            .collect();
        let last = match (played.succeeded(), played.result.ended) {
            (true, _) => "success",
            (false, EndReason::PolicyFailed) => Exclusion::PolicyFailed.name(),
            (false, EndReason::SimulatorFailed) => Exclusion::SimulatorFailed.name(),
            (
                false,
                EndReason::TaskComplete
                | EndReason::StepBudgetExhausted
                | EndReason::WallClockExhausted
                | EndReason::Finished
                | EndReason::Abandoned,
            ) => "failure",
        };
        let (task, seed) = (played.spec.task.id.clone(), played.spec.seed);
        (!earlier.is_empty()).then(|| RepeatedEpisode { task, seed, earlier, last: last.into() })
    });
    repeated.collect()
}

/// Returns the number of the first counted phase that was not reached.
pub fn first_missed_phase(played: &PlayedEpisode) -> String {
    let counts = |phase: &usize| played.start_phase().is_none_or(|only| only == *phase);
    let mut phases = (0..played.spec.task.phases.len()).filter(counts);
    phases.find(|phase| !played.reached(*phase)).map(Phase::number).unwrap_or_default()
}

/// Returns the policy's own reason, or else the reason why the episode ended. The number of falls is
/// appended.
pub fn failure_cause(played: &PlayedEpisode) -> String {
    let ended = match played.result.ended {
        EndReason::TaskComplete => "the task was completed",
        EndReason::StepBudgetExhausted => "the steps ran out",
        EndReason::WallClockExhausted => "the policy's time ran out",
        EndReason::Finished => "the policy ended the episode",
        EndReason::Abandoned => "the policy went away",
        EndReason::PolicyFailed => "the policy itself failed",
        EndReason::SimulatorFailed => "the simulator failed",
    };
    let own = played
        .note
        .clone()
        .filter(|note| Some(note) != missed_phase_note(&played.result, played.start_phase()).as_ref());
    // Free text from a model differs between episodes.
    let why = played.result.model_endings().or(own).unwrap_or_else(|| ended.into());
    match played.result.falls {
        0 => why,
        1 => format!("{why}; a robot fell"),
        falls => format!("{why}; {falls} robots fell"),
    }
}
