//! The report as one page that needs nothing else: no script, no font, no picture from elsewhere.

mod plot;

use base64::{Engine, prelude::BASE64_STANDARD};

use super::EvaluationReport;
use super::gallery::Failure;
use super::policy::PolicyReport;
use super::rate::percent;
use super::tables::{self, Table};
use crate::output::html::escape;
use plot::{SERIES, task_plot};

const STYLE: &str = include_str!("style.css");

/// The page.
pub fn html(report: &EvaluationReport, failures: &[Failure]) -> String {
    let policies = &report.policies;
    let names: Vec<String> = policies.iter().map(|policy| escape(&policy.name)).collect();
    format!(
        r#"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Tandem: {title}</title>
<style>
{STYLE}</style>
</head>
<body>
<h1>{title}</h1>
<p class="soft">{episodes} episodes over {tasks} tasks, played in Tandem.</p>
<div class="cards">{cards}</div>
<h2>How far episodes got</h2>
{legend}
<div class="plots">{plots}</div>
{tables}
{gallery}
{skipped}
</body>
</html>
"#,
        title = in_words(&names),
        episodes = policies.iter().map(|policy| policy.episodes).sum::<usize>(),
        tasks = tasks(report).len(),
        cards = policies.iter().enumerate().map(|(index, policy)| card(index, policy)).collect::<String>(),
        legend = legend(policies),
        plots = tasks(report).iter().map(|task| task_plot(task, policies)).collect::<String>(),
        tables = tables::all(report).iter().map(table).collect::<String>(),
        gallery = gallery(failures, policies),
        skipped = skipped(report),
    )
}

/// The names in a sentence, as "a, b and c".
fn in_words(names: &[String]) -> String {
    match names.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} and {last}", others.join(", ")),
        _ => names.concat(),
    }
}

/// The tasks that any policy has played, in the order of the list of tasks.
fn tasks(report: &EvaluationReport) -> Vec<&'static str> {
    let played =
        |id: &str| report.policies.iter().any(|policy| policy.tasks.iter().any(|task| task.task == id));
    crate::tasks::ALL.iter().map(|task| task.id).filter(|id| played(id)).collect()
}

/// A policy at a glance: whole tasks by number of robots, phases by who works on them, rules and build.
fn card(index: usize, policy: &PolicyReport) -> String {
    let mut facts: Vec<(String, String)> = Vec::new();
    for average in &policy.averages {
        if let Some(Some(mean)) = average.phases.last() {
            facts.push((format!("Tasks of {} robots, %", average.robots), mean.text()));
        }
    }
    let phases = [("alone", &policy.together.alone), ("together", &policy.together.together)];
    for (who, mean) in phases.into_iter().filter_map(|(who, mean)| Some((who, mean.as_ref()?))) {
        facts.push((format!("Phases {who}, conditional, %"), mean.text()));
    }
    if let Some(level) = &policy.phase_level {
        let shares = [("alone", level.non_collaborative_share), ("together", level.collaborative_share)];
        for (who, share) in shares.into_iter().filter_map(|(who, share)| Some((who, share?))) {
            facts.push((format!("Phases {who}, begun at, %"), percent(share)));
        }
    }
    facts.push(("Episodes".into(), policy.episodes.to_string()));
    facts.push(("Robots that fell".into(), policy.falls.to_string()));
    let fact = |(name, value): &(String, String)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>");
    format!(
        r#"<section class="card" style="--c: var(--s{})"><h3><span class="swatch"></span>{}</h3><dl>{}</dl><p class="soft">{} protocol, controller {}, build <code>{}</code></p></section>"#,
        index % SERIES,
        escape(&policy.name),
        facts.iter().map(fact).collect::<String>(),
        policy.protocol,
        escape(&policy.locomotion),
        escape(&policy.build),
    )
}

/// What marks and colours mean.
fn legend(policies: &[PolicyReport]) -> String {
    let begun = policies.iter().any(|policy| policy.phase_level.is_some());
    let mut marks = String::new();
    for (mark, text) in plot::MARKS.iter().take(if begun { 3 } else { 2 }) {
        marks += &format!(
            r#"<span><svg viewBox="0 0 16 12" width="16" height="12" aria-hidden="true">{}</svg>{text}</span>"#,
            mark(8.0, 6.0)
        );
    }
    let mut series = String::new();
    for (index, policy) in policies.iter().enumerate().filter(|_| policies.len() > 1) {
        series += &format!(
            r#"<span style="--c: var(--s{})"><span class="swatch"></span>{}</span>"#,
            index % SERIES,
            escape(&policy.name)
        );
    }
    format!(
        r#"<div class="legend">{marks}<span><i class="bar"></i>exact interval of 95 %</span>{series}</div>"#
    )
}

fn table(table: &Table) -> String {
    let class = |column: usize| if column < table.figures_from { "" } else { r#" class="number""# };
    let cell = |tag: &str, (column, text): (usize, &String)| {
        format!("<{tag}{}>{}</{tag}>", class(column), escape(text))
    };
    let head: String = table.head.iter().enumerate().map(|of| cell("th", of)).collect();
    let mut rows = String::new();
    // What stands in the first columns above need not be said again.
    let same = |index: usize| {
        let above = index.checked_sub(1).map_or(&[][..], |above| &table.rows[above][..table.figures_from]);
        let same = table.rows[index].iter().zip(above).take_while(|(one, other)| one == other).count();
        same.min(table.figures_from.saturating_sub(1))
    };
    let grouped = (0..table.rows.len()).any(|index| same(index) > 0);
    for (index, row) in table.rows.iter().enumerate() {
        let same = same(index);
        let said = |column: usize, text: &String| if column < same { String::new() } else { text.clone() };
        let cells = row.iter().enumerate().map(|(column, text)| cell("td", (column, &said(column, text))));
        let class = if same == 0 && index > 0 && grouped { r#" class="first""# } else { "" };
        rows += &format!("<tr{class}>{}</tr>", cells.collect::<String>());
    }
    format!(
        r#"<h2>{}</h2><p class="soft">{}</p><div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"#,
        escape(&table.title),
        escape(&table.note),
    )
}

/// Failures with their key moments.
fn gallery(failures: &[Failure], policies: &[PolicyReport]) -> String {
    let failed: usize =
        policies.iter().flat_map(|policy| &policy.reasons).map(|reason| reason.seeds.len()).sum();
    let shown = failures.len();
    let note = match (failed, shown) {
        (0, _) => "No episode failed.".into(),
        (_, 0) => format!(
            "{failed} episodes failed, none of them recorded; <code>evaluate --record</code> keeps pictures."
        ),
        _ => format!(
            "{shown} of {failed} episodes that failed: third person above, then what each robot sees."
        ),
    };
    let mut figures = String::new();
    for failure in failures {
        let Some(picture) = &failure.picture else { continue };
        let webp = BASE64_STANDARD.encode(&picture.webp);
        let (task, policy, why) = (escape(failure.task), escape(&failure.policy), escape(&failure.why));
        figures += &format!(
            r#"<figure><figcaption><b>{task}, seed {}</b> {policy}, stuck before {}: {why}</figcaption><div class="scroll"><img loading="lazy" width="{}" height="{}" alt="Key moments of {task}, seed {}" src="data:image/webp;base64,{webp}"></div></figure>"#,
            failure.seed, failure.phase, picture.width, picture.height, failure.seed,
        );
    }
    format!(r#"<h2>Failures</h2><p class="soft">{note}</p>{figures}"#)
}

fn skipped(report: &EvaluationReport) -> String {
    let items: String =
        report.skipped.iter().map(|skipped| format!("<li>{}</li>", escape(skipped))).collect();
    match items.is_empty() {
        true => String::new(),
        false => format!("<h2>Left out</h2><ul>{items}</ul>"),
    }
}
