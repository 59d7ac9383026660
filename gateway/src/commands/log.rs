//! What the commands that serve write to stderr.

use std::io::IsTerminal;

/// `TANDEM_LOG` sets what is logged, as `debug` or `tandem=debug`.
pub fn to_stderr(default: &str) {
    let filter = tracing_subscriber::EnvFilter::try_from_env("TANDEM_LOG").unwrap_or_else(|_| default.into());
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr)
        .init();
}
