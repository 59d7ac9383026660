//! Floors: success of policies without perception, which hold still or replay a demonstration of another
//! seed. A policy whose rate is not higher has not shown that it uses its observations.

use std::collections::BTreeSet;

use serde::Serialize;
use tandem_episodes::{
    EpisodeSpec, Variation,
    tasks::{self, Spread},
};
use tandem_tools_spec::Assistance;

use super::policy::{PhaseReport, PolicyGroup, PolicyReport};
use super::rate::Rate;
use crate::results::{IDLE, OPEN_LOOP, PlayedEpisode};
use crate::statistics::Count;

/// Earlier measurements, for reports without such policies.
const SHIPPED: &str = include_str!("floors.csv");

/// Policies without perception.
const PLAYERS: [&str; 2] = [IDLE, OPEN_LOOP];

/// Success rate of a floor above which success in the task says little about a policy's perception.
const HIGH_SHARE: f64 = 0.5;

/// The floor of one task.
#[derive(Debug, Serialize)]
pub struct TaskFloor {
    pub task: String,
    /// Departures of its episodes from the benchmark, except for those about information that policies are
    /// shown.
    pub departures: Vec<String>,
    pub players: Vec<FloorRate>,
    /// True if any of the players succeeds in more than half of the episodes.
    pub is_high: bool,
}

/// Rates of a policy without perception.
#[derive(Clone, Debug, Serialize)]
pub struct FloorRate {
    pub player: &'static str,
    pub protocol: String,
    /// Source of the figures: the report's own episodes, or seeds and build of earlier measurements.
    pub measured: String,
    /// Cumulative rates, by phase.
    pub phases: Vec<Rate>,
}

/// Task and departures to which a floor applies.
type FloorKey = (String, Vec<String>);

/// Returns the floors of all played tasks in the order of the task list. Tasks with an unknown floor are left
/// out.
pub fn floors(groups: &[PolicyGroup], policies: &[PolicyReport]) -> Vec<TaskFloor> {
    let places: BTreeSet<FloorKey> =
        groups.iter().flat_map(|group| &group.episodes).map(|found| place(&found.played)).collect();
    let shipped = shipped();
    let of_place = |key: FloorKey| {
        let players: Vec<FloorRate> = PLAYERS
            .into_iter()
            .filter_map(|player| {
                let beside = groups.iter().zip(policies);
                let beside = beside.filter(|(group, _)| plays_as(group, player));
                let mut beside = beside.filter_map(|(group, policy)| {
                    let same = |played: &PlayedEpisode| place(played) == key;
                    let measured = group.episodes.iter().any(|found| same(&found.played));
                    measured.then(|| FloorRate::beside(player, &key.0, policy)).flatten()
                });
                let earlier = || {
                    let same = |(at, rate): &&(FloorKey, FloorRate)| rate.player == player && *at == key;
                    shipped.iter().find(same).map(|(_, rate)| rate.clone())
                };
                beside.next().or_else(earlier)
            })
            .collect();
        let solved = |rate: &FloorRate| rate.phases.last().is_some_and(|last| last.share > HIGH_SHARE);
        let is_high = players.iter().any(solved);
        let (task, departures) = key;
        (!players.is_empty()).then_some(TaskFloor { task, departures, players, is_high })
    };
    let mut floors: Vec<TaskFloor> = places.into_iter().filter_map(of_place).collect();
    floors.sort_by_key(|floor| tasks::cohub().iter().position(|task| task.id == floor.task));
    floors
}

/// Returns the task and the departures of an episode. Departures about information for policies are ignored,
/// because they do not affect a policy without perception.
fn place(played: &PlayedEpisode) -> FloorKey {
    let spec = EpisodeSpec { instructions: None, ..played.spec.clone() }.assisted(Assistance::Paper);
    (spec.task.id.clone(), spec.peculiarities())
}

fn plays_as(group: &PolicyGroup, player: &str) -> bool {
    let Some(found) = group.episodes.first() else { return false };
    let card = &found.played.policy;
    match &card.settings {
        Some(settings) => player == OPEN_LOOP && settings.get(OPEN_LOOP).is_some(),
        None => card.name == player,
    }
}

impl FloorRate {
    /// Returns the rates of a player in this report; `None` if it has played no whole episode of the task.
    fn beside(player: &'static str, task: &str, policy: &PolicyReport) -> Option<FloorRate> {
        let of_task = policy.tasks.iter().find(|of| of.task == task)?;
        let rates: Option<Vec<Rate>> =
            of_task.phases.iter().map(|phase: &PhaseReport| phase.cumulative).collect();
        Some(FloorRate {
            player,
            protocol: policy.protocol.into(),
            measured: "in this report".into(),
            phases: rates?,
        })
    }
}

/// Returns the earlier measurements, with their tasks and departures.
fn shipped() -> Vec<(FloorKey, FloorRate)> {
    SHIPPED.lines().skip(1).filter_map(shipped_row).collect()
}

fn shipped_row(line: &str) -> Option<(FloorKey, FloorRate)> {
    let cells: Vec<&str> = line.split(',').collect();
    let [player, task, spread, protocol, first_seed, last_seed, build, trials, reached @ ..] = &cells[..]
    else {
        return None;
    };
    let task = tasks::find(task).ok()?;
    let spread = Spread::ALL.into_iter().find(|known| known.name() == *spread)?;
    let trials = trials.parse().ok()?;
    let rate = |cell: &&str| Rate::of(Count { successes: cell.parse().ok()?, trials });
    let spec = EpisodeSpec {
        variation: Variation { spread, ..Variation::default() },
        ..EpisodeSpec::new(&task, 0, tandem_tools_spec::Protocol::Benchmark).assisted(Assistance::Paper)
    };
    let rate = FloorRate {
        player: PLAYERS.into_iter().find(|known| known == player)?,
        protocol: (*protocol).into(),
        measured: format!("earlier: seeds {first_seed}-{last_seed}, build {build}"),
        phases: reached.iter().map(rate).collect::<Option<_>>()?,
    };
    Some(((spec.task.id.clone(), spec.peculiarities()), rate))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{found, nine_six_three, played};
    use super::super::{EvaluationReport, ReportFormat, ReportPictures};
    use super::*;
    use crate::results::PolicyCard;
    use tandem_episodes::tasks::Task;

    /// Returns an episode of the player that replays a demonstration without observations.
    fn blind(task: &Task, seed: u32, phases: usize) -> PlayedEpisode {
        let settings = Some(serde_json::json!({ OPEN_LOOP: ["handover 2000 0123456789abcdef"] }));
        let played = played(OPEN_LOOP, task, seed, phases);
        PlayedEpisode { policy: PolicyCard { settings, ..OPEN_LOOP.into() }, ..played }
    }

    #[test]
    fn a_report_has_the_floor_of_its_tasks_and_names_those_where_it_is_high() {
        let handover = tasks::find("handover").unwrap();
        let mut episodes = nine_six_three("agent");
        episodes.extend((0..10).map(|seed| blind(&handover, seed, if seed < 6 { 3 } else { 1 })));
        episodes.extend((0..4).map(|seed| played("idle", &handover, seed, 0)));
        let floor = |episodes: Vec<PlayedEpisode>| EvaluationReport::of(&found(episodes));
        let report = floor(episodes.clone());
        let [of_task] = &report.floors[..] else { panic!("{:?}", report.floors) };
        let rates: Vec<_> =
            of_task.players.iter().map(|rate| (rate.player, rate.phases[2].fraction())).collect();
        assert_eq!(rates, [("idle", "0/4".into()), ("open-loop", "6/10".into())]);
        assert!(of_task.is_high && of_task.players[1].measured == "in this report", "{of_task:?}");
        let text = report.write(ReportFormat::Markdown, &ReportPictures::default()).unwrap();
        assert!(text.contains("## The floor") && text.contains("It is above 50 % of handover:"), "{text}");
        assert!(text.contains("60 [26.2, 87.8] 6/10"), "{text}");

        // A floor belongs to a task and its departures: a wider spread has a different floor.
        let spec = |played: &PlayedEpisode| EpisodeSpec {
            variation: Variation { spread: Spread::Double, ..Variation::default() },
            ..played.spec.clone()
        };
        let wide = nine_six_three("agent");
        let mut wide: Vec<_> =
            wide.into_iter().map(|played| PlayedEpisode { spec: spec(&played), ..played }).collect();
        wide.extend((0..10).map(|seed| blind(&handover, seed, 3)));
        let of_wide = |report: &EvaluationReport| {
            let floors = report.floors.iter().filter(|floor| floor.departures == ["spread: 2"]);
            floors.flat_map(|floor| &floor.players).filter(|rate| rate.measured == "in this report").count()
        };
        assert_eq!(of_wide(&floor(wide.clone())), 0);
        let still = played("idle", &handover, 1, 0);
        wide.push(PlayedEpisode { spec: spec(&still), ..still });
        assert_eq!(of_wide(&floor(wide)), 1);
    }

    #[test]
    fn every_line_of_the_earlier_figures_is_read() {
        let rows = shipped();
        assert_eq!(rows.len(), SHIPPED.lines().count() - 1);
        for ((task, departures), rate) in rows {
            let task = tasks::find(&task).unwrap();
            assert_eq!(rate.phases.len(), task.phases.len(), "{rate:?}");
            assert!(rate.phases.is_sorted_by(|one, next| one.successes >= next.successes), "{rate:?}");
            assert!(departures.iter().all(|text| text.starts_with("spread: ")), "{departures:?}");
        }
    }
}
