//! Benchmarks of Tandem's parts on their own, with the robot that the episodes use.

mod carrying;
mod env;
mod falls;
mod holding;
mod placing;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

pub use env::{EnvCase, EnvReport, env};
pub use falls::falls;
use tandem_episodes::{Controller, EpisodeError, RobotFile, players::PlayerError, upper_body};
pub use tandem_ik::bench::Report as IkReport;
use tandem_ik::bench::{TargetSet, run};
use tandem_ik::{IkError, Model};
use tandem_sim::bench::{self, Subject};
pub use tandem_sim::bench::{
    CaseReport, FallTrial, FallsCase, FallsReport, FloorEpisode, LocomotionReport, PhysicsCase,
    PhysicsReport, PicturesCase, PicturesReport,
};
use tandem_sim::render::{CameraModel, RendererKind};
use tandem_sim::{Sensing, assets};

use crate::batch::BatchError;

/// Number of targets that are drawn if no file gives any.
const SAMPLED_TARGETS: usize = 200;
const SAMPLE_SEED: u64 = 1;
const WRISTS: [&str; 2] = ["left_wrist_yaw_link", "right_wrist_yaw_link"];

/// Reason why the measurement cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    #[error("cannot read the targets {path}: {source}")]
    Read { path: PathBuf, source: std::io::Error },
    #[error(transparent)]
    Ik(#[from] IkError),
    #[error(transparent)]
    Sim(#[from] tandem_sim::SimError),
    #[error(transparent)]
    Episode(#[from] Box<EpisodeError>),
    #[error(transparent)]
    Batch(#[from] Box<BatchError>),
    #[error(transparent)]
    Player(#[from] PlayerError),
    #[error("no case's name contains `{asked}`; the cases are {have}")]
    NoCase { asked: String, have: String },
    #[error("0 episodes measure nothing; use at least 1")]
    NoEpisodes,
}

/// Plays the cases whose names contain one of the words of `filter`, separated by commas, on these seeds.
/// Single robots come first, then two that carry something between them, if they have fingers. Calls `done`
/// after each case.
///
/// # Errors
///
/// If a file cannot be read, or a world cannot be built.
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
        bench::run(&robot.kind(), &model, Subject::Base(&choice), sensing, filter, seeds, &mut done)?;
    if !model.has_fingers() {
        return Ok(report);
    }
    for case in carrying::CASES.iter().filter(|case| bench::is_asked(filter, case.name)) {
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

/// Plays the cases of single robots whose names contain one of the words of `filter`, as [`locomotion`] does,
/// with a velocity policy that drives all motors by its own gains.
///
/// # Errors
///
/// If a file cannot be read, a world cannot be built, or the controller is no policy from a file.
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
    Ok(bench::run(&robot.kind(), &model, Subject::Motors(&choice), sensing, filter, seeds, done)?)
}

/// Times physics steps of one to three robots; calls `done` after each case.
pub fn physics(done: impl FnMut(&PhysicsCase)) -> Result<PhysicsReport, BenchError> {
    Ok(bench::physics(done)?)
}

/// Times images of the kitchen; calls `done` after each set.
pub fn pictures(
    renderer: RendererKind,
    camera: CameraModel,
    done: impl FnMut(&PicturesCase),
) -> Result<PicturesReport, BenchError> {
    Ok(bench::pictures(renderer, camera, done)?)
}

/// Solves the targets of a file, or 200 that are drawn from the robot's own joint ranges.
///
/// # Errors
///
/// If the targets cannot be read, or the model cannot be used.
pub fn ik(targets: Option<&Path>) -> Result<IkReport, BenchError> {
    let whole = Model::from_mjcf(assets::robot(assets::DEFAULT_ROBOT)?)?;
    let set = match targets {
        Some(path) => {
            let read = std::fs::read_to_string(path);
            TargetSet::from_json(&read.map_err(|source| BenchError::Read { path: path.into(), source })?)?
        }
        None => {
            let upper_body = upper_body(&whole)?;
            let start_rad = vec![0.0; upper_body.nv()];
            TargetSet::sample(&upper_body, &WRISTS, &start_rad, SAMPLED_TARGETS, SAMPLE_SEED)?
        }
    };
    Ok(run(&whole, &set)?)
}
