//! Tests of the explanation why a recorded episode of a task file did not reach a phase.

use std::path::Path;

use tandem_episodes::replay::{Closest, ConditionTrace, PhaseTrace};
use tandem_episodes::tasks::{self, PhaseSetting, Task};
use tandem_episodes::{EpisodeSpec, Recording, Session, read_task, task_of};
use tandem_tools_spec::Protocol;

use crate::common::*;

fn parcel() -> Task {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../gateway/examples/tasks/pass_the_parcel.toml");
    read_task(Path::new(path)).expect("a task")
}

/// Returns the trace of an episode in which the robots stand still.
fn stood_still(task: &Task) -> PhaseTrace {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let spec = EpisodeSpec::new(task, 0, Protocol::Benchmark);
    let mut session = Session::start(&spec, Some(folder.path())).expect("an episode");
    wait(&mut session, 50);
    session.close();
    PhaseTrace::of(&Recording::read(folder.path()).expect("a recording"))
        .expect("it can be scored")
        .expect("not all was reached")
}

/// Returns the task with another condition of its first phase.
fn with(done: &str) -> Task {
    let mut source = parcel().source.clone();
    let own = "done = 'x_m(\"parcel\") >= line_m && released_for_s(\"parcel\") >= 0.2'";
    assert!(source.text.contains(own));
    source.text = source.text.replace(own, done);
    task_of(source).expect("a task")
}

#[test]
fn each_part_says_when_it_held_or_how_near_it_came() {
    let trace = stood_still(&parcel());
    assert_eq!((trace.number.as_str(), trace.id.as_str()), ("p1", "push"));
    let [condition] = &trace.conditions[..] else { panic!("one condition: {trace:?}") };
    let [pushed, released] = &condition.parts[..] else { panic!("two parts: {condition:?}") };
    assert_eq!((pushed.place, pushed.text.as_str()), ([50, 9], "x_m(\"parcel\") >= line_m"));
    let place = [50, 36];
    assert_eq!((released.place, released.text.as_str()), (place, "released_for_s(\"parcel\") >= 0.2"));
    assert_eq!((condition.held.steps, condition.held.of, pushed.held.steps), (0, 50, 0));
    assert!((30..=50).contains(&released.held.steps), "{:?}", released.held);
    let Some(Closest::Sides([x_m, line_m])) = pushed.nearest.map(|nearest| nearest.best) else {
        panic!("a comparison: {pushed:?}")
    };
    assert!((0.32..0.36).contains(&x_m) && line_m == 0.45, "{x_m} against {line_m}");
    assert_eq!(condition.most_at_once.best, 1);
    assert!(trace.nearest.best > 0.0 && trace.nearest.best < 1.0, "{:?}", trace.nearest);
}

#[test]
fn terms_are_taken_apart_and_durations_are_counted() {
    let trace =
        stood_still(&with("lasting = 'nobody_fell && time_s() < 0.99'\nfor_s = 1\nat_end = 'fallen(\"A\")'"));
    let [lasting, at_end] = &trace.conditions[..] else { panic!("two conditions: {trace:?}") };
    assert_eq!((lasting.setting, at_end.setting), (PhaseSetting::Lasting, PhaseSetting::AtEnd));
    let texts: Vec<(&str, [usize; 2])> =
        lasting.parts.iter().map(|part| (part.text.as_str(), part.place)).collect();
    let [one, other] = [("!fallen(\"A\")", [45, 16]), ("!fallen(\"B\")", [45, 32])];
    assert_eq!(texts, [one, other, ("time_s() < 0.99", [50, 27])]);
    assert_eq!((lasting.held.of, lasting.held.steps, lasting.held.longest), (50, 49, 49));
    assert!((lasting.held.longest_s() - 0.96).abs() < 1e-9 && lasting.for_s == 1.0);
    assert_eq!((at_end.held.steps, at_end.parts[0].nearest), (0, None));
}

#[test]
fn a_hand_that_comes_nearer_is_a_share() {
    let trace = stood_still(&with("done = 'holds(\"A\", \"right\", \"parcel\")'"));
    let nearest = trace.conditions[0].parts[0].nearest.map(|nearest| nearest.best);
    assert!(matches!(nearest, Some(Closest::Share(share)) if share > 0.2 && share < 0.5), "{nearest:?}");
}

#[test]
fn conditions_of_the_benchmark_say_when_they_held() {
    let settings = |task: &str| {
        let trace = stood_still(&tasks::find(task).expect("a task"));
        assert!(!trace.description.is_empty() && trace.nearest.best < 1.0, "{trace:?}");
        trace.conditions
    };
    let [lifted, open] = &settings("move_house")[..] else { panic!("two milestones") };
    let texts = |of: &ConditionTrace| of.parts.iter().map(|part| part.text.clone()).collect::<Vec<_>>();
    assert_eq!(texts(lifted)[1], "clearance_m(\"console_table\") >= 0.03");
    assert_eq!(texts(open), ["opened_deg >= 83.079"]);
    assert_eq!((open.setting, open.for_s, lifted.for_s), (PhaseSetting::Milestone, 0.5, 0.0));
    assert_eq!((open.held.of, open.held.steps, lifted.held.first_s), (50, 0, None));
    for task in tasks::cohub() {
        let conditions = settings(&task.id);
        let explained = conditions.iter().all(|condition| !condition.parts.is_empty());
        assert!(explained && !conditions.is_empty(), "{}: {conditions:?}", task.id);
    }
}
