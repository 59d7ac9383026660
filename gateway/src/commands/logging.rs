//! The log of subcommands, which goes to stderr.

use std::io::IsTerminal;

use clap::ValueEnum;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Format of log lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// For people.
    Text,
    /// One JSON object per line.
    Json,
}

/// Logs to stderr. The environment variable `TANDEM_LOG` sets the filter, for example `warn` or
/// `tandem=warn`. Without it, `default` and more severe levels are logged.
pub fn log_to_stderr(default: LevelFilter) {
    install(Targets::new().with_default(default), LogFormat::Text);
}

/// Logs the work of a server as [`log_to_stderr`] does, with lines in the given `format`.
pub fn log_server(default: LevelFilter, format: LogFormat) {
    install(Targets::new().with_default(default), format);
}

/// Logs an evaluation as [`log_to_stderr`] does. The servers on which programs play only log warnings.
pub fn log_evaluation() {
    let quiet = ["tandem::http", "tandem::hosting"].map(|target| (target, LevelFilter::WARN));
    install(Targets::new().with_default(LevelFilter::INFO).with_targets(quiet), LogFormat::Text);
}

fn install(default: Targets, format: LogFormat) {
    let wanted = std::env::var("TANDEM_LOG").ok().and_then(|text| text.parse::<Targets>().ok());
    let lines = tracing_subscriber::fmt::layer().with_writer(std::io::stderr);
    let lines = match format {
        LogFormat::Text => lines.with_ansi(std::io::stderr().is_terminal()).boxed(),
        LogFormat::Json => lines.json().flatten_event(true).with_span_list(false).boxed(),
    };
    // The MCP library logs three lines for each line of this program.
    let usual = default.with_target("rmcp", LevelFilter::WARN);
    // If one process runs several commands, for example in a Python program, the log of the first command
    // remains in use.
    let _ = tracing_subscriber::registry().with(wanted.unwrap_or(usual)).with(lines).try_init();
}
