//! `tandem bench`: figures that anybody can repeat.

use std::{path::PathBuf, process::ExitCode};

use clap::Subcommand;

use super::Outcome;

/// Measure a part of Tandem on this machine.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Which part.
    #[command(subcommand)]
    part: Part,
}

#[derive(Debug, Subcommand)]
enum Part {
    /// Inverse kinematics of both wrists: share of targets reached, iterations, time.
    Ik {
        /// JSON file with targets; without it, 200 are drawn from the robot's joint ranges.
        #[arg(long, value_name = "FILE")]
        targets: Option<PathBuf>,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
}

/// Measures and prints.
pub fn run(args: Args) -> Outcome {
    let Part::Ik { targets, json } = args.part;
    let report = tandem_episodes::bench::ik(targets.as_deref())?;
    if json {
        println!("{}", serde_json::to_string_pretty(&report)?);
        return Ok(ExitCode::SUCCESS);
    }
    println!(
        "{:24} {:>8} {:>11} {:>9} {:>10}",
        "configuration", "reached", "iterations", "us/step", "ms/solve"
    );
    for way in &report.configurations {
        println!(
            "{:24} {:>8.3} {:>11.0} {:>9.1} {:>10.3}",
            way.name, way.reached, way.iterations_median, way.step_us_median, way.solve_ms_median
        );
    }
    Ok(ExitCode::SUCCESS)
}
