//! What a server has done, counted, in the text format that Prometheus reads.

mod histogram;
mod page;
#[cfg(test)]
mod tests;

pub use page::Page;

use std::{
    collections::BTreeMap,
    sync::{Mutex, MutexGuard},
    time::Duration,
};

use histogram::Histogram;
use tandem_tools_spec::EndReason;

/// Counts since the server began.
#[derive(Debug, Default)]
pub struct Metrics {
    counts: Mutex<Counts>,
}

#[derive(Debug, Default)]
struct Counts {
    started: u64,
    /// By why they ended.
    ended: BTreeMap<String, u64>,
    /// By tool and HTTP status.
    calls: BTreeMap<(&'static str, u16), u64>,
    /// By tool.
    answered: BTreeMap<&'static str, Histogram>,
    /// By the kind of problem.
    refused: BTreeMap<String, u64>,
    physics: Duration,
    control_steps: u64,
}

impl Metrics {
    /// An episode has begun.
    pub fn episode_started(&self) {
        self.lock().started += 1;
    }

    /// An episode has ended.
    pub fn episode_ended(&self, reason: EndReason) {
        let name = serde_json::json!(reason).as_str().unwrap_or_default().to_owned();
        *self.lock().ended.entry(name).or_default() += 1;
    }

    /// A call was answered, whatever the answer was, after so long.
    pub fn call(&self, tool: &'static str, status: u16, took: Duration) {
        let mut counts = self.lock();
        *counts.calls.entry((tool, status)).or_default() += 1;
        counts.answered.entry(tool).or_default().add(took);
    }

    /// A request was refused with a problem of this kind.
    pub fn refusal(&self, problem: &str) {
        *self.lock().refused.entry(problem.to_owned()).or_default() += 1;
    }

    /// An episode went on by so many control steps, for which physics took so long.
    pub fn simulated(&self, control_steps: u64, physics: Duration) {
        let mut counts = self.lock();
        counts.control_steps += control_steps;
        counts.physics += physics;
    }

    /// Time that physics has taken, of all episodes together.
    pub fn physics(&self) -> Duration {
        self.lock().physics
    }

    /// Everything, where `held` episodes are held of which `running` go on.
    pub fn page(&self, held: usize, running: usize) -> String {
        let counts = self.lock();
        let mut page = Page::default();
        page.gauge("tandem_episodes_held", "Episodes that are held, those that have ended included.", held);
        page.gauge("tandem_episodes_running", "Episodes that go on.", running);
        page.counter("tandem_episodes_started_total", "Episodes that have begun.", [("", counts.started)]);
        let ended = counts.ended.iter().map(|(reason, count)| (format!("{{reason=\"{reason}\"}}"), *count));
        page.counter("tandem_episodes_ended_total", "Episodes that have ended, by why.", ended);
        let label = |(tool, status): &(&str, u16)| format!("{{tool=\"{tool}\",status=\"{status}\"}}");
        let calls = counts.calls.iter().map(|(which, count)| (label(which), *count));
        page.counter("tandem_calls_total", "Calls of tools, by tool and HTTP status.", calls);
        page.histograms(
            "tandem_call_duration_seconds",
            "Time from a call's arrival to its answer, by tool.",
            counts.answered.iter().map(|(tool, histogram)| (format!("tool=\"{tool}\""), histogram)),
        );
        let refused = counts.refused.iter().map(|(kind, count)| (format!("{{problem=\"{kind}\"}}"), *count));
        page.counter("tandem_refused_requests_total", "Requests that were refused, by problem.", refused);
        let physics_s = [("", counts.physics.as_secs_f64())];
        page.counter("tandem_physics_seconds_total", "Seconds that physics has taken.", physics_s);
        let steps = [("", counts.control_steps)];
        page.counter("tandem_control_steps_total", "Control steps of 20 ms that were simulated.", steps);
        page.text()
    }

    fn lock(&self) -> MutexGuard<'_, Counts> {
        // Counts stay whole whatever happens to who counts.
        self.counts.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
