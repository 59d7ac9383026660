//! `tandem evaluate`: how far a policy gets, over tasks and seeds.

use std::{
    error::Error,
    path::{Path, PathBuf},
    process::ExitCode,
    str::FromStr,
};

use indicatif::{ProgressBar, ProgressStyle};
use tandem_episodes::{
    Phase,
    evaluation::{self, Evaluation, EvaluationPlan, Shard, Starts},
    results::PhaseLevel,
    statistics::{Count, clopper_pearson},
    tasks,
};

use super::{
    CommandResult,
    flags::{EpisodeFlags, PolicyFlags},
    logging::log_evaluation,
};

/// How many notes on failures are printed below the table.
const NOTES_SHOWN: usize = 20;

/// Play tasks over seeds in parallel worlds and count the phases reached. Goes on where an interrupted run stopped.
#[derive(Debug, clap::Args)]
pub struct EvaluateArgs {
    #[command(flatten)]
    policy: PolicyFlags,
    #[command(flatten)]
    episodes: EpisodeFlags,
    /// Phases to begin at, by number or id, as p2 or p1,transfer, or `all`: each episode starts where that phase began in the
    /// demonstration of its task and seed, with the whole budget ahead, and that phase alone counts.
    #[arg(long, value_name = "PHASES", value_parser = parse_phases, requires = "demos")]
    from: Option<PhaseList>,
    /// Folder of demonstrations, as `collect` or `serve` writes them; this build has to have recorded them.
    #[arg(long, value_name = "DIR", requires = "from")]
    demos: Option<PathBuf>,
    /// Play share I of N, counted from 0, as 0/10; shares may write to one folder, and `report` joins folders.
    #[arg(long, value_name = "I/N", default_value = "0/1")]
    shard: ShardFlag,
    /// Record every episode in a folder of its own, for `replay` and for the pictures of a report.
    #[arg(long)]
    record: bool,
    /// Folder for `results.json` and one file per episode.
    #[arg(long, value_name = "DIR", default_value = "runs/evaluation")]
    out: PathBuf,
}

/// Phases named on the command line.
#[derive(Debug, Clone)]
struct PhaseList(Vec<String>);

/// The phases that `text` names: `all`, or numbers and ids separated by commas.
fn parse_phases(text: &str) -> Result<PhaseList, String> {
    let most = tasks::ALL.iter().map(|task| task.phases.len()).max().unwrap_or_default();
    let numbers: Vec<String> = (0..most).map(Phase::number).collect();
    if text == "all" {
        return Ok(PhaseList(numbers));
    }
    let is_id = |text: &str| tasks::ALL.iter().flat_map(|task| task.phases).any(|phase| phase.id == text);
    let known = |phase: &str| match numbers.iter().any(|number| number == phase) || is_id(phase) {
        true => Ok(phase.to_owned()),
        false => Err(format!(
            "no phase {phase:?}; have: {}, the id of a phase, as `tandem tasks` lists them, or all",
            numbers.join(", ")
        )),
    };
    text.split(',').map(|phase| known(phase.trim())).collect::<Result<_, _>>().map(PhaseList)
}

/// A share on the command line.
#[derive(Debug, Clone, Copy)]
struct ShardFlag(Shard);

impl FromStr for ShardFlag {
    type Err = String;

    fn from_str(text: &str) -> Result<ShardFlag, String> {
        let parts =
            text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((index, of)) if index < of => Ok(ShardFlag(Shard { index, of })),
            _ => Err("no share; give I/N with I from 0 to N - 1, as 0/10".into()),
        }
    }
}

/// Plays and counts. The program fails if there are episodes to play and none could begin.
pub fn run(args: EvaluateArgs) -> CommandResult {
    log_evaluation();
    let starts = match (args.demos, args.from) {
        (Some(demonstrations), Some(PhaseList(phases))) => Starts::Phases { demonstrations, phases },
        _ => Starts::Task,
    };
    let ShardFlag(shard) = args.shard;
    let policy = args.policy.policy()?;
    let plan = EvaluationPlan { starts, shard, ..args.episodes.plan(&*policy, args.record)? };
    Ok(match play_and_print(&plan, &args.out)? {
        0 if !plan.episodes().0.is_empty() => ExitCode::FAILURE,
        _ => ExitCode::SUCCESS,
    })
}

/// Plays `plan` into `folder` with a progress bar, prints a table, and returns how many episodes were played.
pub fn play_and_print(plan: &EvaluationPlan, folder: &Path) -> Result<usize, Box<dyn Error>> {
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

/// Prints how often each phase was reached from its own start, and how much lower the rate of collaborative phases is.
fn print_phase_level(level: &PhaseLevel) {
    println!("{:14} {:>8}  {:>8}  {:^22}", "task", "from", "episodes", "reached");
    for phase in &level.phases {
        let reached = rate(Count { successes: phase.reached, trials: phase.episodes });
        let who = if phase.collaborative { "together" } else { "" };
        println!("{:14} {:>8}  {:>8}  {reached:^22} {who}", phase.task, phase.number, phase.episodes);
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
