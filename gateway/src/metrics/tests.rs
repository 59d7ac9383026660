//! The page, line by line.

use super::*;

#[test]
fn everything_that_was_counted_is_on_the_page() {
    let metrics = Metrics::default();
    metrics.episode_started();
    metrics.episode_ended(EndReason::StepBudgetExhausted);
    metrics.call("wait", 200, Duration::from_millis(1));
    metrics.call("wait", 422, Duration::from_secs(9));
    metrics.refusal("invalid-arguments");
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
    metrics.call("wait", 200, Duration::ZERO);
    let page = metrics.page(0, 0);
    let mut known: Vec<&str> = Vec::new();
    for line in page.lines() {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["#", "HELP", name, _, ..] => known.push(name),
            ["#", "TYPE", name, "gauge" | "counter" | "histogram"] => assert_eq!(known.last(), Some(&name)),
            [sample, value] => {
                assert!(known.last().is_some_and(|name| sample.starts_with(name)), "{line}");
                assert!(value.parse::<f64>().is_ok(), "{line}");
            }
            _ => panic!("{line:?} is no line of the format"),
        }
    }
    assert!(page.ends_with('\n'));
}
