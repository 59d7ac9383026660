//! `tandem evaluate`: the success rates of a policy over tasks and seeds.

mod costs;
mod progress;
mod table;

use std::{
    collections::BTreeSet,
    error::Error,
    path::{Path, PathBuf},
    process::ExitCode,
    str::FromStr,
};

use tandem_episodes::{
    Phase,
    stress::{Stress, StressAxis},
    tasks::Task,
};
use tandem_evaluation::evaluation::{
    EvaluationPlan, EvaluationRun, KeptEpisodes, Shard, Starts, failed_episodes, training_seeds,
};
use tandem_evaluation::results::STRESS;

use tandem_tools_spec::Assistance;

use super::{
    CommandResult, command_to_go_on,
    flags::{EpisodeFlags, PolicyFlags, RunFlags, StressPlanFlags},
    logging::log_evaluation,
};
use crate::{drivers::with_last_words, settings::SettingsError};
use costs::{SpendingLimit, expected};
use progress::with_progress;

/// Play tasks over seeds in parallel worlds and count the phases reached. An interrupted run is continued.
#[derive(Debug, clap::Args)]
pub struct EvaluateArgs {
    #[command(flatten)]
    policy: PolicyFlags,
    #[command(flatten)]
    episodes: EpisodeFlags,
    #[command(flatten)]
    stress: StressPlanFlags,
    /// Folder of another evaluation whose failures are replayed from shortly before each failure, with the
    /// whole budget. This build must have recorded them; tasks, seeds, world and stress are taken over.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["from", "demos", "tasks", "seeds", "spread", "scene", "task_file", "stress"])]
    retry_from: Option<PathBuf>,
    /// Seconds before the failure at which --retry-from begins.
    #[arg(long, value_name = "SECONDS", default_value_t = 3, requires = "retry_from")]
    before: u32,
    /// Phases to begin with, by number or id, for example p2 or p1,transfer, or `all`. Each episode starts
    /// where that phase began in the demonstration of its task and seed, with the whole budget; only that
    /// phase counts.
    #[arg(long, value_name = "PHASES", value_parser = parse_phases, requires = "demos")]
    from: Option<PhaseList>,
    /// Folder of demonstrations from `collect` or `serve`, recorded by this build.
    #[arg(long, value_name = "DIR", requires = "from")]
    demos: Option<PathBuf>,
    /// Begin in the training demonstrations instead of those of --seeds: the first 50 of each task by seed,
    /// the same split as in the benchmark and in `export`.
    #[arg(long, requires = "from", conflicts_with = "seeds")]
    training_demos: bool,
    /// Play share I of N, counted from 0, for example 0/10; shares may use one folder, and `report` joins
    /// folders.
    #[arg(long, value_name = "I/N", default_value = "0/1")]
    shard: ShardFlag,
    /// Record every episode in its own folder, for `replay` and for the images in reports.
    #[arg(long)]
    record: bool,
    /// Number of retries of an episode in which the policy itself failed (its program or server crashed or
    /// was gone), by consecutive runs, before it counts as a failure. Until then it is listed separately.
    /// Results keep every attempt.
    #[arg(long, value_name = "N", default_value_t = EvaluationPlan::DEFAULT_RETRIES)]
    retries: u32,
    /// The same as --retries 0.
    #[arg(long, conflicts_with = "retries")]
    keep_failed: bool,
    /// Maximum cost of the run in US dollars, by the prices of its language models: no further episode begins
    /// that may pass it if it costs as much as the dearest one. Kept episodes count [default: unlimited].
    #[arg(long, value_name = "USD")]
    max_usd: Option<f64>,
    /// Play nothing and print what a language model's run would cost, by the tokens of the episodes in this
    /// folder of `agent` or `evaluate`.
    #[arg(long, value_name = "DIR")]
    dry_run: Option<PathBuf>,
    #[command(flatten)]
    run: RunFlags,
}

/// Phases given on the command line.
#[derive(Debug, Clone)]
struct PhaseList(Vec<String>);

/// Parses phases: `all`, or numbers and ids separated by commas.
fn parse_phases(text: &str) -> Result<PhaseList, String> {
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
    match names.iter().any(String::is_empty) {
        true => Err("no phase; give p1, the id of a phase, or all".into()),
        false => Ok(PhaseList(names)),
    }
}

/// Resolves the named phases. Each has to occur in at least one of the tasks that are played.
fn phases_of(PhaseList(names): PhaseList, tasks: &[Task]) -> Result<Vec<String>, String> {
    let most = tasks.iter().map(|task| task.phases.len()).max().unwrap_or_default();
    let numbers: Vec<String> = (0..most).map(Phase::number).collect();
    if names == ["all"] {
        return Ok(numbers);
    }
    let ids: BTreeSet<&str> =
        tasks.iter().flat_map(|task| task.phases.iter()).map(|phase| phase.id.as_str()).collect();
    match names.iter().find(|name| !numbers.contains(name) && !ids.contains(name.as_str())) {
        None => Ok(names),
        Some(unknown) => {
            let have: Vec<&str> = numbers.iter().map(String::as_str).chain(ids).collect();
            Err(format!("no phase {unknown:?} in what is played; have: {}, or all", have.join(", ")))
        }
    }
}

/// A share given on the command line.
#[derive(Debug, Clone, Copy)]
struct ShardFlag(Shard);

impl FromStr for ShardFlag {
    type Err = String;

    fn from_str(text: &str) -> Result<ShardFlag, String> {
        let parts =
            text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((index, of)) if index < of => Ok(ShardFlag(Shard { index, of })),
            _ => Err("no share; give I/N with I from 0 to N - 1, for example 0/10".into()),
        }
    }
}

/// Plays the episodes and counts the results. The program fails if there are episodes to play, but none that
/// counts.
pub fn run(args: EvaluateArgs) -> CommandResult {
    log_evaluation();
    let ShardFlag(shard) = args.shard;
    let prices = args.policy.prices();
    if args.max_usd.is_some() && prices.as_ref().is_some_and(|prices| !prices.are_given()) {
        return Err(
            "--max-usd needs prices: give usd-per-million-input and usd-per-million-output with the model"
                .into(),
        );
    }
    let policy = SpendingLimit::new(args.policy.policy()?, args.max_usd);
    let plan = args.episodes.plan(&policy, args.record, Assistance::Paper)?;
    let starts = match (&args.retry_from, args.demos, args.from) {
        (Some(folder), ..) => begin_again(folder, args.before)?,
        (None, Some(demonstrations), Some(phases)) => {
            let phases = phases_of(phases, &plan.tasks)?;
            Starts::Phases { demonstrations, phases, training: args.training_demos }
        }
        _ => Starts::Task,
    };
    let seeds = seeds(&plan, &starts)?;
    let plan = EvaluationPlan {
        seeds,
        starts,
        shard,
        retries: if args.keep_failed { 0 } else { args.retries },
        existing: args.run.existing(),
        ..plan
    };
    check_words(&plan, args.stress.stresses())?;
    if let Some(recorded) = args.dry_run {
        let episodes = plan.episodes().0.len() * (1 + args.stress.stresses().len());
        println!("{}", expected(episodes, &recorded, &prices.unwrap_or_default())?);
        return Ok(ExitCode::SUCCESS);
    }
    let folder = args.run.folder(&plan, None);
    let play = |plan: &EvaluationPlan, folder: &Path| {
        if policy.is_limited() {
            policy.add_kept(&EvaluationRun::begin(plan, folder)?.so_far());
        }
        play_and_print(plan, folder)
    };
    let mut counted = play(&plan, &folder)?;
    for stress in args.stress.stresses() {
        println!("\nunder stress: {stress}");
        let plan = EvaluationPlan { stress: Some(stress), ..plan.clone() };
        counted += play(&plan, &folder.join(STRESS).join(stress.to_string()))?;
    }
    Ok(match counted {
        0 if !plan.episodes().0.is_empty() => ExitCode::FAILURE,
        _ => ExitCode::SUCCESS,
    })
}

/// Returns the seeds that are played: the seeds of the plan, or those of the training demonstrations.
fn seeds(plan: &EvaluationPlan, starts: &Starts) -> Result<Vec<u32>, String> {
    let Starts::Phases { demonstrations, training: true, .. } = starts else { return Ok(plan.seeds.clone()) };
    let mut seeds = BTreeSet::new();
    for task in &plan.tasks {
        let of_task = training_seeds(demonstrations, task);
        tracing::info!("phases of {} begin in {} demonstrations", task.id, of_task.len());
        seeds.extend(of_task);
    }
    match seeds.is_empty() {
        true => Err(format!("{} has no demonstration of what is played", demonstrations.display())),
        false => Ok(seeds.into_iter().collect()),
    }
}

/// Refuses a plan that combines two different rewordings of tasks.
pub fn check_words(
    plan: &EvaluationPlan,
    stresses: impl IntoIterator<Item = Stress>,
) -> Result<(), SettingsError> {
    let is_other_words = |stress: Stress| stress.axis == StressAxis::Words;
    match !plan.instructions.is_empty() && stresses.into_iter().any(is_other_words) {
        true => Err(SettingsError::TwoWordings),
        false => Ok(()),
    }
}

/// Returns starts that replay the failures in `folder`, each from `before_s` seconds before its failure.
/// Failures that cannot be replayed are logged.
fn begin_again(folder: &Path, before_s: u32) -> Result<Starts, Box<dyn Error>> {
    let (failed, left_out) = failed_episodes(folder)?;
    left_out.iter().for_each(|line| tracing::warn!("not begun again: {line}"));
    if failed.is_empty() {
        let folder = folder.display();
        return Err(
            format!("{folder} has no failure that was recorded; evaluate with --record writes such").into()
        );
    }
    Ok(Starts::Moments { failed, before_s })
}

/// Plays `plan` into `folder`, reports progress and prints a table. Returns the number of episodes that
/// count.
pub fn play_and_print(plan: &EvaluationPlan, folder: &Path) -> Result<usize, Box<dyn Error>> {
    let run = EvaluationRun::begin(plan, folder)?;
    println!("{}, in {}", in_words(run.kept()), folder.display());
    if run.is_without_locks() {
        let folder = folder.display();
        tracing::warn!(
            "the file system of {folder} has no locks: see to it that no other process plays in that folder"
        );
    }
    let say = || print_interrupted(&run);
    let evaluation = with_last_words(say, || with_progress(plan, |progress| run.play(progress)))?;
    table::print(&evaluation);
    println!("  results in {}", folder.display());
    Ok(evaluation.episodes.iter().filter(|episode| episode.counts()).count())
}

/// Describes the state of a run at its start, for example `5 kept, 25 to play`.
fn in_words(kept: KeptEpisodes) -> String {
    let KeptEpisodes { kept, of_other_builds, to_play, unreadable } = kept;
    let mut words = match (kept, of_other_builds) {
        (0, _) => format!("{to_play} to play"),
        (_, 0) => format!("{kept} kept, {to_play} to play"),
        (_, _) => format!("{kept} kept ({of_other_builds} of them of another build), {to_play} to play"),
    };
    if unreadable > 0 {
        words += &format!(" ({unreadable} of them again, since this build cannot read their results)");
    }
    words
}

/// Prints the results so far and the command to continue, for a run that a signal ends.
fn print_interrupted(run: &EvaluationRun) {
    let KeptEpisodes { kept, to_play, .. } = run.kept();
    println!("\ninterrupted; {kept} episodes are kept, {to_play} are left");
    if kept > 0 {
        table::print(&run.so_far());
    }
    println!("to go on: {}", command_to_go_on());
}

#[cfg(test)]
mod tests {
    use tandem_episodes::{tandem_plus, tasks};

    use super::*;

    #[test]
    fn phases_are_those_of_the_tasks_that_are_played() {
        let found = |text: &str, tasks: &[Task]| parse_phases(text).and_then(|list| phases_of(list, tasks));
        let handover = [tasks::find("handover").unwrap()];
        assert_eq!(found("p2, transfer", &handover).unwrap(), ["p2", "transfer"]);
        assert_eq!(found("all", &handover).unwrap(), ["p1", "p2", "p3"]);
        let own = &tandem_plus()[0].phases[0].id;
        assert_eq!(found(own, tandem_plus()).unwrap(), [own.as_str()]);
        let refused = found("p9", &handover).unwrap_err();
        assert!(refused.contains("no phase \"p9\"") && refused.contains("p3, grasp_and_lift"), "{refused}");
        assert!(found("", &handover).is_err());
    }
}
