//! Reports without images: Markdown, and tables for LaTeX.

use super::EvaluationReport;
use super::tables::all;
use crate::reports::table;

/// Renders the report as Markdown.
pub fn markdown(report: &EvaluationReport) -> String {
    let mut text = String::from("# Tandem: report\n");
    text.extend(report.header.made.iter().map(|made| format!("\n{}\n", made.in_words())));
    for policy in &report.policies {
        let address = policy.address.as_ref().map(|address| format!("\n{}: {address}\n", policy.name));
        text.extend(address);
    }
    text.extend(all(report).iter().map(table::markdown));
    text.extend(report.skipped.iter().map(|skipped| format!("\nLeft out: {skipped}\n")));
    text
}

/// Returns the tables for LaTeX, to be included in a document.
pub fn tex(report: &EvaluationReport) -> String {
    let mut text = String::from("% Needs \\usepackage{booktabs,graphicx,longtable}.\n");
    let comment = |words: &str| format!("% {}\n", words.replace(['\n', '\r'], " "));
    text.extend(report.header.made.iter().map(|made| comment(&made.in_words())));
    text.extend(report.skipped.iter().map(|skipped| comment(&format!("Left out: {skipped}"))));
    text.extend(all(report).iter().map(table::tex));
    text
}
