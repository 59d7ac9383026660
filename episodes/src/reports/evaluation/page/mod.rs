//! The report as one self-contained page: no script, no font, no image from elsewhere.

pub mod films;
pub mod gallery;
mod plot;
mod stress;

use super::EvaluationReport;
use super::policy::PolicyReport;
use super::rate::percent;
use super::table::Table;
use super::tables;
use crate::html::{self, escape};
use crate::results::PhaseLevel;
use films::Film;
use gallery::Failure;
use plot::{SERIES, task_plot};

/// Images and videos of a page.
#[derive(Clone, Debug, Default)]
pub struct ReportPictures {
    pub films: Vec<Film>,
    pub failures: Vec<Failure>,
    /// Number of failures that have images, shown or not.
    pub pictured_failures: usize,
}

/// Renders the page.
pub fn html(report: &EvaluationReport, pictures: &ReportPictures) -> String {
    let policies = &report.policies;
    let names: Vec<&str> = policies.iter().map(|policy| policy.name.as_str()).collect();
    let title = in_words(&names);
    let body = format!(
        r#"<h1>{}</h1>
<p class="soft">{played}, played in Tandem.</p>
<div class="cards">{cards}</div>
{films}
<h2>How far episodes got</h2>
{legend}
<div class="plots">{plots}</div>
{stress}
{tables}
{gallery}
{skipped}"#,
        escape(&title),
        played = played(policies.iter().map(|policy| policy.episodes).sum(), &tasks(report)),
        cards = policies.iter().enumerate().map(|(index, policy)| card(index, policy)).collect::<String>(),
        films = films::html(&pictures.films),
        legend = legend(policies),
        plots = tasks(report).iter().map(|task| task_plot(task, policies)).collect::<String>(),
        stress = stress::html(&report.stress),
        tables = tables::all(report).iter().map(table).collect::<String>(),
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

/// Converts a text to HTML, with code for the parts between backticks.
fn marked(text: &str) -> String {
    let part = |(index, part): (usize, &str)| match index % 2 {
        0 => escape(part),
        _ => format!("<code>{}</code>", escape(part)),
    };
    text.split('`').enumerate().map(part).collect()
}

/// Describes the number of episodes and their tasks.
fn played(episodes: usize, tasks: &[&str]) -> String {
    let counted = if episodes == 1 { "1 episode".to_owned() } else { format!("{episodes} episodes") };
    match tasks {
        [only] => format!("{counted} of {only}"),
        several => format!("{counted} of {} tasks", several.len()),
    }
}

/// Returns the tasks that any policy has played, in the order of the list of tasks, then those of files.
fn tasks(report: &EvaluationReport) -> Vec<&str> {
    let played = || report.policies.iter().flat_map(|policy| &policy.tasks).map(|task| task.task.as_str());
    let known = crate::tasks::cohub().iter().map(|task| task.id.as_str());
    let mut found: Vec<&str> = known.filter(|id| played().any(|one| one == *id)).collect();
    for id in played() {
        if !found.contains(&id) {
            found.push(id);
        }
    }
    found
}

/// Renders a policy's summary: whole tasks by number of robots, phases by collaboration, rules and build.
fn card(index: usize, policy: &PolicyReport) -> String {
    let mut facts: Vec<(String, String)> = Vec::new();
    for average in &policy.averages {
        if let Some(Some(mean)) = average.phases.last() {
            facts.push((format!("Tasks of {} robots, %", average.robots), mean.text()));
        }
    }
    // The benchmark's means are over tasks of two robots, so two need not be mentioned.
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
    // First columns with the same text as in the row above are not repeated.
    let same = |index: usize| {
        let above = index.checked_sub(1).map_or(&[][..], |above| &table.rows[above][..table.figures_from]);
        let same = table.rows[index].iter().zip(above).take_while(|(one, other)| one == other).count();
        same.min(table.figures_from.saturating_sub(1))
    };
    let grouped = (0..table.rows.len()).any(|index| same(index) > 0);
    for (index, row) in table.rows.iter().enumerate() {
        let same = same(index);
        let said = |column: usize, text: &String| if column < same { String::new() } else { text.clone() };
        let last = row.len() - 1;
        let leads = |column: usize| table.links.get(index).filter(|_| column == last);
        let cells = row.iter().enumerate().map(|(column, text)| match leads(column) {
            Some(to) => format!(r#"<td class="number"><a href="{}">{}</a></td>"#, escape(to), escape(text)),
            None => cell("td", (column, &said(column, text))),
        });
        let class = if same == 0 && index > 0 && grouped { r#" class="first""# } else { "" };
        rows += &format!("<tr{class}>{}</tr>", cells.collect::<String>());
    }
    format!(
        r#"<h2>{title}</h2><p class="soft">{}</p><div class="scroll" tabindex="0" role="region" aria-label="{title}"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"#,
        marked(&table.note),
        title = escape(&table.title),
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
