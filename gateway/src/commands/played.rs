//! Episodes over seeds, in parallel worlds: a bar while they are played, a table afterwards.

use std::{error::Error, path::Path};

use indicatif::{ProgressBar, ProgressStyle};
use tandem_episodes::evaluation::{self, Evaluation, Plan, TaskSummary, clopper_pearson};

/// Notes on failures below the table.
const NOTES_SHOWN: usize = 20;

/// Plays `plan` into `folder`, with a progress bar, and prints a table.
pub fn play_and_print(plan: &Plan, folder: &Path) -> Result<(), Box<dyn Error>> {
    let bar = ProgressBar::new((plan.tasks.len() * plan.seeds.len()) as u64);
    bar.set_style(ProgressStyle::with_template("  [{bar:30}] {pos} of {len} episodes, {elapsed}, {msg}")?);
    let evaluation = evaluation::evaluate(plan, folder, &|played| {
        bar.set_message(format!("{} seed {}", played.result.task, played.result.seed));
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    print_table(&evaluation);
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
    println!("  results in {}", folder.display());
    Ok(())
}

fn print_table(evaluation: &Evaluation) {
    println!(
        "{:14} {:>8}  {:^22} {:^22} {:^22} {:>5} {:>6}",
        "task", "episodes", "p1", "p2", "p3", "falls", "steps"
    );
    for (id, task) in &evaluation.tasks {
        let [p1, p2, p3] = [task.p1, task.p2, task.p3].map(|count| rate(count, task));
        println!(
            "{id:14} {:>8}  {p1:^22} {p2:^22} {p3:^22} {:>5} {:>6.0}",
            task.episodes, task.falls, task.mean_env_steps
        );
    }
    println!("rates in %, with exact 95 % intervals (Clopper-Pearson)");
}

fn rate(count: usize, task: &TaskSummary) -> String {
    let [low, high] = clopper_pearson(count, task.episodes);
    let percent = 100.0 * count as f64 / task.episodes as f64;
    format!("{percent:.0} [{:.0}, {:.0}]", 100.0 * low, 100.0 * high)
}
