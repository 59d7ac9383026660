//! `tandem bench`: figures that anybody can repeat.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::Subcommand;

use super::{Outcome, bench_tools};

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
    /// Calls of tools over HTTP on this machine: their time without physics, and that of `wait` against its physics.
    Tools {
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
        Part::Tools { json } => tools(json),
        Part::Physics { json } => physics(json.as_deref()),
    }
}

fn tools(json: bool) -> Outcome {
    let report = bench_tools::tools()?;
    if json {
        println!("{}", serde_json::to_string_pretty(&report)?);
        return Ok(ExitCode::SUCCESS);
    }
    println!("{:20}{:>8}{:>10}{:>10}", "call", "times", "p50 ms", "p99 ms");
    for call in &report.calls {
        println!("{:20}{:>8}{:>10.2}{:>10.2}", call.tool, call.calls, call.p50_ms, call.p99_ms);
    }
    let wait = &report.wait;
    println!(
        "wait of {} steps: {:.1} ms, of which {:.1} ms physics; {:.3} times its physics (medians of {})",
        wait.steps, wait.call_p50_ms, wait.physics_p50_ms, wait.p50_ratio, wait.calls
    );
    Ok(ExitCode::SUCCESS)
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
