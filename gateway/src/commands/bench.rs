//! `tandem bench`: figures that anybody can repeat.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

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
    /// Physics: time of a step of 5 ms with one to three robots that stand, walk or hold a bottle.
    Physics {
        /// Write the cases to this file as JSON, too.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
}

/// Measures and prints.
pub fn run(args: Args) -> Outcome {
    match args.part {
        Part::Ik { targets, json } => ik(targets.as_deref(), json),
        Part::Physics { json } => physics(json.as_deref()),
    }
}

fn physics(json: Option<&Path>) -> Outcome {
    println!("{:14}{:>7}{:>10}{:>11}", "case", "robots", "us/step", "real time");
    let report = tandem_episodes::bench::physics(|case| {
        println!(
            "{:14}{:>7}{:>10.1}{:>10.1}x",
            case.name, case.robots, case.median_step_us, case.realtime_factor
        );
    })?;
    if let Some(path) = json {
        std::fs::write(path, serde_json::to_string_pretty(&report)? + "\n")?;
    }
    Ok(ExitCode::SUCCESS)
}

fn ik(targets: Option<&Path>, json: bool) -> Outcome {
    let report = tandem_episodes::bench::ik(targets)?;
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
