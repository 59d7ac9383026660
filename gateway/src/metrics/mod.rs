//! Counters of a server, in the text format of Prometheus.

mod page;

pub use page::MetricsPage;

use std::{
    collections::BTreeMap,
    sync::{Mutex, MutexGuard},
    time::Duration,
};

use page::Histogram;
use tandem_tools_spec::EndReason;

/// Counts since the start of the server.
#[derive(Debug, Default)]
pub struct Metrics {
    counts: Mutex<Counts>,
}

#[derive(Debug, Default)]
struct Counts {
    started: u64,
    /// Number of ended episodes by reason.
    ended: BTreeMap<String, u64>,
    /// Number of calls by tool and HTTP status.
    calls: BTreeMap<(&'static str, u16), u64>,
    /// Times to answer calls, by tool.
    answered: BTreeMap<&'static str, Histogram>,
    /// Number of refusals by the kind of problem.
    refused: BTreeMap<String, u64>,
    physics: Duration,
    control_steps: u64,
}

impl Metrics {
    /// Counts an episode that has begun.
    pub fn episode_started(&self) {
        self.lock().started += 1;
    }

    /// Counts an episode that has ended.
    pub fn episode_ended(&self, reason: EndReason) {
        let name = serde_json::json!(reason).as_str().unwrap_or_default().to_owned();
        *self.lock().ended.entry(name).or_default() += 1;
    }

    /// Counts a call that was answered or refused after the time `took`.
    pub fn call_answered(&self, tool: &'static str, status: u16, took: Duration) {
        let mut counts = self.lock();
        *counts.calls.entry((tool, status)).or_default() += 1;
        counts.answered.entry(tool).or_default().add(took);
    }

    /// Counts a request that was refused with this kind of problem.
    pub fn request_refused(&self, problem: &str) {
        *self.lock().refused.entry(problem.to_owned()).or_default() += 1;
    }

    /// Counts `control_steps` simulated steps, which took the time `physics`.
    pub fn simulated(&self, control_steps: u64, physics: Duration) {
        let mut counts = self.lock();
        counts.control_steps += control_steps;
        counts.physics += physics;
    }

    /// Returns the physics time of all episodes together.
    pub fn physics(&self) -> Duration {
        self.lock().physics
    }

    /// Returns all counts in the format of Prometheus. `held` is the number of held episodes, and `running`
    /// is the number of those that have not ended.
    pub fn page(&self, held: usize, running: usize) -> String {
        let counts = self.lock();
        let mut page = MetricsPage::default();
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
        // Every count stays valid even if a thread panics while it holds the lock.
        self.counts.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_that_was_counted_is_on_the_page() {
        let metrics = Metrics::default();
        metrics.episode_started();
        metrics.episode_ended(EndReason::StepBudgetExhausted);
        metrics.call_answered("wait", 200, Duration::from_millis(1));
        metrics.call_answered("wait", 422, Duration::from_secs(9));
        metrics.request_refused("invalid-arguments");
        metrics.simulated(25, Duration::from_millis(2500));
        metrics.simulated(5, Duration::from_millis(500));
        assert_eq!(metrics.physics(), Duration::from_secs(3));
        let page = metrics.page(3, 2);
        for line in [
            "# TYPE tandem_episodes_running gauge",
            "tandem_episodes_running 2",
            "tandem_episodes_held 3",
            "tandem_episodes_started_total 1",
            "tandem_episodes_ended_total{reason=\"step_budget_exhausted\"} 1",
            "tandem_calls_total{tool=\"wait\",status=\"200\"} 1",
            "tandem_calls_total{tool=\"wait\",status=\"422\"} 1",
            "# TYPE tandem_call_duration_seconds histogram",
            "tandem_call_duration_seconds_bucket{tool=\"wait\",le=\"0.0005\"} 0",
            "tandem_call_duration_seconds_bucket{tool=\"wait\",le=\"0.001\"} 1",
            "tandem_call_duration_seconds_bucket{tool=\"wait\",le=\"5\"} 1",
            "tandem_call_duration_seconds_bucket{tool=\"wait\",le=\"+Inf\"} 2",
            "tandem_call_duration_seconds_sum{tool=\"wait\"} 9.001",
            "tandem_call_duration_seconds_count{tool=\"wait\"} 2",
            "tandem_refused_requests_total{problem=\"invalid-arguments\"} 1",
            "tandem_physics_seconds_total 3",
            "tandem_control_steps_total 30",
        ] {
            assert!(page.lines().any(|found| found == line), "no {line:?} in\n{page}");
        }
    }

    #[test]
    fn every_line_has_help_and_a_type_before_it() {
        let metrics = Metrics::default();
        metrics.call_answered("wait", 200, Duration::ZERO);
        let page = metrics.page(0, 0);
        let mut known: Vec<&str> = Vec::new();
        for line in page.lines() {
            match line.split(' ').collect::<Vec<_>>()[..] {
                ["#", "HELP", name, _, ..] => known.push(name),
                ["#", "TYPE", name, "gauge" | "counter" | "histogram"] => {
                    assert_eq!(known.last(), Some(&name))
                }
                [sample, value] => {
                    assert!(known.last().is_some_and(|name| sample.starts_with(name)), "{line}");
                    assert!(value.parse::<f64>().is_ok(), "{line}");
                }
                _ => panic!("{line:?} is no line of the format"),
            }
        }
        assert!(page.ends_with('\n'));
    }
}
