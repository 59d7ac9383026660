//! The report's tables, built once for all formats.

mod models;

use super::compare::{Comparison, PairedRow};
use super::costs::{EpisodeCosts, ValueRange};
use super::floor::TaskFloor;
use super::policy::{PolicyReport, TaskReport};
use super::rate::{MeanRate, Rate, p_text, percent, signed};
use super::went_wrong::FailureMoment;
use super::{EvaluationReport, PublishedRates, header, stress};
use crate::reports::table::{NONE, Table};
use crate::results::named;
use crate::statistics::Count;
use models::{agents, asked, endings};

/// Returns all tables that have rows.
pub fn all(report: &EvaluationReport) -> Vec<Table> {
    let policies = &report.policies;
    let mut tables = vec![header::settings(&report.header), header::processes(&report.header)];
    tables.extend(policies.iter().map(rates));
    tables.extend(report.stress.iter().flat_map(stress::tables));
    tables.push(floors(&report.floors));
    tables.push(averages(policies));
    tables.push(together(policies));
    tables.push(shown(policies));
    tables.push(agents(policies));
    tables.push(asked(policies));
    tables.push(endings(policies));
    tables.push(effort(policies));
    tables.push(clamped(policies));
    tables.push(reasons(policies));
    tables.push(went_wrong(report));
    tables.push(excluded(policies));
    tables.push(played_again(policies));
    tables.extend(report.comparisons.iter().map(comparison));
    tables.push(published(&report.published));
    tables.push(published_together(report));
    tables.retain(|table| !table.rows.is_empty());
    tables
}

/// Lists the joint targets beyond the joints' limits.
fn clamped(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "Joint targets beyond limits",
        "Share of the joint targets that lay beyond the joints' limits and were moved there, percent. A large one may mean degrees \
         in place of radians, or joints in another order.",
        &["Policy", "Task", "Beyond"],
        2,
    );
    for policy in policies {
        let shares = policy.tasks.iter().filter_map(|task| Some((&task.task, task.joints_clamped_share?)));
        let row = |(task, share): (&String, f64)| vec![policy.name.clone(), task.clone(), percent(share)];
        table.rows.extend(shares.map(row));
    }
    table
}

pub fn rates(policy: &PolicyReport) -> Table {
    let mut table = Table::new(
        format!("Phases: {}", policy.name),
        "Percent with the exact 95 % interval (Clopper-Pearson). Cumulative: of all episodes that count. Conditional: of those that reached \
         the phase before. From its beginning: of episodes that began where the phase begins.",
        &["Task", "Phase", "Robots work", "Cumulative", "Conditional", "From its beginning"],
        3,
    );
    let text =
        |rate: Option<Rate>| rate.map_or(NONE.into(), |rate| format!("{} {}", rate.text(), rate.fraction()));
    for task in &policy.tasks {
        for phase in &task.phases {
            table.rows.push(vec![
                task.task.clone(),
                format!("{} {}", phase.number, phase.id.replace('_', " ")),
                if phase.collaborative { "together" } else { "alone" }.into(),
                text(phase.cumulative),
                text(phase.conditional),
                text(phase.from_its_beginning),
            ]);
        }
    }
    table
}

fn floors(floors: &[TaskFloor]) -> Table {
    let named: Vec<String> = floors.iter().filter(|floor| floor.is_high).map(task_of).collect();
    let high = match &named[..] {
        [] => "Of none of these tasks it is above 50 %.".into(),
        named => format!(
            "It is above 50 % of {}: there a high rate says little of what a policy sees; one with `--spread 2` or `4` says more.",
            named.join(", ")
        ),
    };
    let note = format!(
        "What needs no eyes, in percent of episodes with the exact 95 % interval: robots that hold still (idle), and what the robots \
         of a demonstration of another seed were told, replayed without a look (open-loop). {high}"
    );
    let mut table = Table::new("The floor", &note, &["Task", "Player", "Measured"], 3);
    let phases = floors.iter().flat_map(|floor| &floor.players).map(|rate| rate.phases.len());
    table.head.extend((0..phases.max().unwrap_or_default()).map(tandem_episodes::Phase::number));
    for floor in floors {
        for rate in &floor.players {
            let words = [task_of(floor), rate.player.into(), format!("{}, {}", rate.measured, rate.protocol)];
            let figures = rate.phases.iter().map(|phase| format!("{} {}", phase.text(), phase.fraction()));
            table.rows.push(words.into_iter().chain(figures).collect());
        }
    }
    table
}

/// Returns the name of the task, with its departures from the benchmark.
fn task_of(floor: &TaskFloor) -> String {
    named(&floor.task, &floor.departures)
}

fn averages(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "Averages over tasks",
        "Mean of the tasks' cumulative rates in percent; the last phase is the whole task. Intervals of 95 % from the tasks' exact \
         limits (Zou and Donner).",
        &["Policy", "Tasks"],
        2,
    );
    let phases = policies.iter().flat_map(|policy| &policy.averages).map(|average| average.phases.len());
    table.head.extend((0..phases.max().unwrap_or_default()).map(tandem_episodes::Phase::number));
    for policy in policies {
        for average in &policy.averages {
            let plural = if average.tasks == 1 { "" } else { "s" };
            let tasks = format!("{} task{plural} of {} robots", average.tasks, average.robots);
            let means = average.phases.iter().map(|mean| mean_text(mean.as_ref()));
            table.rows.push([policy.name.clone(), tasks].into_iter().chain(means).collect());
        }
    }
    table
}

fn mean_text(mean: Option<&MeanRate>) -> String {
    mean.map_or(NONE.into(), MeanRate::text)
}

fn together(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "Working alone and working together",
        "Means of phases in percent, over the tasks of two robots as the benchmark has them; those of three robots apart. Conditional: \
         given the phase before. From their beginnings: each episode begins where the phase begins in a demonstration. The drop is \
         relative to working alone.",
        &["Policy", "Tasks", "Rates", "Alone", "Together", "Gap (points)", "Drop"],
        3,
    );
    let mut add =
        |policy: &PolicyReport, robots: usize, rates: &str, texts: [String; 2], shares: [Option<f64>; 2]| {
            let gap = shares[0].zip(shares[1]).map(|(alone, together)| together - alone);
            let drop = gap.zip(shares[0]).filter(|(_, alone)| *alone > 0.0).map(|(gap, alone)| -gap / alone);
            let [alone, together] = texts;
            table.rows.push(vec![
                policy.name.clone(),
                format!("of {robots} robots"),
                rates.into(),
                alone,
                together,
                gap.map_or(NONE.into(), signed),
                drop.map_or(NONE.into(), |drop| format!("{} %", percent(drop))),
            ]);
        };
    for policy in policies {
        for means in &policy.together {
            let of_both = [&means.alone, &means.together];
            let shares = of_both.map(|mean| mean.as_ref().map(|mean| mean.mean_share));
            let texts = of_both.map(|mean| mean_text(mean.as_ref()));
            add(policy, means.robots, "conditional", texts, shares);
        }
        let Some(level) = &policy.phase_level else { continue };
        for (robots, means) in level.means() {
            let mean = |together: bool| {
                let of_robots = level.phases.iter().filter(|rate| rate.robots == robots);
                let phases = of_robots.filter(|rate| rate.collaborative == together);
                MeanRate::of(phases.map(|rate| Count { successes: rate.reached, trials: rate.episodes }))
            };
            let texts = [mean(false), mean(true)].map(|mean| mean_text(mean.as_ref()));
            let shares = [means.non_collaborative_share, means.collaborative_share];
            add(policy, robots, "from their beginnings", texts, shares);
        }
    }
    table
}

fn shown(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "Shown beyond the benchmark",
        "What policies were shown that the benchmark's own are not: in how many of the episodes, and how many replies showed it of \
         each robot.",
        &["Policy", "Information", "Replies by robot", "Episodes"],
        3,
    );
    for policy in policies {
        for shown in &policy.shown {
            let replies = shown.replies.iter().map(|(robot, count)| format!("{robot} {count}"));
            let replies = replies.collect::<Vec<_>>().join(", ");
            table.rows.push(vec![
                policy.name.clone(),
                shown.what.replace('_', " "),
                if replies.is_empty() { NONE.into() } else { replies },
                format!("{}/{}", shown.episodes, policy.episodes),
            ]);
        }
    }
    table
}

fn effort(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "Effort and falls",
        "Of episodes from the task's beginning: median, least to most. A control step is 20 ms; thinking is the policy's own time.",
        &["Policy", "Task", "Episodes", "Steps", "Calls", "Thinking (s)", "Falls"],
        2,
    );
    let row = |policy: &PolicyReport, task: &TaskReport, effort: &EpisodeCosts| {
        let text = |spread: &ValueRange, decimals: usize| {
            let ValueRange { min, median_value, max } = spread;
            format!("{median_value:.decimals$} ({min:.decimals$}-{max:.decimals$})")
        };
        vec![
            policy.name.clone(),
            task.task.clone(),
            task.episodes.to_string(),
            text(&effort.steps, 0),
            text(&effort.calls, 0),
            text(&effort.thought, 1),
            task.falls.to_string(),
        ]
    };
    for policy in policies {
        let rows = policy.tasks.iter().filter_map(|task| Some(row(policy, task, task.effort.as_ref()?)));
        table.rows.extend(rows);
    }
    table
}

fn reasons(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "Why episodes failed",
        "The first phase that was missed, and what the policy said or why the episode ended.",
        &["Policy", "Task", "Stuck before", "Why", "Episodes", "Seeds"],
        4,
    );
    for policy in policies {
        for reason in &policy.reasons {
            let seeds: Vec<String> = reason.seeds.iter().map(u32::to_string).collect();
            table.rows.push(vec![
                policy.name.clone(),
                reason.task.clone(),
                reason.phase.clone(),
                reason.why.clone(),
                seeds.len().to_string(),
                seeds.join(", "),
            ]);
        }
    }
    table
}

fn went_wrong(report: &EvaluationReport) -> Table {
    let (listed, recorded) = (report.failure_moments.len(), report.recorded_failures);
    let most = match recorded > listed {
        true => format!(
            " Listed are {listed} of {recorded} that were recorded; `report --failures {recorded}` lists all."
        ),
        false => String::new(),
    };
    let note = format!(
        "The first fall of a robot, or the first drop of an object, after the last phase that was reached; \
         else the end. Times open the episode's page a second before, on a `tandem serve` whose runs folder \
         has the recording, once its link has been opened. Pages are files beside the report.{most}"
    );
    let mut table = Table::new(
        "Where episodes went wrong",
        &note,
        &["Policy", "Task", "Seed", "Stuck before", "What", "Page", "At (s)"],
        6,
    );
    let order = |name: &String| {
        report.policies.iter().position(|policy| policy.name == *name).unwrap_or(report.policies.len())
    };
    let mut moments: Vec<&FailureMoment> = report.failure_moments.iter().collect();
    moments.sort_by_key(|moment| order(&moment.policy));
    for (row, moment) in moments.into_iter().enumerate() {
        let FailureMoment { policy, task, seed, phase, what, time_s, watch, page } = moment;
        let named = if page.is_some() { "page" } else { NONE };
        let cells = [policy.as_str(), task, &seed.to_string(), phase, what, named, &format!("{time_s:.1}")];
        table.rows.push(cells.map(str::to_owned).to_vec());
        table.links.extend(page.iter().map(|page| ((row, 5), page.clone())));
        table.links.insert((row, 6), watch.clone());
    }
    table
}

fn excluded(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "Not counted",
        "Episodes in which the policy itself failed (its program or its server crashed or was gone), or the simulator. They are in \
         no rate, and `evaluate` plays them again, those of the policy as often as `--retries` has it.",
        &["Policy", "Task", "What", "Why", "Episodes", "Seeds"],
        4,
    );
    for policy in policies {
        for entry in &policy.excluded {
            let seeds: Vec<String> = entry.seeds.iter().map(u32::to_string).collect();
            table.rows.push(vec![
                policy.name.clone(),
                entry.task.clone(),
                entry.what.name().into(),
                entry.why.clone(),
                seeds.len().to_string(),
                seeds.join(", "),
            ]);
        }
    }
    table
}

fn played_again(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "Played again",
        "Episodes of which earlier attempts did not count. A policy that fails itself where it is about to lose, and wins another time, is \
         found here.",
        &["Policy", "Task", "Seed", "Earlier attempts", "Why they failed", "The last one"],
        6,
    );
    for policy in policies {
        for again in &policy.played_again {
            table.rows.push(vec![
                policy.name.clone(),
                again.task.clone(),
                again.seed.to_string(),
                again.earlier.len().to_string(),
                again.earlier.join("; "),
                again.last.clone(),
            ]);
        }
    }
    table
}

fn comparison(comparison: &Comparison) -> Table {
    let Comparison { first, second, rows } = comparison;
    let mut table = Table::new(
        format!("{second} against {first}, on the same seeds"),
        "Pairs of episodes of the same task and seed. The difference is the second rate less the first, in points, with Newcombe's \
         95 % interval for paired rates; p is McNemar's exact test, two-sided, not corrected for the number of rows.",
        &["Task", "Phase", "Pairs", "Both", "Only first", "Only second", "Neither", "Difference", "p"],
        2,
    );
    let counted = rows.iter().filter(|row| row.last || row.task.is_none());
    table.rows.extend(counted.map(paired_row));
    table
}

fn paired_row(row: &PairedRow) -> Vec<String> {
    let pairs = row.pairs;
    let counts = [pairs.total(), pairs.both, pairs.first_only, pairs.second_only, pairs.neither];
    let [low, high] = row.interval_share.map(signed);
    let words = [row.task.as_deref().unwrap_or("all tasks").to_owned(), row.phase.clone()];
    let figures = [format!("{} [{low}, {high}]", signed(row.difference_share)), p_text(row.mcnemar_p_value)];
    words.into_iter().chain(counts.map(|count| count.to_string())).chain(figures).collect()
}

/// Returns a row for each method, and a column for each task that was played.
pub fn published(rows: &[PublishedRates]) -> Table {
    let mut table = Table::new(
        "Published, on another scale",
        "CoHuB's own figures for its baselines in Isaac Sim, percent of p1 / p2 / p3, over 100 episodes, of GPT-6 Astra over 10. \
         Physics, controller, rooms and pictures differ: in six of the ten tasks one demonstration that is replayed blindly in Tandem \
         beats the best of these policies. For orientation, not for comparison.",
        &["Method (another scale)"],
        1,
    );
    let mut tasks: Vec<&str> = Vec::new();
    let mut methods: Vec<&str> = Vec::new();
    for row in rows {
        for (names, name) in [(&mut tasks, &row.task), (&mut methods, &row.method)] {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
    }
    table.head.extend(tasks.iter().map(|task| task.to_string()));
    for method in methods {
        let cell = |task: &&str| {
            let found = rows.iter().find(|row| row.method == method && row.task == **task);
            let text = |row: &PublishedRates| {
                row.phases_share.iter().map(|share| percent(*share)).collect::<Vec<_>>()
            };
            found.map_or(NONE.into(), |row| text(row).join(" / "))
        };
        table.rows.push(std::iter::once(method.to_owned()).chain(tasks.iter().map(cell)).collect());
    }
    table
}

/// Lists the published averages. They are shown only if the report has phase-level rates.
fn published_together(report: &EvaluationReport) -> Table {
    let mut table = Table::new(
        "Published from the phases' beginnings, on another scale",
        "CoHuB's means over the phases of its tasks of two robots, each phase begun at in 50 demonstrations, percent.",
        &["Method (another scale)", "Alone", "Together", "Gap (points)", "Drop"],
        1,
    );
    if report.policies.iter().any(|policy| policy.phase_level.is_some()) {
        table.rows.extend(report.published_averages.iter().map(|row| {
            let (alone, together) = (row.non_collaborative_share, row.collaborative_share);
            let drop = format!("{} %", percent((alone - together) / alone));
            vec![row.method.clone(), percent(alone), percent(together), signed(together - alone), drop]
        }));
    }
    table
}
