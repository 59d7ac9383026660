//! Texts that the page has to show, and texts that it has to leave out.

use tandem_tools_spec::{Assistance, Note, PhaseTimes, Protocol};

use super::*;
use crate::pages::LabelledPicture;
use crate::protocol::rules;
use crate::tasks;

fn page(phase_times_s: [Option<f64>; 3], protocol: Protocol) -> String {
    page_from(0.0, phase_times_s, protocol)
}

fn page_from(begin_s: f64, phase_times_s: [Option<f64>; 3], protocol: Protocol) -> String {
    page_of(begin_s, &result(phase_times_s, protocol))
}

fn result(phase_times_s: [Option<f64>; 3], protocol: Protocol) -> ResultReply {
    let phases = phase_times_s.into_iter().enumerate().map(|(index, time_s)| (Phase::number(index), time_s));
    ResultReply {
        task: "handover".into(),
        seed: Some(4),
        protocol,
        phases: PhaseTimes(phases.collect()),
        success: None,
        ended: EndReason::Finished,
        env_steps: 500,
        tool_calls: 3,
        requests: None,
        thinking_s: 0.0,
        operators: Vec::new(),
        falls: 0,
        realtime_factor: 3.5,
        state_hash: Some("<script>".into()),
        simulator_failure: None,
        assistance: Assistance::Full,
        extra_information: vec![],
        extra_information_replies: Default::default(),
        joints_clamped_share: None,
        departures: vec![],
        recording_failed: None,
        usage: None,
    }
}

fn page_of(begin_s: f64, result: &ResultReply) -> String {
    let protocol = result.protocol;
    let mut calls = CallCounts::default();
    [true, true, false].into_iter().for_each(|answered| calls.count("move_wrists", answered));
    let wall_clock_left_s = (protocol == Protocol::Agentic).then_some(1740.0);
    let budget_left = Some(Budget { steps_left: 5500, wall_clock_left_s, steps_per_command: 25 });
    let task = tasks::find("handover").unwrap();
    let views = vec![LabelledPicture { label: "what A sees".into(), file: b"png".into() }];
    let moments = [KeyMoment { caption: ["p1 <grasp>".into(), "4.0 s".into()], views }];
    let rules = rules(protocol, &task);
    let said = [SaidWords { time_s: 1.5, robot: "A".into(), text: "the <red> one".into() }];
    EpisodePage {
        task: &task,
        instruction: &task.instruction,
        result,
        calls: &calls,
        said: &said,
        begin_s,
        rules,
        budget_left,
        moments: &moments,
    }
    .html()
}

#[test]
fn a_page_says_how_the_simulator_failed() {
    let failure = Some("in step 501, physics diverged at link `left_<knee>`".into());
    let result = ResultReply {
        ended: EndReason::SimulatorFailed,
        simulator_failure: failure,
        ..result([None; 3], Protocol::Benchmark)
    };
    let page = page_of(0.0, &result);
    let expected = "The simulator failed in step 501, physics diverged at link `left_&lt;knee&gt;`.";
    assert!(page.contains(expected), "no `{expected}` in {page}");
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
            r#"<td class="number">1.50 s</td><td>A</td><td class="long">the &lt;red&gt; one</td>"#,
            "data:image/png;base64,cG5n",
            // The texts of an image are escaped.
            r#"<p>p1 &lt;grasp&gt; <span class="soft">4.0 s</span></p>"#,
            "<figcaption>what A sees</figcaption>",
            r#"alt="what A sees, p1 &lt;grasp&gt; 4.0 s""#,
        ],
        &["p3 1"],
    );
    check(
        &page([Some(4.0), Some(5.0), Some(10.0)], Protocol::Benchmark),
        &["3 of 3 phases reached", "500 of 1000", "<span>0 s</span><span>10.00 s</span>"],
        &["not reached", "Policy's own time", "initial hold"],
    );
    // A phase that was reached before the start is not shown in the timeline.
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
fn pages_count_each_robots_model_by_itself() {
    let mut usage = Usage::default();
    usage.add(&Note::example());
    usage.add(&Note { robot: Some("B".into()), model: Some("<other>".into()), usd: None, ..Note::example() });
    let page = page_of(0.0, &ResultReply { usage: Some(usage), ..result([None; 3], Protocol::Agentic) });
    let numbers = |numbers: [&str; 5]| {
        numbers.map(|number| format!(r#"<td class="number">{number}</td>"#)).concat() + "</tr>"
    };
    for (robot, model, own) in [
        ("A", "a-model", ["5210 tokens read", "4800 cached", "84 written", "0.0040 US dollars", "2.5 s"]),
        ("B", "&lt;other&gt;", ["5210 tokens read", "4800 cached", "84 written", "", "2.5 s"]),
        (
            "all",
            "a-model, &lt;other&gt;",
            ["10420 tokens read", "9600 cached", "168 written", "0.0040 US dollars", "5.0 s"],
        ),
    ] {
        let row = format!(r#"<tr><td>{robot}</td><td class="long">{model}</td>{}"#, numbers(own));
        assert!(page.contains(&row), "no `{row}` in {page}");
    }
}

#[test]
fn pages_load_nothing_and_escape_what_they_quote() {
    let page = page([None; 3], Protocol::Agentic);
    assert!(page.contains("<code>&lt;script&gt;</code>"));
    assert!(!page.contains("<script"));
    assert!(!page.contains("<link") && !page.contains("url(") && !page.contains("src=\"http"));
}

/// Cells with long texts become separate lines if there is no room for columns.
#[test]
fn no_table_of_words_needs_more_room_than_a_telephone_has() {
    let page = page([Some(4.0), None, None], Protocol::Agentic);
    let tables: Vec<&str> =
        page.split("<table").skip(1).map(|table| table.split_once("</table>").unwrap().0).collect();
    assert_eq!(tables.len(), 4);
    for table in tables {
        let words = table.starts_with(" class=\"words\"");
        for cell in table.split("<td").skip(1).map(|cell| cell.split_once("</td>").unwrap().0) {
            let (class, text) = cell.split_once('>').unwrap();
            let lone = words && class.contains("long");
            assert!(lone || text.len() < 50, "{cell}");
        }
    }
}
