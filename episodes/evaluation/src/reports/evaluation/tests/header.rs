//! Tests of headers and of the rows of single episodes.

use super::*;
use crate::results::ProcessRecord;

#[test]
fn a_header_names_commands_machines_and_settings() {
    let folder = tempfile::tempdir().unwrap();
    let mut episodes = nine_six_three("agent");
    episodes[0].ended_at = Some("2026-11-28T01:20:00Z".into());
    write(folder.path(), &episodes);
    let process = ProcessRecord {
        command: "tandem evaluate --policy 'exec:a | b'".into(),
        begun_at: "2026-11-28T01:00:00Z".into(),
        ..ProcessRecord::here("0.1.0+test")
    };
    process.append(folder.path()).unwrap();
    let loaded = load(&[folder.path().into()]).unwrap();
    let mut report = EvaluationReport::of(&loaded);
    assert_eq!(report.header.processes.len(), 1);
    let origin = ReportOrigin {
        command: "tandem report runs".into(),
        build: "0.1.0+now".into(),
        written_at: "2026-11-29T01:00:00Z".into(),
    };
    report.header.made = Some(origin);
    let write = |format| report.write(format, &ReportPictures::default()).unwrap();
    let settings = "| agent | handover | 0-9 | benchmark | paper | balance | auto | ideal | estimator | ideal | \
                    0.1.0+test | 2026-11-28 | 10 |";
    let text = write(ReportFormat::Markdown);
    for part in [
        settings,
        "| tandem evaluate --policy 'exec:a \\| b' | 2026-11-28T01:00:00Z |",
        "Made by `tandem report runs` at 2026-11-29T01:00:00Z, build `0.1.0+now`.",
    ] {
        assert!(text.contains(part), "no {part}: {text}");
    }
    assert!(write(ReportFormat::Html).contains("Made by <code>tandem report runs</code> at"));
    assert!(write(ReportFormat::Tex).contains("% Made by `tandem report runs` at"));
    let json: serde_json::Value = serde_json::from_str(&write(ReportFormat::Json)).unwrap();
    assert_eq!(json["header"]["settings"][0]["seeds"], "0-9");
    assert_eq!(json["header"]["processes"][0]["machine"]["os"], process.machine.os);
}

/// Episodes that do not count also have rows, and every row has all columns.
#[test]
fn every_episode_is_a_row() {
    let mut episodes = nine_six_three("a, \"b\"");
    let handover = tasks::find("handover").unwrap();
    let mut failed = played("a, \"b\"", &handover, 20, 1);
    (failed.result.ended, failed.note) = (EndReason::PolicyFailed, Some("two\nlines".into()));
    let mut begun = played("a, \"b\"", &handover, 0, 2);
    begun.spec.start = Start::Phase(PhaseStart { recording: "demonstration".into(), phase: "p2".into() });
    episodes.extend([failed, begun]);
    let report = EvaluationReport::of(&found(episodes));
    let text = report.write(ReportFormat::EpisodesCsv, &ReportPictures::default()).unwrap();
    let head = "policy,task,seed,protocol,assistance,start,counted,success,p1_s,p2_s,p3_s,ended,steps,\
                requests,thinking_s,falls,input_tokens,output_tokens,usd,model_s,earlier_attempts,\
                controller,build,state_hash,ended_at,note";
    assert_eq!(text.lines().next(), Some(head));
    let seventh = "\"a, \"\"b\"\"\",handover,6,benchmark,paper,task,true,false,4,,,finished,506,60,6,0,\
                   ,,,,0,balance,0.1.0+test,0000000000000006,,\n";
    assert!(text.contains(seventh), "{text}");
    assert!(text.contains(",handover,20,benchmark,paper,task,false,false,4,,,policy_failed,"), "{text}");
    assert!(text.contains(",\"two\nlines\"\n") && text.contains(",paper,p2,true,true,4,8,,"), "{text}");
    assert_eq!((report.episodes.len(), text.lines().count()), (12, 12 + 2));
}

#[test]
fn what_is_not_listed_is_counted() {
    let mut loaded = found(nine_six_three("agent"));
    loaded.episodes.iter_mut().for_each(|found| found.recording = Some("episode.mcap".into()));
    let report = EvaluationReport::of(&loaded);
    assert_eq!(report.recorded_failures, 7);
    let moment = FailureMoment {
        policy: "agent".into(),
        task: "handover".into(),
        seed: 9,
        phase: "p1".into(),
        what: "A fell".into(),
        time_s: 12.5,
        watch: "http://127.0.0.1:8700/watch".into(),
        page: None,
    };
    let report = EvaluationReport { failure_moments: vec![moment], ..report };
    let text = report.write(ReportFormat::Markdown, &ReportPictures::default()).unwrap();
    assert!(
        text.contains("Listed are 1 of 7 that were recorded; `report --failures 7` lists all."),
        "{text}"
    );
    assert!(text.contains("| A fell | - | [12.5]("), "{text}");
}
