//! The report as one self-contained page: no script, external font or external image.

pub mod films;
pub mod gallery;
mod stress;

use tandem_episodes::html::{self, escape};

use super::EvaluationReport;
use super::figure::{Figure, SERIES, rates, times};
use super::policy::PolicyReport;
use super::rate::percent;
use super::tables;
use crate::reports::table::{self, marked};
use crate::results::PhaseLevel;
use films::Film;
use gallery::Failure;

/// Images and videos of a page.
#[derive(Clone, Debug, Default)]
pub struct ReportPictures {
    pub films: Vec<Film>,
    pub failures: Vec<Failure>,
    /// Number of failures with images, shown or not.
    pub pictured_failures: usize,
}

/// Renders the page.
pub fn html(report: &EvaluationReport, pictures: &ReportPictures) -> String {
    let policies = &report.policies;
    let names: Vec<&str> = policies.iter().map(|policy| policy.name.as_str()).collect();
    let title = in_words(&names);
    let body = format!(
        r#"<h1>{}</h1>
<p class="soft">{played}, played in Tandem.{made}</p>
<div class="cards">{cards}</div>
{films}
<h2>How far episodes got</h2>
{legend}
<div class="plots">{plots}</div>
{times}
{stress}
{tables}
{gallery}
{skipped}"#,
        escape(&title),
        made = report
            .header
            .made
            .iter()
            .map(|made| format!(" {}", marked(&made.in_words())))
            .collect::<String>(),
        played = played(policies.iter().map(|policy| policy.episodes).sum(), &report.tasks()),
        cards = policies.iter().enumerate().map(|(index, policy)| card(index, policy)).collect::<String>(),
        films = films::html(&pictures.films),
        legend = legend(policies),
        plots = cards(report, rates::figure),
        times = phase_times(report),
        stress = stress::html(&report.stress),
        tables = tables::all(report).iter().map(table::html).collect::<String>(),
        gallery = gallery::html(pictures, policies),
        skipped = skipped(report),
    );
    html::page(&format!("Tandem: {title}"), &body)
}

/// Joins the names in a sentence, for example "a, b and c".
fn in_words(names: &[&str]) -> String {
    match names.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} and {last}", others.join(", ")),
        _ => names.concat(),
    }
}

/// Describes the number of episodes and their tasks.
fn played(episodes: usize, tasks: &[&str]) -> String {
    let counted = if episodes == 1 { "1 episode".to_owned() } else { format!("{episodes} episodes") };
    match tasks {
        [only] => format!("{counted} of {only}"),
        several => format!("{counted} of {} tasks", several.len()),
    }
}

/// Draws every task for which `draw` returns a figure.
fn cards(report: &EvaluationReport, draw: fn(&str, &[PolicyReport]) -> Option<Figure>) -> String {
    let drawings = report.tasks().into_iter().filter_map(|task| draw(task, &report.policies));
    drawings.map(|drawing| drawing.card()).collect()
}

/// Renders the curves of the times at which phases were reached; empty if no phase was reached.
fn phase_times(report: &EvaluationReport) -> String {
    let curves = cards(report, times::figure);
    if curves.is_empty() {
        return String::new();
    }
    let about = "Share of the episodes from the task's beginning that had reached a phase by then: p1 solid, \
                 p2 dashed, p3 dotted. Tasks of which no phase was reached have no curves.";
    format!(
        r#"<h2>When phases were reached</h2><p class="soft">{about}</p><div class="plots">{curves}</div>"#
    )
}

/// Renders a policy's summary: rates of whole tasks by number of robots, rates of phases by collaboration,
/// rules and build.
fn card(index: usize, policy: &PolicyReport) -> String {
    let mut facts: Vec<(String, String)> = Vec::new();
    for average in &policy.averages {
        if let Some(Some(mean)) = average.phases.last() {
            facts.push((format!("Tasks of {} robots, %", average.robots), mean.text()));
        }
    }
    // The benchmark's means are over tasks for two robots, so this number is not mentioned.
    let apart = |robots: usize| if robots == 2 { String::new() } else { format!(", {robots} robots") };
    for means in &policy.together {
        let phases = [("alone", &means.alone), ("together", &means.together)];
        for (who, mean) in phases.into_iter().filter_map(|(who, mean)| Some((who, mean.as_ref()?))) {
            facts.push((format!("Phases {who}{}, conditional, %", apart(means.robots)), mean.text()));
        }
    }
    for (robots, means) in policy.phase_level.iter().flat_map(PhaseLevel::means) {
        let shares = [("alone", means.non_collaborative_share), ("together", means.collaborative_share)];
        for (who, share) in shares.into_iter().filter_map(|(who, share)| Some((who, share?))) {
            facts.push((format!("Phases {who}{}, begun at, %", apart(robots)), percent(share)));
        }
    }
    facts.push(("Episodes".into(), policy.episodes.to_string()));
    let excluded: usize = policy.excluded.iter().map(|entry| entry.seeds.len()).sum();
    if excluded > 0 {
        facts.push(("Not counted".into(), excluded.to_string()));
    }
    facts.push(("Robots that fell".into(), policy.falls.to_string()));
    let address = policy.address.as_ref().map(|address| format!("at <code>{}</code>, ", escape(address)));
    let address = address.unwrap_or_default();
    let fact = |(name, value): &(String, String)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>");
    format!(
        r#"<section class="card" style="--c: var(--s{})"><h2><span class="swatch"></span>{}</h2><dl>{}</dl><p class="soft">{address}{} protocol, controller {}, build <code>{}</code></p></section>"#,
        index % SERIES,
        escape(&policy.name),
        facts.iter().map(fact).collect::<String>(),
        policy.protocol,
        escape(&policy.locomotion),
        escape(&policy.build),
    )
}

/// Renders the legend of marks and colours.
fn legend(policies: &[PolicyReport]) -> String {
    let mut marks = String::new();
    for (mark, text) in rates::marks(policies) {
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

fn skipped(report: &EvaluationReport) -> String {
    let items: String =
        report.skipped.iter().map(|skipped| format!("<li>{}</li>", escape(skipped))).collect();
    match items.is_empty() {
        true => String::new(),
        false => format!("<h2>Left out</h2><ul>{items}</ul>"),
    }
}
