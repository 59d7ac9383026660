//! Counts, groups, comparisons and texts of a report.

mod figures;
mod films;
mod header;
mod tex;

use std::path::Path;

use tandem_episodes::{
    EpisodeSpec, PhaseStart, Start,
    tasks::{self, Task},
};
use tandem_tools_spec::{Assistance, EndReason, PhaseTimes, Protocol, ResultReply};

use super::*;
use crate::results::PlayedEpisode;

/// Returns an episode that reached the first `phases` phases.
pub fn played(policy: &str, task: &Task, seed: u32, phases: usize) -> PlayedEpisode {
    let reached = |index: usize| (index < phases).then_some(4.0 * (index as f64 + 1.0));
    let times = (0..task.phases.len()).map(|index| (tandem_episodes::Phase::number(index), reached(index)));
    let ended = if phases == task.phases.len() { EndReason::TaskComplete } else { EndReason::Finished };
    PlayedEpisode {
        policy: policy.into(),
        spec: EpisodeSpec::new(task, seed, Protocol::Benchmark).assisted(Assistance::Paper),
        locomotion: "balance".into(),
        build: "0.1.0+test".into(),
        result: ResultReply {
            task: task.id.clone(),
            seed: Some(seed),
            protocol: Protocol::Benchmark,
            phases: PhaseTimes(times.collect()),
            success: None,
            ended,
            env_steps: 500 + seed,
            tool_calls: 60,
            requests: None,
            thinking_s: 0.0,
            operators: Vec::new(),
            falls: u32::from(phases == 0),
            realtime_factor: 3.5,
            state_hash: Some(format!("{seed:016x}")),
            simulator_failure: None,
            assistance: Assistance::Paper,
            extra_information: vec![],
            extra_information_replies: Default::default(),
            joints_clamped_share: None,
            departures: vec![],
            recording_failed: None,
            usage: None,
        },
        thought_s: f64::from(seed),
        note: None,
        keep_failed: false,
        attempts: Vec::new(),
        ended_at: None,
    }
}

/// Returns ten episodes of Handover. Nine, six and three of them reach phases 1, 2 and 3.
pub fn nine_six_three(policy: &str) -> Vec<PlayedEpisode> {
    let task = tasks::find("handover").unwrap();
    let reached = [3, 3, 3, 2, 2, 2, 1, 1, 1, 0];
    (0..).zip(reached).map(|(seed, phases)| played(policy, &task, seed, phases)).collect()
}

fn write(folder: &Path, episodes: &[PlayedEpisode]) {
    std::fs::create_dir_all(folder.join("episodes")).unwrap();
    for played in episodes {
        let name = format!("{}-{}.json", played.spec.task.id, played.spec.seed);
        let text = serde_json::to_string(played).unwrap();
        std::fs::write(folder.join("episodes").join(name), text).unwrap();
    }
}

pub fn found(episodes: Vec<PlayedEpisode>) -> LoadedEpisodes {
    let episodes = episodes
        .into_iter()
        .map(|played| FoundEpisode { played, strip: None, recording: None, page: None, run: String::new() })
        .collect();
    LoadedEpisodes { episodes, ..LoadedEpisodes::default() }
}

#[test]
fn folders_are_joined_and_nothing_counts_twice() {
    let folder = tempfile::tempdir().unwrap();
    let [one, other] = ["one", "other"].map(|name| folder.path().join(name));
    let episodes = nine_six_three("agent");
    write(&one, &episodes[..7]);
    write(&other, &episodes[5..]);
    std::fs::write(one.join("episodes/torn.json"), "{\"policy\"").unwrap();
    let loaded = load(&[one.clone(), other]).unwrap();
    assert_eq!((loaded.episodes.len(), loaded.skipped.len()), (10, 1));
    assert!(loaded.skipped[0].contains("torn.json"), "{:?}", loaded.skipped);
    let report = EvaluationReport::of(&loaded);
    assert_eq!((report.policies.len(), report.policies[0].episodes), (1, 10));
    let text = load(&[folder.path().into()]).unwrap_err().to_string();
    assert!(text.contains("no episodes in"), "{text}");
}

#[test]
fn rates_are_counted_by_phase() {
    let report = EvaluationReport::of(&found(nine_six_three("agent")));
    let handover = &report.policies[0].tasks[0];
    let fractions = |rate: fn(&PhaseReport) -> Option<Rate>| -> Vec<String> {
        handover.phases.iter().map(|phase| rate(phase).map_or("-".into(), Rate::fraction)).collect()
    };
    assert_eq!(fractions(|phase| phase.cumulative), ["9/10", "6/10", "3/10"]);
    assert_eq!(fractions(|phase| phase.conditional), ["9/10", "6/9", "3/6"]);
    assert_eq!(fractions(|phase| phase.from_its_beginning), ["-", "-", "-"]);
    let [together] = &report.policies[0].together[..] else { panic!("means of one number of robots") };
    assert_eq!(together.robots, 2);
    let mean = |mean: &Option<MeanRate>| mean.as_ref().map(|mean| mean.mean_share);
    assert_eq!((mean(&together.alone), mean(&together.together)), (Some(0.7), Some(6.0 / 9.0)));
    let effort = handover.effort.as_ref().unwrap();
    assert_eq!((effort.steps.min, effort.steps.median_value, effort.steps.max), (500.0, 504.5, 509.0));
    let reasons: Vec<_> =
        report.policies[0].reasons.iter().map(|r| (&*r.phase, &*r.why, &*r.seeds)).collect();
    let ended = "the policy ended the episode";
    let fell = "the policy ended the episode; a robot fell";
    let expected: [(&str, &str, &[u32]); 3] =
        [("p1", fell, &[9]), ("p2", ended, &[6, 7, 8]), ("p3", ended, &[3, 4, 5])];
    assert_eq!(reasons, expected);
}

#[test]
fn averages_are_by_number_of_robots() {
    let everything = tasks::cohub().iter().flat_map(|task| {
        (0..4).map(move |seed| played("agent", task, seed, if seed == 0 { 0 } else { task.phases.len() }))
    });
    let report = EvaluationReport::of(&found(everything.collect()));
    let averages = &report.policies[0].averages;
    assert_eq!(averages.iter().map(|average| average.tasks).sum::<usize>(), tasks::cohub().len());
    for average in averages {
        let of_robots = tasks::cohub().iter().filter(|task| task.robots.len() == average.robots).count();
        assert_eq!(average.tasks, of_robots);
        assert!(average.phases.iter().flatten().all(|mean| mean.mean_share == 0.75), "{average:?}");
    }
    let published = published::rows();
    for task in tasks::cohub() {
        assert!(published.iter().any(|row| row.task == task.id), "nothing is published of {}", task.id);
    }
    assert!(published.iter().all(|row| row.phases_share.is_sorted_by(|one, next| one >= next)));
}

#[test]
fn policies_are_compared_on_the_seeds_that_both_played() {
    let mut episodes = nine_six_three("one");
    let handover = tasks::find("handover").unwrap();
    // Seed 0 is worse, seeds 3 to 8 are better, and the first policy did not play the last one.
    let others = [(0, 2), (1, 3), (3, 3), (4, 3), (5, 3), (6, 3), (7, 3), (8, 3), (9, 0), (70, 3)];
    episodes.extend(others.map(|(seed, phases)| played("other", &handover, seed, phases)));
    let report = EvaluationReport::of(&found(episodes));
    let last = report.comparisons[0].rows.iter().find(|row| row.last && row.task.is_some()).unwrap();
    let pairs = last.pairs;
    assert_eq!((pairs.both, pairs.first_only, pairs.second_only, pairs.neither), (1, 1, 6, 1));
    assert!((last.difference_share - 5.0 / 9.0).abs() < 1e-12, "{last:?}");
    assert!((last.mcnemar_p_value - 0.125).abs() < 1e-12, "{last:?}");
    let all = report.comparisons[0].rows.last().unwrap();
    assert_eq!((&all.task, all.pairs), (&None, pairs));
}

#[test]
fn namesakes_are_told_apart_by_what_differs() {
    let [one, mut other] = [nine_six_three("agent"), nine_six_three("agent")];
    other.iter_mut().for_each(|played| played.spec.protocol = Protocol::Agentic);
    let report = EvaluationReport::of(&found([one, other].concat()));
    let names: Vec<&str> = report.policies.iter().map(|policy| policy.name.as_str()).collect();
    assert_eq!(names, ["agent (benchmark)", "agent (agentic)"]);
}

/// Departures from the benchmark follow the policy's name in every format.
#[test]
fn departures_stand_behind_the_name() {
    let [one, mut other] = [nine_six_three("agent"), nine_six_three("agent")];
    other.iter_mut().for_each(|played| {
        played.spec.hints = tandem_tools_spec::Hints::On;
        played.spec.locomotion = tandem_episodes::Controller::File("policies/fast.onnx".into());
        played.spec.sensing = tandem_sim::Sensing::TRUTH;
    });
    let report = EvaluationReport::of(&found([one, other].concat()));
    let names: Vec<&str> = report.policies.iter().map(|policy| policy.name.as_str()).collect();
    assert_eq!(names, ["agent", "agent + hints: on + controller: fast.onnx + state estimate: truth"]);
    for format in ReportFormat::ALL {
        let text = report.write(format, &ReportPictures::default()).unwrap();
        assert!(text.contains(names[1]), "{format:?}: {text}");
    }
}

#[test]
fn joint_targets_beyond_limits_are_told_where_there_were_some() {
    let mut episodes = nine_six_three("agent");
    let text = |episodes: &[PlayedEpisode]| {
        let report = EvaluationReport::of(&found(episodes.to_vec()));
        report.write(ReportFormat::Markdown, &ReportPictures::default()).unwrap()
    };
    assert!(!text(&episodes).contains("Joint targets beyond limits"));
    episodes.iter_mut().for_each(|played| played.result.joints_clamped_share = Some(0.34));
    assert!(text(&episodes).contains("| agent | handover | 34 |"), "{}", text(&episodes));
}

/// Information that only some episodes showed to a policy is named and counted. The episodes still belong to
/// one policy.
#[test]
fn what_was_shown_beyond_the_benchmark_is_told() {
    let mut episodes = nine_six_three("agent");
    let replies = |count: u32| [("A".to_owned(), count), ("B".to_owned(), 1)].into_iter().collect();
    for played in &mut episodes[..2] {
        played.result.extra_information = vec!["pixel_depth".into()];
        played.result.extra_information_replies = [("pixel_depth".to_owned(), replies(3))].into();
    }
    let mut told_all = played("other", &tasks::find("handover").unwrap(), 0, 2);
    told_all.spec = told_all.spec.assisted(Assistance::Full);
    told_all.result.extra_information = vec!["depth_images".into(), "odometry".into()];
    episodes.push(told_all);
    let report = EvaluationReport::of(&found(episodes));
    let names: Vec<&str> = report.policies.iter().map(|policy| policy.name.as_str()).collect();
    // The level `full` includes odometry, so the name does not list odometry.
    assert_eq!(names, ["agent + pixel_depth", "other + depth_images + assistance: full"]);
    let shown = |policy: &PolicyReport| -> Vec<(String, usize, Vec<u32>)> {
        let shown = policy.shown.iter();
        shown.map(|s| (s.what.clone(), s.episodes, s.replies.values().copied().collect())).collect()
    };
    assert_eq!(shown(&report.policies[0]), [("pixel_depth".into(), 2, vec![6, 2])]);
    let other = [("depth_images".to_owned(), 1, vec![]), ("odometry".to_owned(), 1, vec![])];
    assert_eq!(shown(&report.policies[1]), other);
    let text = report.write(ReportFormat::Markdown, &ReportPictures::default()).unwrap();
    assert!(text.contains("| agent + pixel_depth | pixel depth | A 6, B 2 | 2/10 |"), "{text}");
    let page = report.write(ReportFormat::Html, &ReportPictures::default()).unwrap();
    assert!(page.contains("Shown beyond the benchmark") && page.contains("A 6, B 2"), "{page}");
}

/// Tasks for three robots have separate means in every format.
#[test]
fn means_of_phases_are_by_number_of_robots() {
    let begun = |task: &str, seed: u32, phase: usize, phases: usize| {
        let mut played = played("agent", &tasks::find(task).unwrap(), seed, phases);
        let recording = "demonstration".into();
        played.spec.start =
            Start::Phase(PhaseStart { recording, phase: tandem_episodes::Phase::number(phase) });
        played
    };
    let mut episodes = nine_six_three("agent");
    episodes.extend([begun("handover", 0, 1, 2), begun("big_table", 0, 0, 1), begun("big_table", 1, 0, 0)]);
    episodes.push(played("agent", &tasks::find("big_table").unwrap(), 2, 1));
    let report = EvaluationReport::of(&found(episodes));
    let policy = &report.policies[0];
    let conditional: Vec<(usize, Option<f64>)> =
        policy.together.iter().map(|m| (m.robots, m.together.as_ref().map(|m| m.mean_share))).collect();
    assert_eq!(conditional, [(2, Some(6.0 / 9.0)), (3, Some(0.5))]);
    let level = policy.phase_level.as_ref().unwrap();
    assert_eq!(level.two_robots.collaborative_share, Some(1.0));
    assert_eq!(level.three_robots.as_ref().unwrap().collaborative_share, Some(0.5));
    let text = report.write(ReportFormat::Markdown, &ReportPictures::default()).unwrap();
    let lines: Vec<&str> = text.lines().filter(|line| line.contains("| of ")).collect();
    let begins: Vec<String> = lines
        .iter()
        .map(|line| line.split('|').skip(2).take(2).map(str::trim).collect::<Vec<_>>().join(", "))
        .collect();
    let rates = ["conditional", "from their beginnings"];
    let expected = rates.map(|rates| [2, 3].map(|robots| format!("of {robots} robots, {rates}"))).concat();
    assert_eq!(begins, expected, "{text}");
    let page = report.write(ReportFormat::Html, &ReportPictures::default()).unwrap();
    for label in ["Phases together, conditional, %", "Phases together, 3 robots, conditional, %"] {
        assert!(page.contains(label), "no {label}: {page}");
    }
}

/// Tests every format with a policy whose name contains characters that every format has to escape.
#[test]
fn reports_quote_what_they_are_told() {
    let mut episodes = nine_six_three("a<b>&\"|_,%");
    let start = PhaseStart { recording: "demonstration".into(), phase: "p2".into() };
    let mut begun = played("a<b>&\"|_,%", &tasks::find("handover").unwrap(), 0, 2);
    begun.spec.start = Start::Phase(start);
    episodes.push(begun);
    let report = EvaluationReport::of(&found(episodes));
    let check = |format: ReportFormat, expected: &[&str], absent: &[&str]| {
        let text = report.write(format, &ReportPictures::default()).unwrap();
        for wanted in expected {
            assert!(text.contains(wanted), "{format:?} has no {wanted}: {text}");
        }
        for unwanted in absent {
            assert!(!text.contains(unwanted), "{format:?} has {unwanted}: {text}");
        }
    };
    check(
        ReportFormat::Html,
        &[
            "a&lt;b&gt;&amp;&quot;|_,%",
            "prefers-color-scheme: dark",
            "60 [26.2, 87.8] 6/10",
            "9/10</text>",
            "Published, on another scale",
            "Method (another scale)",
        ],
        &["<script", "<link", "url(", "src=\"http", "href=", "a<b>"],
    );
    check(
        ReportFormat::Markdown,
        &["a<b>&\"\\|_,%", "| p2 transfer | together | 60 [26.2, 87.8] 6/10 |"],
        &[],
    );
    check(
        ReportFormat::Csv,
        &[
            "\"a<b>&\"\"|_,%\",benchmark,handover,2,p2,transfer,true,cumulative,6,10,0.6,",
            ",from_its_beginning,1,1,1,0.02",
        ],
        &[],
    );
    check(
        ReportFormat::Tex,
        &["a$<$b$>$\\&\"\\textbar{}\\_,\\%", "\\toprule", "60 [26.2, 87.8] 6/10"],
        &["a<b>"],
    );
    let json: serde_json::Value =
        serde_json::from_str(&report.write(ReportFormat::Json, &ReportPictures::default()).unwrap()).unwrap();
    assert_eq!(json["policies"][0]["tasks"][0]["phases"][1]["cumulative"]["successes"], 6);
}

/// A policy that crashes when it is about to fail and then succeeds is listed.
#[test]
fn an_episode_that_was_played_again_is_listed() {
    let handover = tasks::find("handover").unwrap();
    let failed = |seed: u32, why: &str| {
        let mut played = played("one", &handover, seed, 1);
        (played.result.ended, played.note) = (EndReason::PolicyFailed, Some(why.into()));
        played
    };
    let mut episodes = nine_six_three("one");
    // One episode was played again in another folder, one in the same folder, and one until the retry limit.
    episodes[0].attempts = failed(0, "no plan").into_attempts();
    episodes.push(failed(3, "crash"));
    let attempts = failed(21, "no plan").into_attempts();
    episodes.push(PlayedEpisode { keep_failed: true, attempts, ..failed(21, "crash") });
    let report = EvaluationReport::of(&found(episodes));
    let again = report.policies[0].played_again.iter();
    let again: Vec<_> = again.map(|again| (again.seed, again.earlier.join(", "), &*again.last)).collect();
    let expected = [(0, "no plan", "success"), (3, "crash", "failure"), (21, "no plan", "policy failed")];
    assert_eq!(again, expected.map(|(seed, earlier, last)| (seed, earlier.to_owned(), last)));
    let text = report.write(ReportFormat::Markdown, &ReportPictures::default()).unwrap();
    assert!(text.contains("Played again"), "{text}");
}

#[test]
fn what_failed_itself_is_told_apart_and_in_no_rate() {
    let handover = tasks::find("handover").unwrap();
    let failed = |policy: &str, seed: u32, ended: EndReason, why: &str| {
        let mut played = played(policy, &handover, seed, 1);
        played.result.ended = ended;
        played.note = Some(why.into());
        played
    };
    let crash = "B: the program ended at control step 25, before its episode did (exit status: 1)";
    let mut episodes = nine_six_three("one");
    episodes.extend(nine_six_three("other"));
    episodes.extend([
        failed("one", 20, EndReason::PolicyFailed, crash),
        failed("one", 21, EndReason::PolicyFailed, crash),
        failed("one", 22, EndReason::SimulatorFailed, "a velocity is not finite"),
        // This episode was played again elsewhere.
        failed("one", 3, EndReason::PolicyFailed, crash),
        failed("other", 20, EndReason::Finished, "it is too hard"),
        PlayedEpisode { keep_failed: true, ..failed("other", 21, EndReason::PolicyFailed, crash) },
    ]);
    let folder = tempfile::tempdir().unwrap();
    let strip = folder.path().join("strip.png");
    image::RgbImage::new(812, 40).save(&strip).unwrap();
    let mut found = found(episodes);
    found.episodes.iter_mut().for_each(|found| found.strip = Some(strip.clone()));
    let report = EvaluationReport::of(&found);
    let [one, other] = &report.policies[..] else { panic!("{:?}", report.policies) };
    assert_eq!((one.episodes, other.episodes), (10, 12));
    assert_eq!(one.tasks[0].phases[0].cumulative.map(Rate::fraction).as_deref(), Some("9/10"));
    let listed: Vec<_> = one.excluded.iter().map(|e| (e.what.name(), &*e.why, &*e.seeds)).collect();
    let simulator = ("simulator failed", "a velocity is not finite", &[22][..]);
    assert_eq!(listed, [("policy failed", crash, &[20, 21][..]), simulator]);
    assert!(other.excluded.is_empty() && other.reasons.iter().any(|reason| reason.why == crash));
    assert_eq!(report.comparisons[0].rows[0].pairs.total(), 10);
    let shown: Vec<_> =
        gallery(&found, 99).into_iter().map(|failure| (failure.policy, failure.seed)).collect();
    assert_eq!(shown.len(), 7 + 9, "{shown:?}");
    assert!(shown.iter().all(|(policy, seed)| *seed < 20 || policy == "other"), "{shown:?}");

    for format in ReportFormat::ALL {
        let text = report.write(format, &ReportPictures::default()).unwrap();
        match format {
            ReportFormat::Csv => assert!(text.contains("cumulative,9,10,0.9,"), "{text}"),
            ReportFormat::EpisodesCsv => assert!(text.contains(crash), "{text}"),
            ReportFormat::Svg => assert!(text.contains(">9/10</text>"), "{text}"),
            ReportFormat::TimesSvg => assert!(text.contains("p1 grasp_and_lift: 9 of 10, half"), "{text}"),
            ReportFormat::Html | ReportFormat::Markdown | ReportFormat::Json | ReportFormat::Tex => {
                let kept = text.replace("\\_", "_");
                assert!(
                    kept.contains(crash) && kept.to_lowercase().contains("simulator"),
                    "{format:?}: {text}"
                );
                assert!(kept.contains("Not counted") || kept.contains("\"simulator_failed\""), "{format:?}");
            }
        }
    }
}

#[test]
fn results_of_earlier_versions_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut old = serde_json::json!(played("agent", &tasks::find("handover").unwrap(), 4, 1));
    assert_eq!(
        old.as_object_mut().unwrap().remove("keep_failed"),
        None,
        "it is written only where it is set"
    );
    // In these files, the information for policies is described only by disclosure and hints, or not at all.
    let spec = old["spec"].as_object_mut().unwrap();
    assert!(spec.remove("assistance").is_some() && spec.remove("hints").is_some());
    spec.insert("disclosure".into(), "end".into());
    assert!(old.as_object_mut().unwrap().remove("assistance").is_some());
    old["note"] = "the program ended without a call, before its episode did (exit status: 127)".into();
    std::fs::create_dir_all(folder.path().join("episodes")).unwrap();
    std::fs::write(folder.path().join("episodes/handover-4.json"), old.to_string()).unwrap();
    let loaded = load(&[folder.path().into()]).unwrap();
    let report = EvaluationReport::of(&loaded);
    assert_eq!(
        (loaded.skipped.len(), report.policies[0].episodes, report.policies[0].excluded.len()),
        (0, 1, 0)
    );
    assert_eq!(report.policies[0].name, "agent + assistance: full + phases told: end");
}

#[test]
fn failures_are_shown_by_turns() {
    let folder = tempfile::tempdir().unwrap();
    let strip = folder.path().join("strip.png");
    image::RgbImage::new(812, 40).save(&strip).unwrap();
    let mut loaded = found(nine_six_three("agent"));
    let other = tasks::find("pouring").unwrap();
    loaded.episodes.push(FoundEpisode {
        played: played("agent", &other, 1, 0),
        strip: None,
        recording: None,
        page: None,
        run: String::new(),
    });
    loaded.episodes.iter_mut().for_each(|found| found.strip = Some(strip.clone()));
    let shown = gallery(&loaded, 2);
    let seeds: Vec<_> = shown.iter().map(|failure| (&*failure.task, failure.seed, &*failure.phase)).collect();
    assert_eq!(seeds, [("handover", 3, "p3"), ("pouring", 1, "p1")]);
    let file = &shown[0].moments[0].views[0].file;
    let decoder = webp_animation::Decoder::new(file).unwrap();
    assert_eq!(decoder.dimensions(), (406, 20));
    let none = ReportPictures { pictured_failures: pictured_failures(&loaded), ..ReportPictures::default() };
    let page = EvaluationReport::of(&loaded).write(ReportFormat::Html, &none).unwrap();
    assert!(page.contains("8 episodes failed, none of them shown"), "{page}");
    let pictures = ReportPictures { failures: shown, ..none };
    let page = EvaluationReport::of(&loaded).write(ReportFormat::Html, &pictures).unwrap();
    assert!(
        page.contains("2 of 8 episodes that failed") && page.contains("data:image/webp;base64,"),
        "{page}"
    );
}

/// The name of a server is a single word; its address is reported separately.
#[test]
fn addresses_are_a_detail() {
    let check = |names: &[&str], titles: &[&str], addresses: &[Option<&str>]| {
        let report =
            EvaluationReport::of(&found(names.iter().flat_map(|name| nine_six_three(name)).collect()));
        let named: Vec<&str> = report.policies.iter().map(|policy| policy.name.as_str()).collect();
        let at: Vec<Option<&str>> = report.policies.iter().map(|policy| policy.address.as_deref()).collect();
        assert_eq!((&*named, &*at), (titles, addresses));
        report.write(ReportFormat::Html, &ReportPictures::default()).unwrap()
    };
    let page = check(&["openpi:ws://[::1]:8000"], &["openpi"], &[Some("ws://[::1]:8000")]);
    assert!(page.contains("<h1>openpi</h1>") && page.contains("<title>Tandem: openpi</title>"), "{page}");
    assert!(page.contains("at <code>ws://[::1]:8000</code>"), "{page}");
    check(
        &["act:http://a:1", "act:http://b:2"],
        &["act (http://a:1)", "act (http://b:2)"],
        &[Some("http://a:1"), Some("http://b:2")],
    );
    let program = "exec:python agent.py --url http://a";
    check(&[program, "expert"], &[program, "expert"], &[None, None]);
}
