//! `tandem bench`: figures that anybody can repeat.

use std::{error::Error, path::Path};

use tandem_episodes::{LocomotionChoice, bench::CaseReport};

/// Plays the locomotion bench by controllers of `choice`, prints a line per case as it ends, and writes JSON if `json` names a file.
pub fn locomotion(
    choice: &LocomotionChoice,
    cases: &str,
    seeds: usize,
    json: Option<&Path>,
) -> Result<(), Box<dyn Error>> {
    println!("{}", CaseReport::HEAD);
    let report = tandem_episodes::bench::locomotion(choice, cases, seeds, |case| println!("{case}"))?;
    if let Some(path) = json {
        std::fs::write(path, serde_json::to_string_pretty(&report)?)?;
    }
    Ok(())
}

/// Measures inverse kinematics and prints a table, or JSON.
pub fn ik(targets: Option<&Path>, json: bool) -> Result<(), Box<dyn Error>> {
    let report = tandem_episodes::bench::ik(targets)?;
    if json {
        println!("{}", serde_json::to_string_pretty(&report)?);
        return Ok(());
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
    Ok(())
}
