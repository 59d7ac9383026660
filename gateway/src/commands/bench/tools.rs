//! `tandem bench tools`: overhead of a call beyond its physics, over real HTTP on this machine.

use std::{
    error::Error,
    net::{Ipv4Addr, SocketAddr},
    time::{Duration, Instant},
};

use serde::Serialize;
use tandem_episodes::{players::Episode, tasks};
use tandem_tools_spec::{GetRobotState, GetStatus, Protocol, StartEpisode, ToolCall, Wait};

use crate::{
    drivers::HttpEpisode,
    http::Server,
    settings::{Layer, Settings},
};

/// Number of timed calls of each kind.
const CALLS: usize = 2000;
/// Number of warm-up calls before the timed calls.
const WARM_UP: usize = 100;
/// Number of timed calls of `wait`. An episode of the benchmark protocol has enough control steps for them.
const WAITS: usize = 30;
/// Number of control steps of each call of `wait`.
const STEPS: u32 = 25;

/// Times of calls in an episode of two robots, which is recorded as usual.
#[derive(Debug, Serialize)]
pub struct ToolsReport {
    /// Times of calls without physics.
    pub calls: Vec<CallTimes>,
    /// Times of `wait`, compared with the time of its physics.
    pub wait: WaitTimes,
}

/// Times of one tool, from the first byte sent until the reply is read.
#[derive(Debug, Serialize)]
pub struct CallTimes {
    /// Name of the tool.
    pub tool: &'static str,
    /// Number of calls.
    pub calls: usize,
    /// Median time of a call, in milliseconds.
    pub p50_ms: f64,
    /// The 99th percentile of the time of a call, in milliseconds.
    pub p99_ms: f64,
}

/// Times of `wait` with [`STEPS`] steps.
#[derive(Debug, Serialize)]
pub struct WaitTimes {
    /// Number of control steps of each call.
    pub steps: u32,
    /// Number of calls.
    pub calls: usize,
    /// Median time of a whole call, in milliseconds.
    pub call_p50_ms: f64,
    /// Median time of a call's physics, in milliseconds.
    pub physics_p50_ms: f64,
    /// Median over calls of the whole time divided by the physics time.
    pub p50_ratio: f64,
}

/// Plays an episode on a separate server and measures the times of its calls.
pub fn tools() -> Result<ToolsReport, Box<dyn Error>> {
    let runs = tempfile::tempdir()?;
    let flags = Layer {
        listen: Some(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))),
        runs: Some(runs.path().into()),
        ..Layer::default()
    };
    let server = Server::start(Settings::resolve(flags, None)?)?;
    let task = tasks::cohub()[0].id.clone();
    let args = StartEpisode { task, seed: 0, protocol: Some(Protocol::Benchmark), short: false };
    let (mut episode, _) = HttpEpisode::start(server.address(), &args)?;
    let looks = [GetStatus::default().into(), GetRobotState::of("A").into()];
    let calls = looks.into_iter().map(|call| times(&mut episode, &call)).collect::<Result<_, _>>()?;
    let wait = waits(&mut episode, || server.table().metrics().physics())?;
    episode.delete()?;
    server.stop();
    Ok(ToolsReport { calls, wait })
}

fn times(episode: &mut HttpEpisode, call: &ToolCall) -> Result<CallTimes, Box<dyn Error>> {
    let mut times_ms = Vec::with_capacity(CALLS);
    for number in 0..WARM_UP + CALLS {
        let began = Instant::now();
        episode.call(call.clone())?;
        if number >= WARM_UP {
            times_ms.push(ms(began.elapsed()));
        }
    }
    let [p50_ms, p99_ms] = [0.5, 0.99].map(|share| percentile(&mut times_ms, share));
    Ok(CallTimes { tool: call.name(), calls: CALLS, p50_ms, p99_ms })
}

fn waits(episode: &mut HttpEpisode, physics: impl Fn() -> Duration) -> Result<WaitTimes, Box<dyn Error>> {
    let (mut calls_ms, mut physics_ms, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..WAITS {
        let (began, physics_before) = (Instant::now(), physics());
        episode.call(Wait { steps: STEPS }.into())?;
        let (whole_ms, of_it_ms) = (ms(began.elapsed()), ms(physics() - physics_before));
        calls_ms.push(whole_ms);
        physics_ms.push(of_it_ms);
        ratios.push(whole_ms / of_it_ms);
    }
    Ok(WaitTimes {
        steps: STEPS,
        calls: WAITS,
        call_p50_ms: percentile(&mut calls_ms, 0.5),
        physics_p50_ms: percentile(&mut physics_ms, 0.5),
        p50_ratio: percentile(&mut ratios, 0.5),
    })
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// Returns the smallest of `values` that at least the fraction `share` of the values do not exceed.
fn percentile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = (share * values.len() as f64).ceil() as usize;
    values[rank.clamp(1, values.len()) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_that_occurred() {
        let mut values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        assert_eq!(
            [0.5, 0.99, 1.0, 0.0].map(|share| percentile(&mut values, share)),
            [50.0, 99.0, 100.0, 1.0]
        );
        assert_eq!(percentile(&mut [7.0], 0.99), 7.0);
    }
}
