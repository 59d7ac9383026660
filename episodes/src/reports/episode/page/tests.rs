//! What the page says of an episode, and what it keeps out.

use tandem_tools_spec::{PhaseTimes, Protocol};

use super::*;
use crate::tasks;

fn page(phase_times_s: [Option<f64>; 3], protocol: Protocol) -> String {
    page_from(0.0, phase_times_s, protocol)
}

fn page_from(begin_s: f64, phase_times_s: [Option<f64>; 3], protocol: Protocol) -> String {
    let phases = phase_times_s.into_iter().enumerate().map(|(index, time_s)| (Phase::number(index), time_s));
    let result = ResultReply {
        task: "handover".into(),
        seed: 4,
        protocol,
        phases: PhaseTimes(phases.collect()),
        ended: EndReason::Finished,
        env_steps: 500,
        tool_calls: 3,
        falls: 0,
        realtime_factor: 3.5,
        state_hash: "<script>".into(),
        extra_information: vec![],
        recording_failed: None,
    };
    let mut calls = CallCounts::default();
    [true, true, false].into_iter().for_each(|answered| calls.count("move_wrists", answered));
    let wall_clock_left_s = (protocol == Protocol::Agentic).then_some(1740.0);
    let budget_left = Some(Budget { steps_left: 5500, wall_clock_left_s, steps_per_command: 25 });
    let task = tasks::find("handover").unwrap();
    EpisodePage { task, result: &result, calls: &calls, begin_s, budget_left, strip: b"png" }.html()
}

#[test]
fn pages_tell_what_happened() {
    let check = |page: &str, expected: &[&str], absent: &[&str]| {
        expected.iter().for_each(|text| assert!(page.contains(text), "no `{text}` in {page}"));
        absent.iter().for_each(|text| assert!(!page.contains(text), "`{text}` in {page}"));
    };
    check(
        &page([Some(4.0), Some(10.0), None], Protocol::Agentic),
        &[
            "2 of 3 phases reached",
            "not reached",
            r#"<span style="width:40.00%">p1 4.00 s</span><span style="width:60.00%">p2 10.00 s</span></div>"#,
            "500 of 6000, 300 of them the initial hold",
            "60.0 of 1800 s",
            r#"<code>move_wrists</code></td><td class="number">2</td><td class="number">1</td>"#,
            "data:image/png;base64,cG5n",
        ],
        &["p3 1"],
    );
    check(
        &page([Some(4.0), Some(5.0), Some(10.0)], Protocol::Benchmark),
        &["3 of 3 phases reached", "500 of 1000", "<span>0 s</span><span>10.00 s</span>"],
        &["not reached", "Policy's own time", "initial hold"],
    );
    // What was reached before it began is not part of it.
    check(
        &page_from(6.5, [Some(4.0), Some(8.5), None], Protocol::Benchmark),
        &[
            r#"<div class="timeline"><span style="width:20.00%">p2 8.50 s</span><span class="rest" style="width:80.00%">"#,
            "<span>6.5 s</span><span>16.50 s</span>",
        ],
        &["p1 4.00 s</span>"],
    );
}

#[test]
fn pages_load_nothing_and_escape_what_they_quote() {
    let page = page([None; 3], Protocol::Agentic);
    assert!(page.contains("<code>&lt;script&gt;</code>"));
    assert!(!page.contains("<script"));
    assert!(!page.contains("<link") && !page.contains("url(") && !page.contains("src=\"http"));
}
