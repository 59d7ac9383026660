//! Episodes over seeds, in parallel worlds: a bar while they are played, a table afterwards.

use std::{error::Error, path::Path};

use indicatif::{ProgressBar, ProgressStyle};
use tandem_episodes::evaluation::{self, Evaluation, PhaseLevel, Plan};
use tandem_episodes::statistics::{Count, clopper_pearson};

/// Notes on failures below the table.
const NOTES_SHOWN: usize = 20;

/// Plays `plan` into `folder`, with a progress bar, prints a table, and says how many episodes were played.
pub fn play_and_print(plan: &Plan, folder: &Path) -> Result<usize, Box<dyn Error>> {
    let bar = ProgressBar::new(plan.episodes().0.len() as u64);
    bar.set_style(ProgressStyle::with_template("  [{bar:30}] {pos} of {len} episodes, {elapsed}, {msg}")?);
    let evaluation = evaluation::evaluate(plan, folder, &|played| {
        bar.set_message(format!("{} seed {}", played.result.task, played.result.seed));
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    print_table(&evaluation);
    evaluation.phase_level.iter().for_each(print_phase_level);
    let notes: Vec<String> = evaluation
        .episodes
        .iter()
        .filter_map(|episode| Some((&episode.result, episode.note.as_deref()?)))
        .map(|(result, note)| format!("  {} seed {}: {note}", result.task, result.seed))
        .collect();
    notes.iter().take(NOTES_SHOWN).for_each(|note| println!("{note}"));
    if notes.len() > NOTES_SHOWN {
        println!("  and {} more notes in results.json", notes.len() - NOTES_SHOWN);
    }
    evaluation.left_out.iter().for_each(|left_out| println!("  left out: {left_out}"));
    println!("  results in {}", folder.display());
    Ok(evaluation.episodes.len())
}

fn print_table(evaluation: &Evaluation) {
    if evaluation.tasks.is_empty() {
        return;
    }
    println!(
        "{:14} {:>8}  {:^22} {:^22} {:^22} {:>5} {:>6}",
        "task", "episodes", "p1", "p2", "p3", "falls", "steps"
    );
    for (id, task) in &evaluation.tasks {
        let [p1, p2, p3] =
            [task.p1, task.p2, task.p3].map(|successes| rate(Count { successes, trials: task.episodes }));
        println!(
            "{id:14} {:>8}  {p1:^22} {p2:^22} {p3:^22} {:>5} {:>6.0}",
            task.episodes, task.falls, task.mean_env_steps
        );
    }
    println!("rates in %, with exact 95 % intervals (Clopper-Pearson)");
}

/// Every phase on its own, and what working together costs.
fn print_phase_level(level: &PhaseLevel) {
    println!("{:14} {:>8}  {:>8}  {:^22}", "task", "from", "episodes", "reached");
    for phase in &level.phases {
        let reached = rate(Count { successes: phase.reached, trials: phase.episodes });
        let who = if phase.collaborative { "together" } else { "" };
        println!("{:14} {:>8}  {:>8}  {reached:^22} {who}", phase.task, phase.phase, phase.episodes);
    }
    let percent = |share: Option<f64>| share.map_or("-".into(), |share| format!("{:.1}", 100.0 * share));
    println!(
        "mean of phases in %: alone {}, together {}, which is {} % lower",
        percent(level.non_collaborative_share),
        percent(level.collaborative_share),
        percent(level.drop_share)
    );
}

fn rate(count: Count) -> String {
    let [low, high] = clopper_pearson(count).map(|share| 100.0 * share);
    format!("{:.0} [{low:.0}, {high:.0}]", 100.0 * count.share().unwrap_or_default())
}
