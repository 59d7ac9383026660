//! `tandem locomotion`: measurements of the base controller alone.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::Subcommand;
use tandem_bench::CaseReport;
use tandem_episodes::{DEFAULT_ROBOT, ROBOTS, RobotFile};

use crate::settings::read_robot;

use super::{
    CommandResult, Seeds,
    flags::{LocomotionFlag, SensingFlags},
};

/// Measure the base controller.
#[derive(Debug, clap::Args)]
pub struct LocomotionArgs {
    /// Part to run.
    #[command(subcommand)]
    part: LocomotionPart,
}

#[derive(Debug, Subcommand)]
enum LocomotionPart {
    /// Let robots stand, walk, squat, carry, be pulled and pushed, and let two carry a bar; report survival,
    /// errors and power per case.
    Bench {
        #[command(flatten)]
        locomotion: LocomotionFlag,
        /// Drive all motors by the policy, with its own gains, like `send_joint_drives`, rather than legs and
        /// waist alone. Cases of teams are left out.
        #[arg(long, requires = "file")]
        motors: bool,
        #[command(flatten)]
        sensing: SensingFlags,
        /// Robot: `g1_dex3` with the effort limits of Unitree's MJCF, `g1_dex3_urdf_efforts` with those of
        /// its URDF (35 N m instead of 50 at ankles, waist roll and waist pitch), or a file with another
        /// robot, as in `serve`.
        #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT_ROBOT)]
        robot: String,
        /// Cases whose names contain one of these words, separated by commas.
        #[arg(long, default_value = "", value_name = "WORDS")]
        cases: String,
        /// One seed, or a range of seeds as 0-9 or 0..9, both ends included.
        #[arg(long, default_value = "0-9", value_name = "SEEDS")]
        seeds: Seeds,
        /// JSON file to write.
        #[arg(long, value_name = "OUT")]
        json: Option<PathBuf>,
    },
}

/// Plays the cases, prints a line for each finished case and a summary, and writes JSON if a file is named.
pub fn run(args: LocomotionArgs) -> CommandResult {
    let LocomotionPart::Bench { locomotion, motors, sensing, robot, cases, seeds, json } = args.part;
    let robot = match ROBOTS.contains(&robot.as_str()) {
        true => RobotFile::Embedded(robot),
        false => read_robot(Some(Path::new(&robot)))?,
    };
    println!("{}", CaseReport::HEAD);
    let (controller, sensing) = (locomotion.controller(), sensing.sensing());
    let done = |case: &CaseReport| println!("{case}");
    let report = match motors {
        true => tandem_bench::motors(&robot, &controller, sensing, &cases, &seeds.0, done)?,
        false => tandem_bench::locomotion(&robot, &controller, sensing, &cases, &seeds.0, done)?,
    };
    println!("{}", report.settings());
    if let Some(path) = json {
        std::fs::write(path, serde_json::to_string_pretty(&report)?)?;
    }
    Ok(ExitCode::SUCCESS)
}
