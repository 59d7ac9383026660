//! `tandem evaluate`: how far a policy gets, over tasks and seeds.

mod progress;
mod table;

use std::{
    error::Error,
    path::{Path, PathBuf},
    process::ExitCode,
    str::FromStr,
};

use tandem_episodes::{
    Phase,
    evaluation::{self, EvaluationPlan, Shard, Starts, failed_episodes},
    results::STRESS,
    tasks,
};

use tandem_tools_spec::Assistance;

use super::{
    CommandResult,
    flags::{EpisodeFlags, PolicyFlags, StressPlanFlags},
    logging::log_evaluation,
};
use progress::with_progress;

/// Play tasks over seeds in parallel worlds and count the phases reached. Goes on where an interrupted run stopped.
#[derive(Debug, clap::Args)]
pub struct EvaluateArgs {
    #[command(flatten)]
    policy: PolicyFlags,
    #[command(flatten)]
    episodes: EpisodeFlags,
    #[command(flatten)]
    stress: StressPlanFlags,
    /// Play the failures of another evaluation again, from some seconds before the moment at which each went wrong, with the whole budget
    /// ahead: its folder, in which episodes were recorded by this build. Tasks, seeds, world and stress are theirs.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["from", "demos", "tasks", "seeds", "spread", "scene", "task_file", "stress"])]
    retry_from: Option<PathBuf>,
    /// How many seconds before.
    #[arg(long, value_name = "SECONDS", default_value_t = 3, requires = "retry_from")]
    before: u32,
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
    /// How often an episode in which the policy itself failed (its program or its server crashed or was gone) is played again, by one run
    /// after another, before it counts as a failure. Until then it is listed apart. Results keep every attempt.
    #[arg(long, value_name = "N", default_value_t = EvaluationPlan::DEFAULT_RETRIES)]
    retries: u32,
    /// The same as --retries 0.
    #[arg(long, conflicts_with = "retries")]
    keep_failed: bool,
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

/// Plays and counts. The program fails if there are episodes to play and none of them counts.
pub fn run(args: EvaluateArgs) -> CommandResult {
    log_evaluation();
    let starts = match (args.demos, args.from) {
        (Some(demonstrations), Some(PhaseList(phases))) => Starts::Phases { demonstrations, phases },
        _ => Starts::Task,
    };
    let starts = match &args.retry_from {
        Some(folder) => begin_again(folder, args.before)?,
        None => starts,
    };
    let ShardFlag(shard) = args.shard;
    let policy = args.policy.policy()?;
    let plan = EvaluationPlan {
        starts,
        shard,
        retries: if args.keep_failed { 0 } else { args.retries },
        ..args.episodes.plan(&*policy, args.record, Assistance::Paper)?
    };
    let mut counted = play_and_print(&plan, &args.out)?;
    for stress in args.stress.stresses() {
        println!("\nunder stress: {stress}");
        let plan = EvaluationPlan { stress: Some(stress), ..plan.clone() };
        counted += play_and_print(&plan, &args.out.join(STRESS).join(stress.to_string()))?;
    }
    Ok(match counted {
        0 if !plan.episodes().0.is_empty() => ExitCode::FAILURE,
        _ => ExitCode::SUCCESS,
    })
}

/// What has failed in `folder`, to begin again so many seconds before; what cannot be begun again is logged.
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

/// Plays `plan` into `folder`, says how it goes on, prints a table, and returns how many of the episodes count.
pub fn play_and_print(plan: &EvaluationPlan, folder: &Path) -> Result<usize, Box<dyn Error>> {
    let evaluation = with_progress(plan, |progress| evaluation::evaluate(plan, folder, progress))?;
    table::print(&evaluation);
    println!("  results in {}", folder.display());
    Ok(evaluation.episodes.iter().filter(|episode| episode.counts()).count())
}
