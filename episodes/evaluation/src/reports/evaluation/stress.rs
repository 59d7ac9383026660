//! Robustness of policies: rates under stress, compared with rates on the same seeds without stress, and the
//! most harmful axis.

use std::collections::BTreeMap;

use serde::Serialize;
use tandem_episodes::{
    EpisodeSpec, Phase, Start,
    stress::{Stress, StressAxis},
    tasks::{self, Task},
};

use super::load::FoundEpisode;
use super::policy::{PolicyGroup, groups, rules_of};
use super::rate::{Rate, p_text, percent, signed};
use crate::reports::table::{NONE, Table};
use crate::results::PlayedEpisode;
use crate::statistics::{Count, Pairs, mcnemar, newcombe};

/// Results of one policy under stress. Rates are those of the last phase.
#[derive(Debug, Serialize)]
pub struct StressReport {
    /// The policy's name without stress.
    pub policy: String,
    pub protocol: &'static str,
    /// Rate without stress; `None` if no such episode was played.
    pub plain: Option<Rate>,
    /// Rows of all tasks together, by axis and level, followed by rows of each task.
    pub rows: Vec<StressRow>,
    /// Axis with the largest loss of rate, averaged over the levels that were played.
    pub hurts_most: Option<AxisLoss>,
}

/// One axis and level, for one task or for all tasks together.
#[derive(Debug, Serialize)]
pub struct StressRow {
    /// `None` for all tasks together.
    pub task: Option<String>,
    pub axis: StressAxis,
    pub level: u8,
    /// Variant of the axis, for example "drops what it holds"; `None` if the axis has none.
    pub kind: Option<&'static str>,
    pub rate: Rate,
    pub falls: u32,
    /// Comparison with the same tasks and seeds without stress; `None` if these were not played.
    pub paired: Option<PairedLoss>,
}

/// Rates of the same episodes with and without stress.
#[derive(Debug, Serialize)]
pub struct PairedLoss {
    /// Pairs of outcomes: without stress, then under stress.
    pub pairs: Pairs,
    /// Rate under stress minus rate without.
    pub difference_share: f64,
    /// Newcombe's 95 % interval of the difference.
    pub interval_share: [f64; 2],
    /// McNemar's exact test, two-sided.
    pub mcnemar_p_value: f64,
}

/// Loss of rate on one axis.
#[derive(Debug, Serialize)]
pub struct AxisLoss {
    pub axis: StressAxis,
    /// Mean difference over the levels of the axis.
    pub difference_share: f64,
}

/// A task, the hash of its file, and a seed.
type EpisodeKey<'a> = (&'a str, Option<&'a str>, u32);

/// Reports on the policies that were played under stress, in the order in which policies were found.
pub fn stress_reports<'a>(episodes: impl Iterator<Item = &'a FoundEpisode> + Clone) -> Vec<StressReport> {
    let mut policies: Vec<(Vec<String>, Vec<&PlayedEpisode>)> = Vec::new();
    let whole = episodes.clone().map(|found| &found.played).filter(|played| played.spec.start == Start::Task);
    for played in whole.filter(|played| played.counts()) {
        let key = without_stress(played);
        match policies.iter_mut().find(|(known, _)| *known == key) {
            Some((_, of_policy)) => of_policy.push(played),
            None => policies.push((key, vec![played])),
        }
    }
    let plain = groups(episodes.filter(|found| found.played.spec.stress.is_none()));
    let named = |key: &[String]| {
        let of_key = |group: &&PolicyGroup| {
            group.episodes.first().is_some_and(|found| without_stress(&found.played) == *key)
        };
        plain.iter().find(of_key).map_or(key[0].clone(), |group| group.name.clone())
    };
    let reports = policies.iter().map(|(key, played)| StressReport::of(named(key), played));
    reports.filter(|report| !report.rows.is_empty()).collect()
}

/// Returns the properties that all episodes of one policy share, with and without stress.
fn without_stress(played: &PlayedEpisode) -> Vec<String> {
    match played.spec.stress {
        None => rules_of(played),
        Some(_) => {
            let spec = EpisodeSpec { stress: None, ..played.spec.clone() };
            rules_of(&PlayedEpisode { spec, ..played.clone() })
        }
    }
}

impl StressReport {
    fn of(policy: String, played: &[&PlayedEpisode]) -> StressReport {
        let mut plain: BTreeMap<EpisodeKey, &PlayedEpisode> = BTreeMap::new();
        let mut stressed: BTreeMap<Stress, BTreeMap<EpisodeKey, &PlayedEpisode>> = BTreeMap::new();
        for one in played {
            let of = match one.spec.stress {
                None => &mut plain,
                Some(stress) => stressed.entry(stress).or_default(),
            };
            let task = &one.spec.task;
            of.entry((task.id.as_str(), task.file_xxh3(), one.spec.seed)).or_insert(one);
        }
        let row = |task: Option<&Task>, kind: Option<&'static str>, stress: &Stress| {
            let is_of = |one: &PlayedEpisode| {
                task.is_none_or(|task| one.spec.task == *task)
                    && kind.is_none_or(|kind| kind_of(one) == Some(kind))
            };
            let episodes = stressed.get(stress)?.iter().filter(|(_, one)| is_of(one));
            StressRow::of(
                task,
                kind,
                *stress,
                &episodes.map(|(key, one)| (*key, *one)).collect::<Vec<_>>(),
                &plain,
            )
        };
        let stresses: Vec<&Stress> = stressed.keys().collect();
        let mut rows: Vec<StressRow> = Vec::new();
        for stress in &stresses {
            rows.extend(row(None, None, stress));
            let mut kinds: Vec<&'static str> =
                stressed[*stress].values().filter_map(|one| kind_of(one)).collect();
            kinds.sort_unstable();
            kinds.dedup();
            rows.extend(kinds.into_iter().filter_map(|kind| row(None, Some(kind), stress)));
        }
        let all = played.iter().filter(|one| one.spec.stress.is_some()).map(|one| &one.spec.task);
        for task in tasks::in_order(all) {
            rows.extend(stresses.iter().filter_map(|stress| row(Some(task), None, stress)));
        }
        StressReport {
            policy,
            protocol: played.first().map_or("", |one| one.spec.protocol.name()),
            plain: rate(plain.values().copied()),
            hurts_most: hurts_most(&rows),
            rows,
        }
    }

    /// Returns the rows of all tasks together, with an axis's variants combined.
    pub fn overall(&self) -> impl Iterator<Item = &StressRow> {
        self.rows.iter().filter(|row| row.task.is_none() && row.kind.is_none())
    }
}

fn kind_of(played: &PlayedEpisode) -> Option<&'static str> {
    played.spec.stress?.kind(played.spec.world_seed())
}

fn rate<'a>(episodes: impl Iterator<Item = &'a PlayedEpisode>) -> Option<Rate> {
    let succeeded: Vec<bool> = episodes.map(PlayedEpisode::succeeded).collect();
    let successes = succeeded.iter().filter(|succeeded| **succeeded).count();
    Rate::of(Count { successes, trials: succeeded.len() })
}

impl StressRow {
    /// Creates a row; `None` without episodes.
    fn of(
        task: Option<&Task>,
        kind: Option<&'static str>,
        stress: Stress,
        episodes: &[(EpisodeKey, &PlayedEpisode)],
        plain: &BTreeMap<EpisodeKey, &PlayedEpisode>,
    ) -> Option<StressRow> {
        let mut pairs = Pairs::default();
        for (key, under) in episodes {
            let Some(without) = plain.get(key) else { continue };
            match (without.succeeded(), under.succeeded()) {
                (true, true) => pairs.both += 1,
                (true, false) => pairs.first_only += 1,
                (false, true) => pairs.second_only += 1,
                (false, false) => pairs.neither += 1,
            }
        }
        Some(StressRow {
            task: task.map(|task| task.id.clone()),
            axis: stress.axis,
            level: stress.level.number(),
            kind,
            rate: rate(episodes.iter().map(|(_, one)| *one))?,
            falls: episodes.iter().map(|(_, one)| one.result.falls).sum(),
            paired: PairedLoss::of(pairs),
        })
    }
}

impl PairedLoss {
    /// Returns the comparison; `None` without pairs.
    fn of(pairs: Pairs) -> Option<PairedLoss> {
        Some(PairedLoss {
            difference_share: pairs.difference_share()?,
            interval_share: newcombe(pairs)?,
            mcnemar_p_value: mcnemar(pairs),
            pairs,
        })
    }

    /// Formats the difference and its interval in percentage points.
    pub fn text(&self) -> String {
        let [low, high] = self.interval_share.map(signed);
        format!("{} [{low}, {high}]", signed(self.difference_share))
    }
}

/// Returns the axis with the largest mean loss; `None` if no axis has a loss.
fn hurts_most(rows: &[StressRow]) -> Option<AxisLoss> {
    let losses = StressAxis::ALL.into_iter().filter_map(|axis| {
        let of_axis = rows.iter().filter(|row| row.axis == axis && row.task.is_none() && row.kind.is_none());
        let differences: Vec<f64> =
            of_axis.filter_map(|row| Some(row.paired.as_ref()?.difference_share)).collect();
        let mean = differences.iter().sum::<f64>() / differences.len() as f64;
        (mean < 0.0).then_some(AxisLoss { axis, difference_share: mean })
    });
    losses.min_by(|one, other| one.difference_share.total_cmp(&other.difference_share))
}

/// Returns the tables of one policy: all tasks together, then each task.
pub fn tables(report: &StressReport) -> [Table; 2] {
    [overall_table(report), task_table(report)]
}

fn overall_table(report: &StressReport) -> Table {
    let without = report
        .plain
        .map_or(String::new(), |plain| format!(" Without stress: {} %, {}.", plain.text(), plain.fraction()));
    let most = report.hurts_most.as_ref().map_or(String::new(), |loss| {
        let points = percent(-loss.difference_share);
        format!(" What hurts most is {}: {points} points in the mean of its levels.", loss.axis.name())
    });
    let note = format!(
        "Last phases of all tasks together, percent with the exact 95 % interval (Clopper-Pearson).{without}{most} The difference is the rate \
         under stress less that of the same tasks and seeds without, in points, with Newcombe's 95 % interval for paired rates; p is \
         McNemar's exact test, two-sided, not corrected for the number of rows. Lost and won: pairs that only the plain run, and that \
         only the run under stress succeeded in."
    );
    let mut table = Table::new(
        format!("What is left under stress: {}", report.policy),
        &note,
        &["Axis", "Level", "Rate", "Of", "Difference", "Lost", "Won", "p", "Falls"],
        2,
    );
    for row in report.rows.iter().filter(|row| row.task.is_none()) {
        let axis = match row.kind {
            Some(kind) => format!("{}: {kind}", row.axis.name()),
            None => row.axis.name().into(),
        };
        let words = [axis, row.level.to_string(), row.rate.text(), row.rate.fraction()];
        let paired = match &row.paired {
            Some(paired) => [
                paired.text(),
                paired.pairs.first_only.to_string(),
                paired.pairs.second_only.to_string(),
                p_text(paired.mcnemar_p_value),
            ],
            None => [NONE; 4].map(String::from),
        };
        table.rows.push(words.into_iter().chain(paired).chain([row.falls.to_string()]).collect());
    }
    table
}

fn task_table(report: &StressReport) -> Table {
    let mut table = Table::new(
        format!("What is left under stress, task by task: {}", report.policy),
        "Last phases: successes of episodes at each level, with the difference to the same seeds without stress in points and Newcombe's \
         95 % interval.",
        &["Task", "Axis"],
        2,
    );
    let mut levels: Vec<u8> = report.overall().map(|row| row.level).collect();
    levels.sort_unstable();
    levels.dedup();
    table.head.extend(levels.iter().map(|level| format!("Level {level}")));
    let of_tasks = || report.rows.iter().filter(|row| row.task.is_some());
    let mut places: Vec<(Option<&str>, StressAxis)> =
        of_tasks().map(|row| (row.task.as_deref(), row.axis)).collect();
    places.dedup();
    for (task, axis) in places {
        let cell = |level: &u8| {
            let row =
                of_tasks().find(|row| (row.task.as_deref(), row.axis, row.level) == (task, axis, *level));
            row.map_or(NONE.into(), |row| match &row.paired {
                Some(paired) => format!("{}, {}", row.rate.fraction(), paired.text()),
                None => row.rate.fraction(),
            })
        };
        let words = [task.unwrap_or_default().to_owned(), axis.name().to_owned()];
        table.rows.push(words.into_iter().chain(levels.iter().map(cell)).collect());
    }
    table
}

/// Returns a line for each rate of each task, in the same format as the other lines of the CSV file.
pub fn csv_lines(report: &StressReport, quoted: &dyn Fn(&str) -> String) -> Vec<String> {
    let line = |row: &StressRow| {
        let task = tasks::built_in().find(|task| row.task.as_ref() == Some(&task.id))?;
        let last = task.phases.len() - 1;
        let Rate { successes, trials, share, interval_share: [low_share, high_share] } = row.rate;
        let of = format!("{},{},{},{}", quoted(&report.policy), report.protocol, task.id, task.robots.len());
        let phase = &task.phases[last];
        let which = format!("{},{},{}", Phase::number(last), phase.id, phase.collaborative);
        let name = format!("stress_{}_{}", row.axis.name(), row.level);
        Some(format!("{of},{which},{name},{successes},{trials},{share},{low_share},{high_share},,,,,,\n"))
    };
    report.rows.iter().filter_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reports::evaluation::tests::{found, played};
    use crate::reports::evaluation::{EvaluationReport, ReportFormat, ReportPictures, load};
    use tandem_episodes::stress::StressLevel;

    /// Returns a report on twenty seeds of Handover. Without stress, 18 succeed. Stress is on two axes: push
    /// at two levels, and partner at one.
    fn under_stress() -> EvaluationReport {
        let task = tasks::find("handover").unwrap();
        let episode = |stress: Option<(StressAxis, StressLevel)>, seed: u32, succeeds: bool| {
            let mut one = played("agent", &task, seed, if succeeds { 3 } else { 1 });
            one.spec.stress = stress.map(|(axis, level)| Stress { axis, level });
            one
        };
        let mut episodes: Vec<PlayedEpisode> = (0..20).map(|seed| episode(None, seed, seed < 18)).collect();
        for (axis, level, succeed) in [
            (StressAxis::Push, StressLevel::One, 16),
            (StressAxis::Push, StressLevel::Three, 6),
            (StressAxis::Partner, StressLevel::One, 17),
        ] {
            episodes.extend((0..20).map(|seed| episode(Some((axis, level)), seed, seed < succeed)));
        }
        EvaluationReport::of(&found(episodes))
    }

    #[test]
    fn rates_under_stress_stand_beside_the_same_seeds_without() {
        let report = under_stress();
        assert_eq!(report.policies.len(), 1, "stress makes no other policy");
        assert_eq!(report.policies[0].episodes, 20);
        let [stress] = &report.stress[..] else { panic!("{:?}", report.stress) };
        assert_eq!((stress.policy.as_str(), stress.plain.unwrap().fraction()), ("agent", "18/20".into()));
        let push = stress.overall().find(|row| (row.axis, row.level) == (StressAxis::Push, 3)).unwrap();
        let paired = push.paired.as_ref().unwrap();
        let expected = Pairs { both: 6, first_only: 12, second_only: 0, neither: 2 };
        assert_eq!((push.rate.fraction(), paired.pairs), ("6/20".into(), expected));
        // Equivalent to twelve heads in twelve tosses.
        assert!((paired.mcnemar_p_value - 2.0 / 4096.0).abs() < 1e-9);
        let most = stress.hurts_most.as_ref().unwrap();
        assert_eq!((most.axis, percent(most.difference_share)), (StressAxis::Push, "-35".into()));
        // Seeds cycle through the kinds of a partner's failure.
        let kinds = stress.rows.iter().filter(|row| row.kind.is_some());
        assert_eq!(kinds.map(|row| row.rate.trials).collect::<Vec<_>>(), [4; 5]);
    }

    /// Folder layout of `evaluate --stress`: stress evaluations are in the folder of the plain evaluation.
    #[test]
    fn what_lies_in_the_folder_of_the_plain_run_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let task = tasks::find("handover").unwrap();
        for (place, level) in [("", None), ("stress/push-1", Some(StressLevel::One))] {
            let episodes = folder.path().join(place).join("episodes");
            std::fs::create_dir_all(&episodes).unwrap();
            let mut one = played("agent", &task, 7, 3);
            one.spec.stress = level.map(|level| Stress { axis: StressAxis::Push, level });
            std::fs::write(episodes.join("handover-7.json"), serde_json::to_string(&one).unwrap()).unwrap();
        }
        let report = EvaluationReport::of(&load(&[folder.path().to_owned()]).unwrap());
        let [stress] = &report.stress[..] else { panic!("{:?}", report.stress) };
        let paired = stress.overall().next().unwrap().paired.as_ref().unwrap();
        assert_eq!((report.policies[0].episodes, paired.pairs.both), (1, 1));
        // The folder of a single axis and level is reported like any other.
        let alone = EvaluationReport::of(&load(&[folder.path().join("stress/push-1")]).unwrap());
        assert_eq!(alone.policies[0].name, "agent + stress: push-1");
    }

    #[test]
    fn a_report_shows_them_in_every_format() {
        let report = under_stress();
        let write = |format| report.write(format, &ReportPictures::default()).unwrap();
        let text = write(ReportFormat::Markdown);
        for part in [
            "## What is left under stress: agent",
            "What hurts most is push: 35 points in the mean of its levels.",
            "| push | 3 | 30 [11.9, 54.3] | 6/20 | -60 [",
            "| partner: walks off | 1 |",
            "| handover | push | 16/20, -10 [",
        ] {
            assert!(text.contains(part), "no {part}: {text}");
        }
        let page = write(ReportFormat::Html);
        assert!(page.contains("<h2>Under stress</h2>") && page.contains("push, level 3: 30 "), "{page}");
        assert!(
            write(ReportFormat::Csv)
                .contains("agent,benchmark,handover,2,p3,place,false,stress_push_3,6,20,")
        );
        assert!(write(ReportFormat::Json).contains(r#""axis": "push""#));
        assert!(write(ReportFormat::Tex).contains("partner: walks off"));
    }
}
