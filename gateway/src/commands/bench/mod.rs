//! `tandem bench`: benchmarks that any user can repeat.

mod machine;
mod tools;

use std::{
    error::Error,
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::Subcommand;
use serde::Serialize;
use serde_json::{Map, Value};
use tandem_bench::{EnvReport, FallsCase, FallsReport, IkReport, PhysicsReport, PicturesReport};
use tandem_episodes::{CameraModel, RendererKind};

use super::CommandResult;
use crate::settings::one_of;
use machine::WithMachine;
use tools::ToolsReport;

/// Measure a part of Tandem on this machine.
#[derive(Debug, clap::Args)]
pub struct BenchArgs {
    /// Part to measure.
    #[command(subcommand)]
    part: BenchPart,
}

#[derive(Debug, Subcommand)]
enum BenchPart {
    /// Inverse kinematics of both wrists: share of targets reached, iterations, time.
    Ik {
        /// JSON file with targets; without it, 200 are drawn from the robot's joint ranges.
        #[arg(long, value_name = "FILE")]
        targets: Option<PathBuf>,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// Tool calls over HTTP on this machine: their time without physics, and that of `wait` compared with its
    /// physics.
    Tools {
        /// Also write the figures to this file as JSON.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Physics: time of a step of 5 ms with one to three robots that stand, walk or hold a bottle.
    Physics {
        /// Also write the cases to this file as JSON.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Rendering: the images of both robots' head cameras in one state, and the third-person image.
    Render {
        /// Renderer: `cpu`, `gpu`, `path`, or `auto`.
        #[arg(long, default_value = "cpu", value_name = "NAME", value_parser = one_of(RendererKind::ALL, RendererKind::name))]
        renderer: RendererKind,
        /// Model of the head cameras.
        #[arg(long, default_value = CameraModel::default().name(), value_name = "NAME", value_parser = one_of(CameraModel::ALL, CameraModel::name))]
        camera: CameraModel,
        /// Also write the cases to this file as JSON.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Learning environments: steps per second of two and three robots without images, and their ratio to the
    /// core's own rate.
    Env {
        /// Also write the cases to this file as JSON.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Falls: the physics of robots that stagger through all tasks, are dropped and struck.
    Falls {
        /// Number of episodes over all cases.
        #[arg(long, default_value_t = FALLS_EPISODES, value_name = "N")]
        episodes: usize,
        /// Cases whose names contain one of these words, separated by commas.
        #[arg(long, default_value = "", value_name = "WORDS")]
        cases: String,
        /// Write the commands of robots alone on a floor, and their outcomes, to this file as JSON.
        #[arg(long, value_name = "FILE")]
        commands: Option<PathBuf>,
        /// Also write the cases to this file as JSON.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// All parts in sequence, each with its defaults.
    All {
        /// Also write everything to this file as JSON.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
}

/// A function that measures a part, prints a table, and returns the report as JSON.
type Measure = fn() -> Result<Value, Box<dyn Error>>;

/// Parts that `bench all` measures. A new part needs a line here.
const PARTS: [(&str, Measure); 6] = [
    ("physics", || Ok(serde_json::to_value(measure_physics()?)?)),
    ("render", || Ok(serde_json::to_value(measure_pictures(RendererKind::Cpu, CameraModel::Ideal)?)?)),
    ("env", || Ok(serde_json::to_value(measure_env()?)?)),
    ("tools", || Ok(serde_json::to_value(measure_tools()?)?)),
    ("ik", || {
        let report = tandem_bench::ik(None)?;
        print_ik(&report);
        Ok(serde_json::to_value(report)?)
    }),
    ("falls", || Ok(serde_json::to_value(measure_falls(FALLS_EPISODES, "")?)?)),
];

/// Default number of episodes: four for each case.
const FALLS_EPISODES: usize = 60;

/// Measures a part and prints a table.
pub fn run(args: BenchArgs) -> CommandResult {
    match args.part {
        BenchPart::Ik { targets, json } => ik(targets.as_deref(), json),
        BenchPart::Tools { json } => write(measure_tools()?, json.as_deref()),
        BenchPart::Physics { json } => write(measure_physics()?, json.as_deref()),
        BenchPart::Render { renderer, camera, json } => {
            write(measure_pictures(renderer, camera)?, json.as_deref())
        }
        BenchPart::Env { json } => write(measure_env()?, json.as_deref()),
        BenchPart::Falls { episodes, cases, commands, json } => {
            let report = measure_falls(episodes, &cases)?;
            if let Some(path) = commands {
                std::fs::write(path, serde_json::to_string(&report.floor)?)?;
            }
            write(report, json.as_deref())
        }
        BenchPart::All { json } => all(json.as_deref()),
    }
}

fn all(json: Option<&Path>) -> CommandResult {
    let mut reports = Map::new();
    for (name, measure) in PARTS {
        println!("{name}");
        reports.insert(name.into(), measure()?);
        println!();
    }
    write(reports, json)
}

/// Writes a report with a description of the machine, if a file is named.
fn write(report: impl Serialize, json: Option<&Path>) -> CommandResult {
    if let Some(path) = json {
        WithMachine::here(report).write(path)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn measure_tools() -> Result<ToolsReport, Box<dyn Error>> {
    let report = tools::tools()?;
    println!("{:20}{:>8}{:>10}{:>10}", "call", "times", "p50 ms", "p99 ms");
    for call in &report.calls {
        println!("{:20}{:>8}{:>10.2}{:>10.2}", call.tool, call.calls, call.p50_ms, call.p99_ms);
    }
    let wait = &report.wait;
    println!(
        "wait of {} steps: {:.1} ms, of which {:.1} ms physics; {:.3} times its physics (medians of {})",
        wait.steps, wait.call_p50_ms, wait.physics_p50_ms, wait.p50_ratio, wait.calls
    );
    Ok(report)
}

fn measure_physics() -> Result<PhysicsReport, Box<dyn Error>> {
    println!("{:14}{:>7}{:>10}{:>11}", "case", "robots", "us/step", "real time");
    Ok(tandem_bench::physics(|case| {
        println!(
            "{:14}{:>7}{:>10.1}{:>10.1}x",
            case.name, case.robots, case.median_step_us, case.realtime_factor
        );
    })?)
}

fn measure_env() -> Result<EnvReport, Box<dyn Error>> {
    println!(
        "{:14}{:>7}{:>8}{:>9}{:>10}{:>10}{:>10}{:>10}",
        "task", "robots", "worlds", "threads", "steps/s", "of core", "busy", "reset ms"
    );
    Ok(tandem_bench::env(|case| {
        let busy = case.busy_of_core.map_or("-".into(), |share| format!("{:.2}", share.median));
        println!(
            "{:14}{:>7}{:>8}{:>9}{:>10.0}{:>10.2}{busy:>10}{:>10.1}",
            case.task,
            case.robots,
            case.worlds,
            case.threads,
            case.steps_per_s.median,
            case.of_core.median,
            case.reset_ms.median
        );
    })?)
}

fn measure_falls(episodes: usize, cases: &str) -> Result<FallsReport, Box<dyn Error>> {
    let mut head = Some(FallsCase::HEAD);
    Ok(tandem_bench::falls(episodes, cases, |case| {
        head.take().into_iter().for_each(|head| println!("{head}"));
        println!("{case}");
        case.diverged_at.iter().for_each(|at| println!("    {at}"));
    })?)
}

fn measure_pictures(renderer: RendererKind, camera: CameraModel) -> Result<PicturesReport, Box<dyn Error>> {
    println!("{:14}{:>9}{:>11}{:>11}{:>11}", "pictures", "count", "size", "busy ms", "wall ms");
    Ok(tandem_bench::pictures(renderer, camera, |case| {
        let size = format!("{}x{}", case.width, case.height);
        println!(
            "{:14}{:>9}{size:>11}{:>11.2}{:>11.2}",
            case.name, case.pictures, case.busy_ms.median, case.wall_ms.median
        );
    })?)
}

fn ik(targets: Option<&Path>, json: bool) -> CommandResult {
    let report = tandem_bench::ik(targets)?;
    if json {
        println!("{}", serde_json::to_string_pretty(&WithMachine::here(report))?);
    } else {
        print_ik(&report);
    }
    Ok(ExitCode::SUCCESS)
}

fn print_ik(report: &IkReport) {
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
}
