//! `tandem collect`: demonstrations of the experts, or of people.

mod people;

use std::process::ExitCode;

use tandem_episodes::{Variation, players};
use tandem_evaluation::evaluation::{EvaluationPlan, KeptFiles};
use tandem_tools_spec::Assistance;

use people::PeopleFlags;

use super::{
    CommandResult,
    evaluate::{check_words, play_and_print},
    flags::{EpisodeFlags, RunFlags, StressFlags},
    logging::log_evaluation,
};

/// Record demonstrations of the experts, or of people who drive in browsers, as MCAP files, one folder per
/// episode. An interrupted run is continued.
#[derive(Debug, clap::Args)]
pub struct CollectArgs {
    #[command(flatten)]
    episodes: EpisodeFlags,
    #[command(flatten)]
    people: PeopleFlags,
    #[command(flatten)]
    stress: StressFlags,
    /// Variation between demonstrations of a task in pace, pauses and paths, and in how often hands miss and
    /// try again: from 0 (none) to 3.
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "operators",
          value_parser = clap::value_parser!(u8).range(..=i64::from(Variation::MAX_VARIETY)))]
    variety: u8,
    /// Level of slow noise on commands before execution; 1 is 0.016 rad on the joints of arms, and 0.03 m/s
    /// and 0.06 rad/s on a walking base. The command without noise is recorded as the action.
    #[arg(long, value_name = "LEVEL", default_value_t = 0.0, value_parser = parse_level)]
    disturb: f32,
    /// Keep recordings only of demonstrations that reach the last phase; of the others only the result is
    /// kept.
    #[arg(long)]
    only_successful: bool,
    /// Write no image strip and no report page per episode, which take a quarter of the space.
    #[arg(long)]
    no_reports: bool,
    #[command(flatten)]
    run: RunFlags,
}

/// Parses the level of disturbance.
fn parse_level(text: &str) -> Result<f32, String> {
    let level = text.parse().ok().filter(|level| (0.0..=Variation::MAX_DISTURB).contains(level));
    level.ok_or_else(|| format!("no level; give 0 to {}, for example 1", Variation::MAX_DISTURB))
}

/// Plays and records the demonstrations.
pub fn run(args: CollectArgs) -> CommandResult {
    log_evaluation();
    let plan = args.episodes.plan(players::find("expert")?, true, Assistance::Full)?;
    let variation = Variation { variety: args.variety, disturb: args.disturb, ..plan.variation };
    let plan = EvaluationPlan {
        variation,
        stress: args.stress.stress(),
        existing: args.run.existing(),
        files: KeptFiles { pages: !args.no_reports, only_successful: args.only_successful },
        ..plan
    };
    check_words(&plan, plan.stress)?;
    match args.people.operators() {
        Some(_) => {
            let folder = args.run.folder(&plan, Some("people"));
            args.people.collect(plan, &folder)?;
        }
        None => drop(play_and_print(&plan, &args.run.folder(&plan, Some("demonstrations")))?),
    }
    Ok(ExitCode::SUCCESS)
}
