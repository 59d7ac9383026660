//! Cases of base controllers.

use std::ops::RangeInclusive;

use tandem_episodes::{Controller, EpisodeError, RobotFile};
use tandem_sim::Sensing;

use crate::error::BenchError;
use crate::report::{CaseReport, LocomotionReport};
use crate::seeds::is_asked;
use crate::single::{self, Subject};
use crate::teams::{carrying, holding, placing};

/// Plays the cases whose names contain one of the comma-separated words of `filter` on these seeds. Single
/// robots come first, then two robots with fingers that carry an object together. Calls `done` after each
/// case.
///
/// # Errors
///
/// Returns an error if a file cannot be read, or a world cannot be built.
pub fn locomotion(
    robot: &RobotFile,
    controller: &Controller,
    sensing: Sensing,
    filter: &str,
    seeds: &RangeInclusive<u32>,
    mut done: impl FnMut(&CaseReport),
) -> Result<LocomotionReport, BenchError> {
    let choice = controller.load()?;
    let model = robot.model().map_err(|error| Box::new(EpisodeError::from(error)))?;
    let mut report =
        single::run(&robot.kind(), &model, Subject::Base(&choice), sensing, filter, seeds, &mut done)?;
    if !model.has_fingers() {
        return Ok(report);
    }
    for case in carrying::CASES.iter().filter(|case| is_asked(filter, case.name)) {
        let carried = carrying::run(case, robot, controller, sensing, seeds)?;
        done(&carried);
        report.cases.push(carried);
    }
    holding::run(robot, controller, sensing, filter, seeds, &mut |held| {
        done(&held);
        report.cases.push(held);
    })?;
    placing::run(robot, controller, sensing, filter, seeds, &mut |placed| {
        done(&placed);
        report.cases.push(placed);
    })?;
    Ok(report)
}

/// Plays the cases of single robots that match `filter`, like [`locomotion`], with a velocity policy that
/// drives all motors with its own gains.
///
/// # Errors
///
/// Returns an error if a file cannot be read, a world cannot be built, or the controller is not a policy from
/// a file.
pub fn motors(
    robot: &RobotFile,
    controller: &Controller,
    sensing: Sensing,
    filter: &str,
    seeds: &RangeInclusive<u32>,
    done: impl FnMut(&CaseReport),
) -> Result<LocomotionReport, BenchError> {
    let choice = controller.load()?;
    let model = robot.model().map_err(|error| Box::new(EpisodeError::from(error)))?;
    Ok(single::run(&robot.kind(), &model, Subject::Motors(&choice), sensing, filter, seeds, done)?)
}
