//! `tandem serve`: a server of episodes for policies.

use std::{path::PathBuf, process::ExitCode};

use tracing_subscriber::filter::LevelFilter;

use super::{
    CommandResult,
    flags::PartnerFlags,
    logging::{LogFormat, log_server},
    print,
};
use crate::{
    hosting::{Guests, try_runs_folder},
    http::Server,
    settings::{Layer, Settings},
    token::Token,
};

/// Serve episodes over HTTP until SIGINT or SIGTERM.
#[derive(Debug, clap::Args)]
pub struct ServeArgs {
    /// TOML file with any of the settings below; flags and the environment take precedence.
    #[arg(long, env = "TANDEM_CONFIG", value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
    /// Log format: text for people, or one JSON object per line.
    #[arg(long, env = "TANDEM_LOG_FORMAT", value_name = "FORMAT", default_value = "text")]
    log_format: LogFormat,
    /// Policy that can drive beside people.
    #[command(flatten)]
    partner: PartnerFlags,
    /// Settings given as flags or environment.
    #[command(flatten)]
    pub(super) flags: Layer,
}

/// Serves until a signal ends the process.
pub fn run(args: ServeArgs) -> CommandResult {
    share_heaps();
    log_server(LevelFilter::INFO, args.log_format);
    let flags = Layer { token: Token::from_environment()?, ..args.flags };
    let settings = Settings::resolve(flags, args.config.as_deref())?;
    try_runs_folder(&settings.runs)?;
    let server =
        Server::start_for(settings, Guests { partner: args.partner.policy()?, ..Guests::default() })?;
    // The links are secret, so they are not logged. If they cannot be printed, for example on a full disk,
    // the server still runs.
    let [start, watch, operate] = [&server.start_link(), server.watch_link(), &server.operate_link()];
    let _ = print(&format!("start at {start}\nwatch at {watch}\noperate at {operate}\n"));
    let left = server.run_until_signal();
    Ok(if left.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Limits the C library's heaps to the number of processors. The wheel's threads use them; the binary's
/// do not.
///
/// The default is eight times the number of processors. Each heap retains the memory between the remains of
/// ended or suspended episodes, which is gigabytes after thousands of episodes.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn share_heaps() {
    let heaps = std::thread::available_parallelism()
        .map_or(1, |cores| i32::try_from(cores.get()).unwrap_or(i32::MAX));
    #[allow(
        unsafe_code,
        reason = "the C library's setting has no safe wrapper; it takes two numbers and no pointer"
    )]
    // SAFETY: called before there is another thread.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, heaps);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn share_heaps() {}
