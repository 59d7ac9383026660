//! Results of an evaluation as text: rates, reasons for failures, and episodes that do not count.

use std::collections::BTreeMap;

use tandem_episodes::printable;
use tandem_evaluation::results::{Exclusion, PhaseLevel, PlayedEpisode};
use tandem_evaluation::{
    evaluation::Evaluation,
    statistics::{Count, clopper_pearson},
};
use tandem_tools_spec::{AgentEnding, Usage};

/// Minimum share of clamped joint targets that causes a warning.
const CLAMPED_SHARE: f64 = 0.1;

/// Maximum number of notes of each kind below the table.
const NOTES_SHOWN: usize = 20;

/// Prints the tables, then notes.
pub fn print(evaluation: &Evaluation) {
    println!("{}, {} protocol", printable(&evaluation.full_name()), evaluation.protocol);
    print_tasks(evaluation);
    print_endings(evaluation);
    evaluation.phase_level.iter().for_each(print_phase_level);
    for (build, count) in &evaluation.other_builds {
        println!("{count} of these episodes were played by another build, {build}");
    }
    print_clamped(evaluation);
    let (counted, excluded): (Vec<&PlayedEpisode>, Vec<&PlayedEpisode>) =
        evaluation.episodes.iter().partition(|episode| episode.counts());
    print_notes(counted.into_iter().filter_map(|episode| Some((episode, episode.note.clone()?))));
    if !excluded.is_empty() {
        println!(
            "not counted, because the policy itself or the simulator failed; the next run plays them again, those of the policy as often as \
             --retries has it:"
        );
        print_notes(excluded.into_iter().map(|episode| (episode, exclusion_note(episode))));
    }
    let again = evaluation.episodes.iter().filter(|episode| !episode.attempts.is_empty());
    print_notes(again.map(|episode| (episode, attempts_note(episode))));
    evaluation.left_out.iter().for_each(|left_out| println!("  left out: {}", printable(left_out)));
}

/// Warns of tasks in which many joint targets were beyond the joints' limits.
fn print_clamped(evaluation: &Evaluation) {
    let mut shares: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for PlayedEpisode { result, .. } in &evaluation.episodes {
        shares.entry(&result.task).or_default().push(result.joints_clamped_share.unwrap_or_default());
    }
    for (task, shares) in shares {
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        if mean > CLAMPED_SHARE {
            println!(
                "warning: {:.0} % of the joint targets in {task} lay beyond the joints' limits and were moved there; they are radians, \
                 in the order of the action row",
                100.0 * mean
            );
        }
    }
}

/// Describes the failure that excludes an episode.
fn exclusion_note(episode: &PlayedEpisode) -> String {
    let what = episode.exclusion().map_or("", Exclusion::name);
    match (episode.exclusion(), &episode.note) {
        (Some(Exclusion::PolicyFailed), Some(note)) => format!("{what}: {note}"),
        (Some(Exclusion::SimulatorFailed) | None, Some(note)) => note.clone(),
        (_, None) => what.into(),
    }
}

/// Lists the earlier attempts at an episode with their outcomes.
fn attempts_note(episode: &PlayedEpisode) -> String {
    let earlier = episode.attempts.iter().map(|attempt| attempt.note.as_deref().unwrap_or("it failed"));
    let earlier: Vec<&str> = earlier.collect();
    format!("attempt {}; before it: {}", episode.attempts.len() + 1, earlier.join("; "))
}

fn print_notes<'a>(notes: impl Iterator<Item = (&'a PlayedEpisode, String)>) {
    let lines: Vec<String> = notes
        .map(|(episode, note)| format!("  {} seed {}: {note}", episode.result.task, episode.spec.seed))
        .collect();
    lines.iter().take(NOTES_SHOWN).for_each(|line| println!("{}", printable(line)));
    if lines.len() > NOTES_SHOWN {
        println!("  and {} more notes in results.json", lines.len() - NOTES_SHOWN);
    }
}

fn print_tasks(evaluation: &Evaluation) {
    if evaluation.tasks.is_empty() {
        return;
    }
    let excluded = evaluation.tasks.values().any(|task| task.policy_failed + task.simulator_failed > 0);
    let column = if excluded { "  not counted" } else { "" };
    println!(
        "{:14} {:>8}  {:^22} {:^22} {:^22} {:>5} {:>6}{column}",
        "task", "episodes", "p1", "p2", "p3", "falls", "steps"
    );
    for (id, task) in &evaluation.tasks {
        let of_task = |played: &&PlayedEpisode| played.result.task == *id;
        let played = evaluation.episodes.iter().find(of_task);
        let phases = played.map_or(0, |played| played.spec.task.phases.len());
        let [p1, p2, p3] =
            [(1, task.p1), (2, task.p2), (3, task.p3)].map(|(number, successes)| match number <= phases {
                true => rate(Count { successes, trials: task.episodes }),
                false => "-".into(),
            });
        let kinds = [
            (task.policy_failed, Exclusion::PolicyFailed),
            (task.simulator_failed, Exclusion::SimulatorFailed),
        ];
        let kinds = kinds.into_iter().filter(|(count, _)| *count > 0);
        let excluded: Vec<String> = kinds.map(|(count, what)| format!("{} {count}", what.name())).collect();
        let line = format!(
            "{id:14} {:>8}  {p1:^22} {p2:^22} {p3:^22} {:>5} {:>6.0}  {}",
            task.episodes,
            task.falls,
            task.mean_env_steps,
            excluded.join(", ")
        );
        println!("{}", line.trim_end());
    }
    println!("rates in %, with exact 95 % intervals (Clopper-Pearson)");
}

/// Prints how the play of language models ended, and the total cost.
fn print_endings(evaluation: &Evaluation) {
    let usages: Vec<&Usage> =
        evaluation.episodes.iter().filter_map(|played| played.result.usage.as_ref()).collect();
    let mut endings: BTreeMap<AgentEnding, usize> = BTreeMap::new();
    for ended in usages.iter().flat_map(|usage| &usage.endings) {
        *endings.entry(ended.ending).or_default() += 1;
    }
    if endings.is_empty() {
        return;
    }
    let counts: Vec<String> =
        endings.iter().map(|(ending, episodes)| format!("{} ({episodes})", ending.words())).collect();
    println!("models' play ended: {}", counts.join(", "));
    let tokens = |of: fn(&Usage) -> u64| usages.iter().map(|usage| of(usage)).sum::<u64>();
    let usd: Vec<f64> = usages.iter().filter_map(|usage| usage.usd).collect();
    let price = match usd.is_empty() {
        true => String::new(),
        false => format!(", {:.2} US dollars", usd.iter().sum::<f64>()),
    };
    println!(
        "all of it, counted or not: {} tokens read, {} written{price}",
        tokens(|usage| usage.input_tokens),
        tokens(|usage| usage.output_tokens)
    );
}

/// Prints how often each phase was reached when play started there, and how much lower the rate of
/// collaborative phases is.
fn print_phase_level(level: &PhaseLevel) {
    println!("{:14} {:>8}  {:>8}  {:^22}", "task", "from", "episodes", "reached");
    for phase in &level.phases {
        let reached = rate(Count { successes: phase.reached, trials: phase.episodes });
        let who = if phase.collaborative { "together" } else { "" };
        println!("{:14} {:>8}  {:>8}  {reached:^22} {who}", phase.task, phase.number, phase.episodes);
    }
    let percent = |share: Option<f64>| share.map_or("-".into(), |share| format!("{:.1}", 100.0 * share));
    for (robots, means) in level.means() {
        println!(
            "mean of phases in %, tasks of {robots} robots: alone {}, together {}, which is {} % lower",
            percent(means.non_collaborative_share),
            percent(means.collaborative_share),
            percent(means.drop_share)
        );
    }
}

fn rate(count: Count) -> String {
    let Some(share) = count.share() else { return "-".into() };
    let [low, high] = clopper_pearson(count).map(|share| 100.0 * share);
    format!("{:.0} [{low:.0}, {high:.0}]", 100.0 * share)
}
