//! Which episodes are kept, what is noted, and how they are counted.

use tandem_tools_spec::{EndReason, PhaseTimes, ResultReply};

use super::keep::missed;
use super::*;
use crate::reports::write_result;

/// Against R's `binom.test(k, n)$conf.int`.
#[test]
fn intervals_are_clopper_and_pearsons() {
    for (successes, trials, [low, high]) in [
        (10, 10, [0.6915, 1.0]),
        (0, 10, [0.0, 0.3085]),
        (17, 20, [0.6211, 0.9679]),
        (95, 100, [0.8872, 0.9836]),
    ] {
        let interval = clopper_pearson(successes, trials);
        assert!((interval[0] - low).abs() < 1e-4 && (interval[1] - high).abs() < 1e-4, "{interval:?}");
    }
}

fn result(task: &str, seed: u32, phases: Vec<(String, Option<f64>)>) -> ResultReply {
    ResultReply {
        task: task.into(),
        seed,
        protocol: Protocol::Benchmark,
        phases: PhaseTimes(phases),
        ended: EndReason::Finished,
        env_steps: 812,
        tool_calls: 61,
        falls: 0,
        realtime_factor: 3.5,
        state_hash: "00c0ffee00c0ffee".into(),
        recording_failed: None,
    }
}

/// An episode that was played under `keeper`'s rules.
fn played(keeper: &Keeper, task: &'static Task, seed: u32) -> Played {
    Played {
        policy: keeper.plan.player.name.into(),
        spec: keeper.plan.spec(task, seed),
        locomotion: keeper.locomotion.clone(),
        build: keeper.build.into(),
        result: result(task.id, seed, vec![("p1".into(), Some(4.2))]),
        note: None,
    }
}

#[test]
fn the_first_phase_that_was_missed_is_noted() {
    let note = |times: [Option<f64>; 3]| {
        let phases = ["p1", "p2", "p3"].into_iter().map(String::from).zip(times).collect();
        missed(&result("handover", 7, phases))
    };
    let second = note([Some(4.2), None, None]);
    assert_eq!(second.as_deref(), Some("p2 was not reached in 812 steps"));
    assert_eq!(note([Some(4.2), Some(5.0), Some(6.0)]), None);
}

#[test]
fn only_the_same_episode_of_the_same_build_is_taken_from_an_earlier_run() {
    let folder = tempfile::tempdir().unwrap();
    let task = crate::tasks::find("pouring").unwrap();
    let plan = Plan {
        player: players::find("expert").unwrap(),
        protocol: Protocol::Agentic,
        robot: RobotFile::default(),
        locomotion: Controller::Balance,
        renderer: RendererKind::Cpu,
        tasks: vec![task],
        seeds: vec![7],
        jobs: 1,
        record: false,
    };
    let build = fingerprint::build().unwrap();
    let keeper = Keeper { plan: &plan, folder: folder.path(), locomotion: "balance".into(), build };
    let kept_after = |text: &str| {
        std::fs::write(folder.path().join("pouring-7.json"), text).unwrap();
        keeper.kept(task, 7)
    };
    assert_eq!(keeper.kept(task, 7), None, "nothing was played");
    let same = played(&keeper, task, 7);
    let text = serde_json::to_string(&same).unwrap();
    assert_eq!(kept_after(&text), Some(same.clone()));
    assert_eq!(kept_after(&text[..text.len() / 2]), None, "a torn file");
    type Change = fn(&mut Played);
    for (what, change) in [
        ("task", (|played| played.result.task = "handover".into()) as Change),
        ("seed", |played| played.result.seed = 8),
        ("protocol", |played| played.spec.protocol = Protocol::Benchmark),
        ("robot", |played| played.spec.robot = RobotFile::File("other.xml".into())),
        ("policy", |played| played.policy = "idle".into()),
        ("controller", |played| played.locomotion.push('0')),
        ("build", |played| played.build.push('0')),
    ] {
        let mut other = same.clone();
        change(&mut other);
        assert_eq!(kept_after(&serde_json::to_string(&other).unwrap()), None, "another {what}");
    }

    // One that was played without a recording is no demonstration.
    let recorded = Plan { record: true, ..plan.clone() };
    let collector = Keeper { plan: &recorded, ..keeper };
    std::fs::write(folder.path().join("pouring-7.json"), &text).unwrap();
    assert_eq!(collector.kept(task, 7), None, "no recording");
    std::fs::create_dir(folder.path().join("pouring-7")).unwrap();
    write_result(&same.result, &folder.path().join("pouring-7")).unwrap();
    assert_eq!(collector.kept(task, 7), Some(same));
}
