//! What the commands that serve write to stderr.

use std::io::IsTerminal;

use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// `TANDEM_LOG` sets what is logged, as `debug` or `tandem=debug`.
pub fn to_stderr(default: LevelFilter) {
    start(Targets::new().with_default(default));
}

/// As [`to_stderr`], for evaluations: of the servers on which programs play, nothing but warnings.
pub fn of_evaluations() {
    let quiet = ["tandem::http", "tandem::hosting"].map(|target| (target, LevelFilter::WARN));
    start(Targets::new().with_default(LevelFilter::INFO).with_targets(quiet));
}

fn start(default: Targets) {
    let wanted = std::env::var("TANDEM_LOG").ok().and_then(|text| text.parse::<Targets>().ok());
    let lines = tracing_subscriber::fmt::layer()
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr);
    tracing_subscriber::registry().with(wanted.unwrap_or(default)).with(lines).init();
}
