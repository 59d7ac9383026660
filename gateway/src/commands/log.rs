//! What the commands that serve write to stderr.

use std::io::IsTerminal;

use clap::ValueEnum;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// How lines are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people.
    Text,
    /// One JSON object per line.
    Json,
}

/// `TANDEM_LOG` sets what is logged, as `warn` or `tandem=warn`.
pub fn to_stderr(default: LevelFilter) {
    write(Targets::new().with_default(default), Format::Text);
}

/// As [`to_stderr`], in the form of `format`.
pub fn of_server(default: LevelFilter, format: Format) {
    write(Targets::new().with_default(default), format);
}

/// As [`to_stderr`], for evaluations: of the servers on which programs play, nothing but warnings.
pub fn of_evaluations() {
    let quiet = ["tandem::http", "tandem::hosting"].map(|target| (target, LevelFilter::WARN));
    write(Targets::new().with_default(LevelFilter::INFO).with_targets(quiet), Format::Text);
}

fn write(default: Targets, format: Format) {
    let wanted = std::env::var("TANDEM_LOG").ok().and_then(|text| text.parse::<Targets>().ok());
    let lines = tracing_subscriber::fmt::layer().with_writer(std::io::stderr);
    let lines = match format {
        Format::Text => lines.with_ansi(std::io::stderr().is_terminal()).boxed(),
        Format::Json => lines.json().flatten_event(true).with_span_list(false).boxed(),
    };
    // The library that speaks MCP has three lines for each of our own.
    let usual = default.with_target("rmcp", LevelFilter::WARN);
    tracing_subscriber::registry().with(wanted.unwrap_or(usual)).with(lines).init();
}
