//! `tandem collect`: demonstrations of the experts, or of people.

mod people;

use std::process::ExitCode;

use tandem_episodes::{
    Variation,
    evaluation::{EvaluationPlan, KeptFiles},
    players,
};
use tandem_tools_spec::Assistance;

use people::PeopleFlags;

use super::{
    CommandResult,
    evaluate::{check_words, play_and_print},
    flags::{EpisodeFlags, RunFlags, StressFlags},
    logging::log_evaluation,
};

/// Record demonstrations of the experts, or of people who drive in browsers, as MCAP, one folder per episode. Goes on where an
/// interrupted run stopped.
#[derive(Debug, clap::Args)]
pub struct CollectArgs {
    #[command(flatten)]
    episodes: EpisodeFlags,
    #[command(flatten)]
    people: PeopleFlags,
    #[command(flatten)]
    stress: StressFlags,
    /// How much demonstrations of the same task differ in pace, pauses and ways, and how often hands miss and come back: 0 for
    /// not at all, to 3.
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "operators",
          value_parser = clap::value_parser!(u8).range(..=i64::from(Variation::MAX_VARIETY)))]
    variety: u8,
    /// How much slow noise is added to what robots are told before they do it; 1 is 0.016 rad on the joints of arms, and 0.03 m/s
    /// and 0.06 rad/s on a base that walks. What they were told is recorded as the action.
    #[arg(long, value_name = "LEVEL", default_value_t = 0.0, value_parser = parse_level)]
    disturb: f32,
    /// Keep only demonstrations that reach the last phase; of the others a result remains, and no recording.
    #[arg(long)]
    only_successful: bool,
    /// Write no strip of pictures and no page of each episode, which take a quarter of the space.
    #[arg(long)]
    no_reports: bool,
    #[command(flatten)]
    run: RunFlags,
}

/// Parses the level of disturbance.
fn parse_level(text: &str) -> Result<f32, String> {
    let level = text.parse().ok().filter(|level| (0.0..=Variation::MAX_DISTURB).contains(level));
    level.ok_or_else(|| format!("no level; give 0 to {}, as 1", Variation::MAX_DISTURB))
}

/// Plays and records.
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
