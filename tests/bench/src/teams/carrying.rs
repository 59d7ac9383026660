//! Cases of the bench of base controllers in which two robots carry a bar between them. They require hands.
//!
//! The robots grasp the bar on its stand with the experts' skills, lift it, and carry it side by side along
//! the case's path. Their fingers' grip on the bar is their only connection.

use std::cell::Cell;
use std::f32::consts::FRAC_PI_2;
use std::ops::RangeInclusive;
use std::sync::LazyLock;

use tandem_episodes::{
    A, B, Controller, EpisodeSpec, Facts, Grip, RobotFile, Session,
    players::{
        Episode, InProcess, PlayerError, PrivilegedEpisode,
        experts::skills::{CarryTeam, Commander, FREE, HandGrasp, Hold, ObjectPath, grasp_compliantly},
    },
    tasks::{Task, embedded_task},
};
use tandem_sim::render::RendererKind;
use tandem_sim::{Pose, Rotation, Sensing, Sides, Vector, heading_rad, wrapped_rad};
use tandem_tools_spec::{Protocol, ToolCall, ToolReply};

use crate::error::BenchError;
use crate::report::{CaseFigures, CaseReport};
use crate::seeds::over_seeds;

/// A case, defined by a path of the bar.
pub struct CarryingCase {
    pub name: &'static str,
    legs: &'static [PathLeg],
}

/// Segment of a path, from rest to rest.
struct PathLeg {
    /// Distances ahead and to the left, relative to the robots' initial heading.
    by_m: [f32; 2],
    /// Rotation of the bar about its middle.
    turn_rad: f32,
}

pub const CASES: [CarryingCase; 3] = [
    // The first leg moves the right robot clear of the stand, which it then passes.
    CarryingCase { name: "carry_bar_left", legs: &[straight(-0.3, 0.0), straight(0.0, 2.0)] },
    CarryingCase { name: "carry_bar_forward_back", legs: &[straight(2.0, 0.0), straight(-2.0, 0.0)] },
    CarryingCase { name: "carry_bar_turn", legs: &[PathLeg { by_m: [0.0; 2], turn_rad: FRAC_PI_2 }] },
];

const fn straight(ahead_m: f32, left_m: f32) -> PathLeg {
    PathLeg { by_m: [ahead_m, left_m], turn_rad: 0.0 }
}

/// Distance of the robots to the left and right of the bar's middle.
const APART_M: f32 = 0.65;
const LIFT_M: f32 = 0.1;
const PACE_M_S: f32 = 0.2;
/// Number of points per leg at which a path is sampled.
const WAY_POINTS: usize = 200;

/// Task of two robots and a bar.
pub(super) static TASK: LazyLock<Task> =
    LazyLock::new(|| embedded_task("carry_bar.toml", include_str!("tasks/carry_bar.toml")));

/// Plays one case on these seeds.
pub fn run(
    case: &CarryingCase,
    robot: &RobotFile,
    controller: &Controller,
    sensing: Sensing,
    seeds: &RangeInclusive<u32>,
) -> Result<CaseReport, BenchError> {
    let trials = over_seeds(seeds, |seed| trial(case, robot, controller, sensing, seed));
    let trials = trials.into_iter().collect::<Result<Vec<_>, _>>()?;
    let done: Vec<&CarryResult> = trials.iter().flatten().collect();
    let worst = |value: fn(&CarryResult) -> f32| done.iter().map(|carried| value(carried)).reduce(f32::max);
    let figures = CaseFigures {
        heading_error_deg: worst(|carried| carried.heading_error_deg),
        final_drift_m: worst(|carried| carried.final_drift_m),
        sway_m: worst(|carried| carried.off_way_m),
        load_tilt_deg: worst(|carried| carried.tilt_deg),
        power_w: done.iter().map(|carried| carried.power_w).sum::<f32>() / done.len().max(1) as f32,
        ..CaseFigures::default()
    };
    Ok(CaseReport { case: case.name.into(), seeds: trials.len(), survived: done.len(), figures })
}

/// Result for a bar that was carried to the end of its path.
struct CarryResult {
    /// Largest heading error of a robot.
    heading_error_deg: f32,
    /// Final distance of the bar's middle from the end of its path; `off_way_m` is the largest distance from
    /// the path.
    final_drift_m: f32,
    off_way_m: f32,
    /// Largest tilt of the bar.
    tilt_deg: f32,
    /// Mean mechanical power of a robot.
    power_w: f32,
}

/// Plays one seed. Returns `None` if a robot fell, or the hands lost the bar for good.
fn trial(
    case: &CarryingCase,
    robot: &RobotFile,
    controller: &Controller,
    sensing: Sensing,
    seed: u32,
) -> Result<Option<CarryResult>, BenchError> {
    let spec = EpisodeSpec {
        robot: robot.clone(),
        locomotion: controller.clone(),
        sensing,
        renderer: RendererKind::Cpu,
        ..EpisodeSpec::new(&TASK, seed, Protocol::Benchmark)
    };
    let aloft = Cell::new(None);
    let session = Session::start(&spec, None).map_err(Box::new)?;
    let mut logged = LoggedEpisode { episode: InProcess::new(session), aloft: &aloft, log: Vec::new() };
    match carry(case, &mut logged, &aloft) {
        Ok(()) => {}
        Err(PlayerError::GaveUp(_) | PlayerError::EpisodeOver) => return Ok(None),
        Err(error) => return Err(error.into()),
    }
    let held =
        logged.facts()?.object("bar").hands.iter().flat_map(Sides::iter).all(|grip| *grip != Grip::Off);
    Ok(aloft.get().filter(|_| held).map(|start| measure(case, &start, &logged.log)))
}

/// Grasps the bar, lifts it, and carries it. The state of the bar is logged from the lift on.
fn carry(
    case: &CarryingCase,
    episode: &mut dyn PrivilegedEpisode,
    aloft: &Cell<Option<Pose>>,
) -> Result<(), PlayerError> {
    let commander = &mut Commander::new(&TASK, episode)?;
    let [a_left, a_right] = HandGrasp::with_both_hands(A, "bar", ["a_left", "a_right"], 0.0, &Hold::BAR);
    let [b_left, b_right] = HandGrasp::with_both_hands(B, "bar", ["b_left", "b_right"], 0.0, &Hold::BAR);
    let grasps = [a_left, a_right, b_left, b_right];
    let mut team = CarryTeam::new(commander, &grasps)?;
    team.gather(commander)?;
    grasp_compliantly(commander, &grasps)?;
    team.lift(commander, LIFT_M)?;
    let mut from = team.object(commander)?;
    aloft.set(Some(from));
    for leg in case.legs {
        let length_m = leg.length_m();
        let at = |gone_m: f32| leg.at(&from, gone_m / length_m);
        team.carry(commander, &ObjectPath { at: &at, length_m, pace_m_s: PACE_M_S, free_m: &FREE })?;
        from = leg.at(&from, 1.0);
    }
    Ok(())
}

impl PathLeg {
    /// Returns the distance walked by each robot.
    fn length_m(&self) -> f32 {
        Vector::from([self.by_m[0], self.by_m[1], 0.0]).length() + self.turn_rad.abs() * APART_M
    }

    /// Returns the bar's pose after the fraction `share` of the leg.
    fn at(&self, from: &Pose, share: f32) -> Pose {
        let by_m = Vector::new(self.by_m[0], self.by_m[1], 0.0) * share;
        let turned = Rotation::from_rotation_z(self.turn_rad * share);
        Pose::from_parts(from.translation + by_m, turned * from.rotation)
    }
}

/// State after one command.
struct LogEntry {
    bar: Pose,
    pelvises: Vec<Pose>,
    power_w: f32,
}

/// An episode that logs the state while the bar is lifted.
struct LoggedEpisode<'a> {
    episode: InProcess,
    aloft: &'a Cell<Option<Pose>>,
    log: Vec<LogEntry>,
}

impl Episode for LoggedEpisode<'_> {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let reply = self.episode.call(call)?;
        let facts = self.episode.facts()?;
        if facts.robots.iter().any(|robot| robot.fallen) {
            return Err(PlayerError::EpisodeOver);
        }
        if self.aloft.get().is_some() {
            let robots = &self.episode.session.present().robots;
            self.log.push(LogEntry {
                bar: facts.object("bar").pose_in_world,
                pelvises: facts.robots.iter().map(|robot| robot.pelvis_in_world).collect(),
                power_w: robots.iter().map(|robot| robot.sensed.power_w()).sum::<f32>() / robots.len() as f32,
            });
        }
        Ok(reply)
    }
}

impl PrivilegedEpisode for LoggedEpisode<'_> {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.episode.facts()
    }
}

fn measure(case: &CarryingCase, start: &Pose, log: &[LogEntry]) -> CarryResult {
    let (mut way, mut end, mut turned_rad) = (Vec::new(), *start, 0.0);
    for leg in case.legs {
        way.extend((0..=WAY_POINTS).map(|i| leg.at(&end, i as f32 / WAY_POINTS as f32).translation));
        end = leg.at(&end, 1.0);
        turned_rad += leg.turn_rad;
    }
    let away_m = |entry: &LogEntry, from_m: &Vector| (entry.bar.translation - *from_m).truncate().length();
    let off_way_m =
        |entry: &LogEntry| way.iter().map(|at_m| away_m(entry, at_m)).fold(f32::INFINITY, f32::min);
    let tilt_deg = |entry: &LogEntry| (entry.bar.rotation * Vector::Y).z.abs().asin().to_degrees();
    let most = |value: &dyn Fn(&LogEntry) -> f32| log.iter().map(value).fold(0.0, f32::max);
    let turned_deg = |pelvis: &Pose| wrapped_rad(heading_rad(pelvis) - turned_rad).abs().to_degrees();
    let last = log.last();
    CarryResult {
        heading_error_deg: last.map_or(0.0, |last| last.pelvises.iter().map(turned_deg).fold(0.0, f32::max)),
        final_drift_m: last.map_or(0.0, |last| away_m(last, &end.translation)),
        off_way_m: most(&off_way_m),
        tilt_deg: most(&tilt_deg),
        power_w: log.iter().map(|entry| entry.power_w).sum::<f32>() / log.len().max(1) as f32,
    }
}
