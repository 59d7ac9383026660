//! `tandem report`: what episodes came to, for people and for programs.

use std::path::PathBuf;
use std::process::ExitCode;

use tandem_episodes::reports::{EvaluationReport, ReportFormat, gallery, load};
use tandem_episodes::write_whole;

use super::CommandResult;
use crate::settings::one_of;

/// Report on episodes: rates with intervals, averages, effort, failures, and policies compared on the same seeds.
#[derive(Debug, clap::Args)]
pub struct ReportArgs {
    /// Folders that `evaluate`, `collect` or `serve` wrote; what they hold of one policy is joined.
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// What to write: a page that needs nothing else, Markdown, a line for each rate, all figures, or tables for LaTeX.
    #[arg(long, default_value = ReportFormat::Html.name(), value_parser = one_of(ReportFormat::ALL, ReportFormat::name))]
    format: ReportFormat,
    /// File to write [default: report.FORMAT in the first folder].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Failures to show pictures of, where episodes were recorded.
    #[arg(long, value_name = "N", default_value_t = 12)]
    failures: usize,
}

/// Reads the results and writes the report.
pub fn run(args: ReportArgs) -> CommandResult {
    let loaded = load(&args.folders)?;
    let report = EvaluationReport::of(&loaded);
    let failures = match args.format {
        ReportFormat::Html => gallery(&loaded, args.failures),
        ReportFormat::Markdown | ReportFormat::Csv | ReportFormat::Json | ReportFormat::Tex => Vec::new(),
    };
    let text = report.write(args.format, &failures)?;
    let default = args.folders.first().map(|folder| folder.join(format!("report.{}", args.format.name())));
    let path = args.out.or(default).unwrap_or_else(|| "report.html".into());
    write_whole(&path, text.as_bytes())?;
    println!("{}: {} episodes", path.display(), loaded.episodes.len());
    loaded.skipped.iter().for_each(|skipped| eprintln!("left out: {skipped}"));
    Ok(ExitCode::SUCCESS)
}
