//! Checks of the machine: physics and rendering, port, runs folder, clocks and cores.

use std::{
    net::{SocketAddr, TcpListener},
    path::Path,
    thread::available_parallelism,
    time::{Duration, Instant},
};

use tandem_episodes::{EpisodeError, EpisodeSpec, Session};
use tandem_tools_spec::{Observe, ToolCall, Wait};

use super::{Finding, Findings};
use crate::{hosting::look_at_runs_folder, settings::Layer};

/// Number of control steps that the check of physics simulates.
const TRIED_STEPS: u32 = 25;
/// Real-time factor below which a call that simulates takes longer than the motion of its robots.
const MIN_REALTIME_FACTOR: f64 = 1.0;
/// Maximum resolution step of a clock that can time calls.
const COARSEST_TICK: Duration = Duration::from_millis(1);
/// Minimum number of cores. With fewer cores, episodes wait for each other.
const MIN_CORES: usize = 2;

/// Checks the machine with an episode that can be played, if there is one.
pub fn check(layer: &Layer, spec: Option<EpisodeSpec>) -> Findings {
    let played = match &spec {
        Some(spec) => Finding::of(physics(spec)),
        None => Finding::Note("not tried, because no task can be played with these settings".into()),
    };
    let rest = [
        ("port", port(layer.address())),
        ("runs", runs(&layer.runs_folder())),
        ("clock", clock()),
        ("cores", cores()),
    ];
    [("physics", played)].into_iter().chain(rest.map(|(what, tried)| (what, Finding::of(tried)))).collect()
}

/// Plays half a second of an episode, and renders all robots' cameras.
fn physics(spec: &EpisodeSpec) -> Result<String, String> {
    let play = || {
        let mut session = Session::start(spec, None)?;
        session.call(Wait { steps: TRIED_STEPS }.into())?;
        let simulated_s = session.present().time_s;
        let began = Instant::now();
        session.call(ToolCall::from(Observe::of_all()))?;
        Ok((simulated_s / session.physics().as_secs_f64(), began.elapsed()))
    };
    let (factor, look) = play().map_err(|error: EpisodeError| format!("{error}; please report it"))?;
    let (task, robots) = (&spec.task.id, spec.task.robots.len());
    let text = format!(
        "{task} at {factor:.0} times real time, {} ms for a look of its {robots} robots",
        look.as_millis()
    );
    if factor < MIN_REALTIME_FACTOR {
        return Err(format!("{text}; build with --release, and run fewer episodes at once"));
    }
    Ok(text)
}

pub(super) fn port(address: SocketAddr) -> Result<String, String> {
    match TcpListener::bind(address) {
        Ok(_) => Ok(format!("{address} is free")),
        Err(error) => Err(format!("{address}: {error}; stop what listens there, or give another --listen")),
    }
}

pub(super) fn runs(folder: &Path) -> Result<String, String> {
    look_at_runs_folder(folder).map(|()| format!("{} can be written", folder.display()))
}

fn clock() -> Result<String, String> {
    let began = Instant::now();
    let mut tick = Duration::ZERO;
    while tick.is_zero() {
        tick = began.elapsed();
    }
    if tick > COARSEST_TICK {
        return Err(format!("ticks every {tick:?}, too coarse to time calls; run on another machine"));
    }
    Ok(format!("ticks within {tick:?}"))
}

fn cores() -> Result<String, String> {
    match available_parallelism() {
        Ok(cores) if cores.get() < MIN_CORES => Err(format!(
            "{cores}; give at least {MIN_CORES}, or run one episode at a time with --max-episodes 1"
        )),
        Ok(cores) => Ok(format!("{cores}, as many episodes run at full speed")),
        Err(error) => Err(format!("not known: {error}; the program runs, as fast as it can")),
    }
}
