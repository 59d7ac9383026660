//! Rows, costs and texts of a leaderboard.

use std::path::Path;

use tandem_episodes::tasks;
use tandem_tools_spec::{Assistance, EndReason, Protocol, Usage};

use super::*;
use crate::reports::evaluation::tests::{found, nine_six_three, played};
use crate::results::PlayedEpisode;

fn board(episodes: Vec<PlayedEpisode>) -> Leaderboard {
    Leaderboard::of(&found(episodes), Path::new("."))
}

/// Returns the rows of played policies, without the published ones.
fn own(rows: &[BoardRow]) -> Vec<&BoardRow> {
    rows.iter().filter(|row| row.assistance.is_some()).collect()
}

#[test]
fn what_was_played_by_other_rules_is_another_row() {
    let mut episodes = nine_six_three("agent");
    let mut told = nine_six_three("agent");
    told.iter_mut().for_each(|played| played.spec = played.spec.clone().assisted(Assistance::Full));
    let mut agentic = nine_six_three("agent");
    agentic.truncate(3);
    agentic.iter_mut().for_each(|played| played.spec.protocol = Protocol::Agentic);
    let mut rebuilt = vec![played("agent", &tasks::find("handover").unwrap(), 50, 1)];
    rebuilt[0].build = "0.1.0+other".into();
    episodes.extend([told, agentic, rebuilt].concat());
    let board = board(episodes);
    let rows: Vec<_> = own(&board.policies)
        .into_iter()
        .map(|row| {
            let success = row.success.unwrap();
            (row.protocol.unwrap().name(), row.assistance.unwrap().name(), success.successes, row.episodes)
        })
        .collect();
    let expected = [
        ("agentic", "paper", 3, 3),
        ("benchmark", "full", 3, 10),
        ("benchmark", "paper", 3, 10),
        ("benchmark", "paper", 0, 1),
    ];
    assert_eq!(rows, expected);
    // Of 30 phases, 3 * 3 + 3 * 2 + 3 were reached.
    let phases = own(&board.policies)[1].phases;
    assert_eq!((phases.successes, phases.trials), (18, 30));
}

/// A task of a suite contributes to its policy's row. In the table by task, it has a row.
#[test]
fn tasks_of_one_policy_are_one_row_and_a_row_each() {
    let mut episodes = nine_six_three("agent");
    episodes.push(played("agent", &tandem_episodes::tandem_plus()[0], 3, 1));
    let board = board(episodes);
    let [policy] = own(&board.policies)[..] else { panic!("{:?}", board.policies) };
    assert_eq!((policy.tasks.len(), policy.episodes), (2, 11));
    let tasks: Vec<_> = own(&board.tasks).iter().map(|row| (row.tasks.join(","), row.episodes)).collect();
    assert_eq!(tasks, [("handover".into(), 10), (tandem_episodes::tandem_plus()[0].id.clone(), 1)]);
    let published = board.tasks.iter().filter(|row| row.assistance.is_none());
    assert!(published.clone().count() > 5 && published.clone().all(|row| row.tasks == ["handover"]));
}

#[test]
fn published_rows_are_counts_with_their_source() {
    let board = board(nine_six_three("agent"));
    let find = |method: &str| board.policies.iter().find(|row| row.policy == method).unwrap();
    let agent = find("GPT-6 Astra");
    let success = agent.success.unwrap();
    assert_eq!((agent.protocol, success.successes, success.trials), (Some(Protocol::Agentic), 8, 80));
    assert_eq!((agent.source.as_str(), agent.not_counted), ("CoHuB's paper", None));
    let act = find("ACT");
    assert_eq!((act.protocol, act.tasks.len(), act.episodes), (Some(Protocol::Benchmark), 10, 1000));
    let text = tables::markdown(&board);
    let line = text.lines().find(|line| line.starts_with("| GPT-6 Astra |")).unwrap();
    assert!(line.ends_with("| 10 [4.4, 18.8] |  |  |  |  |  |  |"), "{line}");
}

#[test]
fn costs_are_medians_and_unknown_ones_empty() {
    let mut episodes = nine_six_three("agent");
    for (played, tokens) in episodes.iter_mut().zip([10_000, 30_000, 20_000]) {
        played.result.usage = Some(Usage {
            notes: 3,
            input_tokens: tokens,
            output_tokens: 500,
            cached_tokens: 0,
            usd: Some(0.06),
            model_s: None,
            models: vec!["a-model".into()],
            ..Usage::default()
        });
        played.ended_at = Some("2026-11-28T01:20:00Z".into());
    }
    episodes[1].ended_at = Some("2026-11-29T23:00:00Z".into());
    let mut failed = played("agent", &tasks::find("handover").unwrap(), 20, 1);
    failed.result.ended = EndReason::PolicyFailed;
    episodes.push(failed.clone());
    // This episode was played again, so it is not listed.
    failed.spec.seed = 3;
    episodes.push(failed);
    episodes.push(played("silent", &tasks::find("handover").unwrap(), 0, 0));
    let board = board(episodes);
    let text = tables::markdown(&board);
    let spent = "| agent | 0.1.0+test | benchmark | paper |  | 2026-11-28 to 2026-11-29 | 1 | 10 | 1 | \
                 18/30 | 30 [6.7, 65.2] | 60 |  | 4.5 | 20.0 | 0.5 | 0.060 |";
    let silent = "| silent | 0.1.0+test | benchmark | paper |  |  | 1 | 1 | 0 | 0/3 | 0 [0, 97.5] | \
                   60 |  | 0.0 |  |  |  |";
    for line in [spent, silent] {
        assert!(text.contains(line), "no {line}: {text}");
    }
    assert!(board.transcripts.is_empty(), "nothing was recorded");
    let json = &board.files().unwrap()[2].1;
    assert!(json.contains("\"median_value\": 20000.0"), "{json}");
    let page = tables::html(&board);
    assert!(page.contains("<h2>By task</h2>") && !page.contains("<script"), "{page}");
}
