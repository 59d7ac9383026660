//! Tables of the leaderboard in Markdown and HTML.

use tandem_episodes::html::{self, escape};

use super::{BoardRow, Leaderboard, TranscriptLink};
use crate::reports::evaluation::{Rate, ValueRange, days};
use crate::reports::table::{self, Table};

/// Columns of the first two tables that follow the policy, or task and policy.
const COLUMNS: [&str; 16] = [
    "Played by",
    "Protocol",
    "Assistance",
    "Settings",
    "Played",
    "Tasks",
    "Episodes",
    "Not counted",
    "Phases",
    "Success (%)",
    "Requests",
    "Replies (kB)",
    "Thinking (s)",
    "Tokens read (k)",
    "Tokens written (k)",
    "Price ($)",
];

const NOTE: &str = "\
    Success: episodes that reached the last phase, with the exact 95 % interval (Clopper-Pearson). \
    Phases: those reached, of all phases of all episodes. Costs are medians of an episode. Requests \
    include the commands of plans. Replies are the texts of all of them as recorded, without images; a \
    policy that asks for short ones reads less. Tokens and price are those that notes state. Rows of \
    CoHuB's paper are from another simulator, on another scale. An empty cell is unknown.";

/// Renders the leaderboard as Markdown.
pub fn markdown(board: &Leaderboard) -> String {
    let mut text = String::from("# Tandem: leaderboard\n");
    text.extend(board.made.iter().map(|made| format!("\n{}\n", made.in_words())));
    text.extend(tables(board).iter().map(table::markdown));
    text.extend(board.skipped.iter().map(|skipped| format!("\nLeft out: {skipped}\n")));
    text
}

/// Renders the leaderboard as a self-contained page.
pub fn html(board: &Leaderboard) -> String {
    let made: String = board.made.iter().map(|made| table::marked(&made.in_words())).collect();
    let tables: String = tables(board).iter().map(table::html).collect();
    let skipped: String =
        board.skipped.iter().map(|skipped| format!("<li>{}</li>", escape(skipped))).collect();
    let skipped = if skipped.is_empty() { skipped } else { format!("<h2>Left out</h2><ul>{skipped}</ul>") };
    html::page(
        "Tandem: leaderboard",
        &format!(r#"<h1>Leaderboard</h1><p class="soft">{made}</p>{tables}{skipped}"#),
    )
}

fn tables(board: &Leaderboard) -> Vec<Table> {
    let head = |first: &[&'static str]| first.iter().copied().chain(COLUMNS).collect::<Vec<_>>();
    let mut policies = Table::new("Policies and models", NOTE, &head(&["Policy"]), 6);
    policies.rows.extend(board.policies.iter().map(|row| {
        let cells = cells(row, row.tasks.len().to_string());
        std::iter::once(row.policy.clone()).chain(cells).collect()
    }));
    let mut tasks = Table::new("By task", NOTE, &head(&["Task", "Policy"]), 7);
    tasks.head.retain(|name| name != "Tasks");
    tasks.rows.extend(board.tasks.iter().map(|row| {
        let mut cells = cells(row, String::new());
        cells.remove(5);
        [row.tasks.join(", "), row.policy.clone()].into_iter().chain(cells).collect()
    }));
    let mut tables = vec![policies, tasks, transcripts(&board.transcripts)];
    tables.retain(|table| !table.rows.is_empty());
    tables
}

/// Returns the cells of [`COLUMNS`].
fn cells(row: &BoardRow, tasks: String) -> Vec<String> {
    let BoardRow { costs, .. } = row;
    let median = |range: &Option<ValueRange>, scale: f64, decimals: usize| {
        range.as_ref().map_or(String::new(), |range| format!("{:.decimals$}", range.median_value / scale))
    };
    vec![
        row.source.clone(),
        row.protocol.map_or(String::new(), |protocol| protocol.name().into()),
        row.assistance.map_or(String::new(), |assistance| assistance.name().into()),
        row.settings.join(", "),
        row.ended_at.as_ref().map_or(String::new(), days),
        tasks,
        row.episodes.to_string(),
        row.not_counted.map_or(String::new(), |count| count.to_string()),
        format!("{}/{}", row.phases.successes, row.phases.trials),
        row.success.map_or(String::new(), Rate::text),
        median(&costs.requests, 1.0, 0),
        median(&costs.reply_kilobytes, 1.0, 0),
        median(&costs.thinking, 1.0, 1),
        median(&costs.input_tokens, 1e3, 1),
        median(&costs.output_tokens, 1e3, 1),
        median(&costs.usd, 1.0, 3),
    ]
}

fn transcripts(links: &[TranscriptLink]) -> Table {
    let mut table = Table::new(
        "Transcripts",
        "Episodes whose policies read replies outside of the simulator, each with its page. Phases are \
         simulated times in seconds; `none` was not reached.",
        &[
            "Policy",
            "Protocol",
            "Assistance",
            "Task",
            "Played",
            "Transcript",
            "Seed",
            "Phases (s)",
            "Requests",
            "Replies (kB)",
            "Thinking (s)",
        ],
        6,
    );
    for (row, of) in links.iter().enumerate() {
        let times = of
            .phases
            .0
            .iter()
            .map(|(_, time_s)| time_s.map_or("none".into(), |time_s| format!("{time_s:.1}")));
        let ended_at = of.ended_at.clone().map_or(String::new(), |time| days(&[time.clone(), time]));
        table.rows.push(vec![
            of.policy.clone(),
            of.protocol.name().into(),
            of.assistance.name().into(),
            of.task.clone(),
            ended_at,
            "page".into(),
            of.seed.to_string(),
            times.collect::<Vec<_>>().join(", "),
            of.requests.to_string(),
            format!("{:.0}", of.reply_bytes as f64 / 1e3),
            format!("{:.0}", of.thinking_s),
        ]);
        table.links.insert((row, 5), of.link.clone());
    }
    table
}
