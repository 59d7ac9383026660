//! Cases of the bench of base controllers in which robots call `walk_to`, with empty hands or as a team with
//! a load.

use std::f32::consts::{FRAC_PI_2, TAU};
use std::ops::RangeInclusive;
use std::sync::LazyLock;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tandem_episodes::{
    Controller, EpisodeSpec, RobotFile, Session, isometry_from_sim,
    players::{InProcess, PlayerError},
    tasks::{Task, embedded_task},
};
use tandem_sim::render::RendererKind;
use tandem_sim::{Sensing, Side, Sides, SplitMix64};
use tandem_tools_spec::{Assistance, Destination, PoseFrame, Protocol, ToolCall, WalkTo};

use super::holding::loads::{BASKET, LEGS, ROUND_TABLE, SharedLoad, TABLE};
use crate::error::BenchError;
use crate::report::{CaseFigures, CaseReport};
use crate::seeds::{is_asked, over_seeds};

/// Task of a single robot on an empty floor.
static TASK: LazyLock<Task> = LazyLock::new(|| embedded_task("place.toml", include_str!("tasks/place.toml")));

/// Number of successive targets, each relative to the end of the previous walk.
const PLACES: usize = 3;
/// Range of the distance to the next target, and limit of the turn, for a single robot on an empty floor.
const AWAY_M: [f32; 2] = [0.05, 0.6];
const TURN_RAD: f32 = FRAC_PI_2;
/// The same values for a team in the room of its task. The team walks back and forth along the free path,
/// since there is furniture on both sides.
const CARRIED_AWAY_M: [f32; 2] = [0.05, 0.35];
const CARRIED_TURN_RAD: f32 = 0.2;
const MAX_STEPS: u32 = 1500;

/// Worst values over the calls of a robot or a team.
#[derive(Clone, Debug, Default)]
struct PlaceResult {
    /// Final distance of a pelvis from its target; `off_rad` is its heading error.
    off_m: f64,
    off_rad: f64,
    /// Change of the wrists' horizontal position relative to their pelvis, from before the first call to
    /// after this one.
    squeezed_m: f64,
}

/// Plays the cases whose names match `filter` on these seeds.
pub fn run(
    robot: &RobotFile,
    controller: &Controller,
    sensing: Sensing,
    filter: &str,
    seeds: &RangeInclusive<u32>,
    done: &mut dyn FnMut(CaseReport),
) -> Result<(), BenchError> {
    let loads = [&TABLE, &ROUND_TABLE, &LEGS, &BASKET].map(Some);
    for load in std::iter::once(None).chain(loads) {
        let name = load.map_or("place_walk".into(), |load| format!("place_{}", load.name));
        if !is_asked(filter, &name) {
            continue;
        }
        let trials = over_seeds(seeds, |seed| {
            let spec = EpisodeSpec {
                robot: robot.clone(),
                locomotion: controller.clone(),
                sensing,
                renderer: RendererKind::Cpu,
                ..EpisodeSpec::new(load.map_or(&TASK, SharedLoad::task), seed, Protocol::Agentic)
            };
            trial(&spec.assisted(Assistance::Full), load)
        });
        let trials = trials.into_iter().collect::<Result<Vec<_>, BenchError>>()?;
        let placed: Vec<&PlaceResult> = trials.iter().flatten().collect();
        let worst = |value: fn(&PlaceResult) -> f64| {
            placed.iter().map(|placed| value(placed) as f32).reduce(f32::max)
        };
        let figures = CaseFigures {
            heading_error_deg: worst(|placed| placed.off_rad.to_degrees()),
            final_drift_m: worst(|placed| placed.off_m),
            load_drift_m: load.and(worst(|placed| placed.squeezed_m)),
            ..CaseFigures::default()
        };
        done(CaseReport { case: name, seeds: trials.len(), survived: placed.len(), figures });
    }
    Ok(())
}

/// Plays one seed. Returns `None` if a robot fell, or the team did not grasp its load.
fn trial(spec: &EpisodeSpec, load: Option<&SharedLoad>) -> Result<Option<PlaceResult>, BenchError> {
    let session = Session::start(spec, None).map_err(Box::new)?;
    let mut episode = InProcess::new(session);
    let team: Vec<usize> = load.map_or(vec![0], |load| load.team().collect());
    match load.map_or(Ok(()), |load| load.take(&mut episode, false)) {
        Ok(()) => {}
        Err(PlayerError::GaveUp(_) | PlayerError::EpisodeOver) => return Ok(None),
        Err(error) => return Err(error.into()),
    }
    let session = &mut episode.session;
    let mut random = SplitMix64(spec.seed.into());
    let wrists = pelvis_from_wrists(session, &team);
    let mut result = PlaceResult::default();
    for place in 0..PLACES {
        let (by_m, turn_rad) = match load {
            None => drawn(&mut random),
            Some(load) => drawn_along(load, place, &mut random),
        };
        let goals = goals(session, &team, by_m, turn_rad);
        send(session, &team, &goals, load.is_some())?;
        for (robot, goal) in team.iter().zip(&goals) {
            let at = upright(&pelvis(session, *robot));
            let off = goal.inv_mul(&at);
            let off_rad = heading(&off);
            result.off_m = result.off_m.max(off.translation.vector.xy().norm());
            result.off_rad = result.off_rad.max(off_rad.abs());
        }
        for (before, now) in wrists.iter().zip(pelvis_from_wrists(session, &team)) {
            for side in Side::BOTH {
                result.squeezed_m = result.squeezed_m.max((now[side] - before[side]).xy().norm());
            }
        }
        if session.present().robots.iter().any(|robot| robot.truth.fallen) {
            return Ok(None);
        }
    }
    Ok(Some(result))
}

/// Draws a displacement in a random direction, and a turn.
fn drawn(random: &mut SplitMix64) -> (Vector3<f64>, f64) {
    let (away_m, angle_rad) = (random.uniform(AWAY_M), random.uniform([0.0, TAU]));
    let turn_rad = random.uniform([-TURN_RAD, TURN_RAD]);
    let (sine, cosine) = f64::from(angle_rad).sin_cos();
    (f64::from(away_m) * Vector3::new(cosine, sine, 0.0), turn_rad.into())
}

/// Draws a displacement along the path of a load, and a turn. Both are positive for even places and negative
/// for odd ones.
fn drawn_along(load: &SharedLoad, place: usize, random: &mut SplitMix64) -> (Vector3<f64>, f64) {
    let sign = if place.is_multiple_of(2) { 1.0 } else { -1.0 };
    let (away_m, turn_rad) = (random.uniform(CARRIED_AWAY_M), random.uniform([0.0, CARRIED_TURN_RAD]));
    let [x_m, y_m] = load.way_m.map(f64::from);
    let way_m = Vector3::new(x_m, y_m, 0.0).normalize();
    (sign * f64::from(away_m) * way_m, sign * f64::from(turn_rad))
}

/// Returns the target poses of the pelvises for a displacement, and a turn about the centre of the team.
fn goals(session: &Session, team: &[usize], by_m: Vector3<f64>, turn_rad: f64) -> Vec<Isometry3<f64>> {
    let at: Vec<Isometry3<f64>> = team.iter().map(|robot| upright(&pelvis(session, *robot))).collect();
    let middle_m = at.iter().map(|at| at.translation.vector).sum::<Vector3<f64>>() / at.len() as f64;
    let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_rad);
    let moved = Translation3::from(by_m) * Isometry3::rotation_wrt_point(turned, middle_m.into());
    at.iter().map(|at| moved * at).collect()
}

/// Sends each robot to its target, expressed in its start frame according to its odometry.
fn send(
    session: &mut Session,
    team: &[usize],
    goals: &[Isometry3<f64>],
    carries: bool,
) -> Result<(), BenchError> {
    let destination = |(robot, goal): (&usize, &Isometry3<f64>)| {
        let sensed = isometry_from_sim(&session.present().robots[*robot].sensed.start_from_pelvis);
        let to = upright(&sensed) * upright(&pelvis(session, *robot)).inv_mul(goal);
        Destination {
            robot: session.spec().task.robots[*robot].name.into(),
            to_m: [to.translation.x, to.translation.y],
            heading_rad: Some(heading(&to)),
            waypoints: None,
            carry: Some(carries),
        }
    };
    let robots = team.iter().zip(goals).map(destination).collect();
    let call =
        ToolCall::from(WalkTo { steps: MAX_STEPS, frame: PoseFrame::Start, robots, until_heard: false });
    session.call(call).map_err(Box::new)?;
    Ok(())
}

fn pelvis(session: &Session, robot: usize) -> Isometry3<f64> {
    isometry_from_sim(&session.present().robots[robot].truth.world_from_pelvis())
}

fn pelvis_from_wrists(session: &Session, team: &[usize]) -> Vec<Sides<Vector3<f64>>> {
    let wrists = |robot: &usize| {
        let into_pelvis = upright(&pelvis(session, *robot)).inverse();
        let truth = &session.present().robots[*robot].truth;
        Sides::from_fn(|side| {
            (into_pelvis * isometry_from_sim(&truth.world_from_wrist[side])).translation.vector
        })
    };
    team.iter().map(wrists).collect()
}

fn heading(pose: &Isometry3<f64>) -> f64 {
    let ahead = pose.rotation * Vector3::x();
    ahead.y.atan2(ahead.x)
}

fn upright(pose: &Isometry3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(
        pose.translation,
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading(pose)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays a case on three seeds. Checks that no robot falls, and that every pelvis comes to rest within
    /// `off_m` and 1.5 degrees of its target.
    fn comes_to_its_place(filter: &str, off_m: f32, squeezed_m: f32) {
        let mut played = 0;
        let mut check = |report: CaseReport| {
            played += 1;
            assert_eq!(report.survived, report.seeds, "{report}");
            assert!(report.figures.final_drift_m.is_some_and(|drift_m| drift_m <= off_m), "{report}");
            assert!(report.figures.heading_error_deg.is_some_and(|off_deg| off_deg <= 1.5), "{report}");
            assert!(report.figures.load_drift_m.is_none_or(|drift_m| drift_m <= squeezed_m), "{report}");
        };
        let (robot, controller) = (RobotFile::default(), Controller::default());
        run(&robot, &controller, Sensing::default(), filter, &(3000..=3002), &mut check).unwrap();
        assert_eq!(played, 1, "{filter}");
    }

    #[test]
    fn robots_come_to_their_places() {
        comes_to_its_place("place_walk", 0.017, 0.0);
    }

    #[test]
    fn teams_come_to_their_places_with_what_they_hold() {
        comes_to_its_place("place_shared_table", 0.02, 0.06);
    }
}
