//! What the commands that serve write to stderr.

use std::io::IsTerminal;

use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// `TANDEM_LOG` sets what is logged, as `debug` or `tandem=debug`.
pub fn to_stderr(default: LevelFilter) {
    let wanted = std::env::var("TANDEM_LOG").ok().and_then(|text| text.parse::<Targets>().ok());
    let lines = tracing_subscriber::fmt::layer()
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr);
    let filter = wanted.unwrap_or_else(|| Targets::new().with_default(default));
    tracing_subscriber::registry().with(filter).with(lines).init();
}
