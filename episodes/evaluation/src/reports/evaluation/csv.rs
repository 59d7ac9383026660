//! Reports as CSV: a line for each rate.

use super::costs::ValueRange;
use super::policy::TaskReport;
use super::rate::Rate;
use super::{EvaluationReport, stress};

/// Returns a line for each rate of each phase, for further analysis.
pub fn rates(report: &EvaluationReport) -> String {
    let mut text = String::from(
        "policy,protocol,task,robots,phase_number,phase_id,collaborative,rate,successes,trials,share,\
         low_share,high_share,median_steps,median_calls,median_thinking_s,median_input_tokens,\
         median_output_tokens,median_usd\n",
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
pub fn quoted(cell: &str) -> String {
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.into(),
    }
}
