//! Reports without images: Markdown, CSV with a line for each rate, and tables for LaTeX.

use super::costs::ValueRange;
use super::policy::TaskReport;
use super::rate::Rate;
use super::table::Table;
use super::tables::all;
use super::{EvaluationReport, stress};

pub fn markdown(report: &EvaluationReport) -> String {
    let mut text = String::from("# Tandem: report\n");
    for policy in &report.policies {
        let address = policy.address.as_ref().map(|address| format!("\n{}: {address}\n", policy.name));
        text.extend(address);
    }
    for table in all(report) {
        let line = |cells: &[String]| {
            format!("| {} |\n", cells.iter().map(|c| escape_pipe(c)).collect::<Vec<_>>().join(" | "))
        };
        let rules =
            (0..table.head.len()).map(|column| if column < table.figures_from { "---" } else { "---:" });
        text += &format!("\n## {}\n\n{}\n\n", table.title, table.note);
        text += &line(&table.head);
        text += &format!("|{}|\n", rules.collect::<Vec<_>>().join("|"));
        text.extend(linked_rows(&table).iter().map(|row| line(row)));
    }
    text.extend(report.skipped.iter().map(|skipped| format!("\nLeft out: {skipped}\n")));
    text
}

/// Returns the rows, with their links in Markdown.
fn linked_rows(table: &Table) -> Vec<Vec<String>> {
    let mut rows = table.rows.clone();
    for (row, to) in rows.iter_mut().zip(&table.links) {
        if let Some(last) = row.last_mut() {
            *last = format!("[{last}]({to})");
        }
    }
    rows
}

fn escape_pipe(cell: &str) -> String {
    cell.replace('|', "\\|").replace('\n', " ")
}

/// Returns a line for each rate of each phase, for further computation.
pub fn csv(report: &EvaluationReport) -> String {
    let mut text = String::from(
        "policy,protocol,task,robots,phase_number,phase_id,collaborative,rate,successes,trials,share,low_share,high_share,\
         median_steps,median_calls,median_thinking_s,median_input_tokens,median_output_tokens,median_usd\n",
    );
    for policy in &report.policies {
        for task in &policy.tasks {
            let costs = csv_costs(task);
            for phase in &task.phases {
                let rates = [
                    ("cumulative", phase.cumulative),
                    ("conditional", phase.conditional),
                    ("from_its_beginning", phase.from_its_beginning),
                ];
                for (name, rate) in rates.into_iter().filter_map(|(name, rate)| Some((name, rate?))) {
                    let Rate { successes, trials, share, interval_share: [low_share, high_share] } = rate;
                    let (policy_name, protocol) = (quoted(&policy.name), policy.protocol);
                    let of = format!("{policy_name},{protocol},{},{}", task.task, task.robots);
                    let which = format!("{},{},{}", phase.number, phase.id, phase.collaborative);
                    text += &format!(
                        "{of},{which},{name},{successes},{trials},{share},{low_share},{high_share},{costs}\n"
                    );
                }
            }
        }
    }
    text.extend(report.stress.iter().flat_map(|of| stress::csv_lines(of, &quoted)));
    text
}

/// Returns the costs of the task's whole episodes; cells without a value are empty.
fn csv_costs(task: &TaskReport) -> String {
    let (effort, models) = (task.effort.as_ref(), task.models.as_ref());
    let ranges: [Option<&ValueRange>; 6] = [
        effort.map(|effort| &effort.steps),
        effort.map(|effort| &effort.calls),
        effort.map(|effort| &effort.thought),
        models.map(|models| &models.input_tokens),
        models.map(|models| &models.output_tokens),
        models.and_then(|models| models.usd.as_ref()),
    ];
    ranges.map(|range| range.map_or(String::new(), |range| range.median_value.to_string())).join(",")
}

/// Quotes a cell of CSV according to RFC 4180.
fn quoted(cell: &str) -> String {
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.into(),
    }
}

/// Returns the tables for LaTeX, which need the package `booktabs`.
pub fn tex(report: &EvaluationReport) -> String {
    let mut text = String::from("% Needs \\usepackage{booktabs}.\n");
    text.extend(all(report).iter().map(tex_table));
    text
}

fn tex_table(table: &Table) -> String {
    let line = |cells: &[String]| {
        format!("    {} \\\\\n", cells.iter().map(|cell| escape_tex(cell)).collect::<Vec<_>>().join(" & "))
    };
    let figures = table.head.len() - table.figures_from;
    let columns = "l".repeat(table.figures_from) + &"r".repeat(figures);
    let rows: String = table.rows.iter().map(|row| line(row)).collect();
    format!(
        "\n\\begin{{table}}\n  \\centering\n  \\caption{{\\textbf{{{}.}} {}}}\n  \\begin{{tabular}}{{{columns}}}\n    \
         \\toprule\n{}    \\midrule\n{rows}    \\bottomrule\n  \\end{{tabular}}\n\\end{{table}}\n",
        escape_tex(&table.title),
        escape_tex(&table.note),
        line(&table.head),
    )
}

fn escape_tex(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => escaped.extend(['\\', character]),
            '\\' => escaped += "\\textbackslash{}",
            '~' => escaped += "\\textasciitilde{}",
            '^' => escaped += "\\textasciicircum{}",
            '<' => escaped += "$<$",
            '>' => escaped += "$>$",
            'π' => escaped += "$\\pi$",
            'Ψ' => escaped += "$\\Psi$",
            other => escaped.push(other),
        }
    }
    escaped
}
