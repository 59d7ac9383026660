//! Cases of one robot: standing, loads, walking, stopping, squatting, pushes and a tour.

mod cases;
mod measure;
mod motion;
mod tour;
mod trial;

use std::ops::RangeInclusive;
use std::sync::Arc;

use tandem_sim::{LocomotionChoice, RobotModel, Sensing, SimError};

use crate::report::{CaseFigures, CaseReport, LocomotionReport};
use crate::seeds::{is_asked, over_seeds};
use cases::{CASES, Case};

/// Controller under test.
#[derive(Clone, Copy, Debug)]
pub enum Subject<'a> {
    /// A base controller; the arms use their standard drives.
    Base(&'a LocomotionChoice),
    /// A policy that drives all motors, without a base controller.
    Motors(&'a LocomotionChoice),
}

impl Subject<'_> {
    /// Returns the name in reports. The prefix `motors:` marks a policy that drives all motors.
    fn name(&self) -> String {
        match self {
            Subject::Base(choice) => choice.name(),
            Subject::Motors(choice) => format!("motors:{}", choice.name()),
        }
    }
}

/// Runs every case that matches `filter` on these seeds, with a robot named `robot` in the results. Calls
/// `done` after each case. The cases specify speeds, heights, loads and forces for a G1; they are scaled for
/// a robot of another size.
///
/// # Errors
///
/// Returns an error if a world cannot be built, physics diverges, or the subject cannot drive the motors.
pub fn run(
    robot: &str,
    model: &Arc<RobotModel>,
    subject: Subject,
    sensing: Sensing,
    filter: &str,
    seeds: &RangeInclusive<u32>,
    mut done: impl FnMut(&CaseReport),
) -> Result<LocomotionReport, SimError> {
    let mut cases = Vec::new();
    for case in CASES.iter().filter(|case| is_asked(filter, case.name)) {
        let trials = over_seeds(seeds, |seed| trial::run(case, seed, model, subject, sensing));
        let trials = trials.into_iter().collect::<Result<Vec<_>, _>>()?;
        let report = summarise(case, &trials);
        done(&report);
        cases.push(report);
    }
    Ok(LocomotionReport { robot: robot.into(), controller: subject.name(), sensing, cases })
}

/// Summarises the trials of a case. A trial is `None` if the robot fell.
fn summarise(case: &Case, trials: &[Option<CaseFigures>]) -> CaseReport {
    let standing: Vec<&CaseFigures> = trials.iter().flatten().collect();
    let worst = |value: fn(&CaseFigures) -> Option<f32>| {
        standing.iter().filter_map(|trial| value(trial)).reduce(f32::max)
    };
    let mean = |value: fn(&CaseFigures) -> Option<f32>| {
        let values: Vec<f32> = standing.iter().filter_map(|trial| value(trial)).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f32>() / values.len() as f32)
    };
    let figures = CaseFigures {
        velocity_error_share: mean(|trial| trial.velocity_error_share),
        heading_error_deg: worst(|trial| trial.heading_error_deg),
        final_drift_m: worst(|trial| trial.final_drift_m),
        sway_m: worst(|trial| trial.sway_m),
        height_error_m: worst(|trial| trial.height_error_m),
        standing_after_s: worst(|trial| trial.standing_after_s),
        still_after_s: worst(|trial| trial.still_after_s),
        steps: standing.iter().filter_map(|trial| trial.steps).max(),
        pelvis_tilt_deg: worst(|trial| trial.pelvis_tilt_deg),
        power_w: mean(|trial| Some(trial.power_w)).unwrap_or(0.0),
        ..CaseFigures::default()
    };
    CaseReport { case: case.name.into(), seeds: trials.len(), survived: standing.len(), figures }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tandem_episodes::RobotFile;
    use tandem_sim::SensorModel;
    use tandem_sim::assets::DEFAULT_ROBOT;

    #[test]
    fn a_report_says_what_was_measured() {
        let sensing = Sensing { sensors: SensorModel::G1, ..Sensing::TRUTH };
        let model = RobotFile::default().model().unwrap();
        let report = run(
            DEFAULT_ROBOT,
            &model,
            Subject::Base(&LocomotionChoice::Balance),
            sensing,
            "no such case",
            &(0..=0),
            |_| {},
        );
        let report = report.unwrap();
        let json = serde_json::to_value(&report).unwrap();
        for (key, value) in [
            ("robot", DEFAULT_ROBOT),
            ("controller", "balance"),
            ("state_estimate", "truth"),
            ("sensors", "g1"),
        ] {
            assert_eq!(json[key], value, "{key}");
            assert!(report.settings().contains(value), "{}", report.settings());
        }
    }
}
