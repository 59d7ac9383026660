//! Benchmarks of base controllers: standing, loads, walking, stopping, squatting, pushes and a tour, with
//! several seeds each. They also measure the time of a physics step and of an image, and falling robots.

mod cases;
mod falls;
mod measure;
mod motion;
mod physics;
mod pictures;
mod stand;
mod tour;
mod trial;

use std::fmt;
use std::num::NonZero;
use std::ops::RangeInclusive;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;

pub use cases::{CASES, Case};
pub use falls::{Broken, FALL_CASES, FallCase, FallPlace, FallTrial, FallsCase, FallsReport, FloorEpisode};
pub use physics::{PhysicsCase, PhysicsReport, physics};
pub use pictures::{PicturesCase, PicturesReport, pictures};
pub use stand::{StandTrial, stand};

use crate::SimError;
use crate::body::RobotModel;
use crate::locomotion::LocomotionChoice;
use crate::robot::Sensing;
use measure::Trial;

/// Results of all cases.
#[derive(Clone, Debug, Serialize)]
pub struct LocomotionReport {
    /// Name in [`crate::assets::ROBOTS`], or of a file.
    pub robot: String,
    /// Name in recordings, with the loop if there is one.
    pub controller: String,
    #[serde(flatten)]
    pub sensing: Sensing,
    pub cases: Vec<CaseReport>,
}

/// One case over its seeds. A number is the worst of the robots that did not fall; velocity error and
/// power are means. `None` if not measured in this case.
#[derive(Clone, Debug, Serialize)]
pub struct CaseReport {
    pub case: String,
    pub seeds: usize,
    pub survived: usize,
    /// Deviation of the mean velocity, as a share of the command: mean over the seeds.
    #[serde(rename = "velocity_error")]
    pub velocity_error_share: Option<f32>,
    pub heading_error_deg: Option<f32>,
    pub final_drift_m: Option<f32>,
    pub sway_m: Option<f32>,
    pub height_error_m: Option<f32>,
    /// Time from the zero command until the pelvis stays slower than 0.1 m/s, and than 0.02 m/s.
    pub standing_after_s: Option<f32>,
    pub still_after_s: Option<f32>,
    /// Number of times that a foot left the ground while the robot was to stand.
    pub steps: Option<u32>,
    /// Largest tilt of the pelvis of a walking robot.
    pub pelvis_tilt_deg: Option<f32>,
    /// Maximum tilt of a load carried by several robots.
    pub load_tilt_deg: Option<f32>,
    /// Drift of held objects after they came to rest: the mean of each second, horizontally.
    pub load_drift_m: Option<f32>,
    /// Mean absolute mechanical power of all joints.
    pub power_w: f32,
}

/// A measured value and its spread: median and quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    pub median: f64,
    pub quartiles: [f64; 2],
}

/// Linux file whose first word is the running time of this thread in nanoseconds.
const BUSY: &str = "/proc/thread-self/schedstat";

/// Returns the CPU time of this thread, or the time since `started` if the system does not report it.
pub fn busy_since(started: Instant) -> Duration {
    let text = std::fs::read_to_string(BUSY).unwrap_or_default();
    let ns = text.split_whitespace().next().and_then(|word| word.parse().ok());
    ns.map_or_else(|| started.elapsed(), Duration::from_nanos)
}

impl Spread {
    /// Computes the spread of `values`, which it sorts.
    ///
    /// # Panics
    ///
    /// Panics if `values` is empty.
    pub fn of(values: &mut [f64]) -> Spread {
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
        Spread { median: at(0.5), quartiles: [at(0.25), at(0.75)] }
    }
}

/// Returns true if a case's name contains one of the comma-separated words of `filter`.
pub fn is_asked(filter: &str, case: &str) -> bool {
    filter.split(',').any(|word| case.contains(word))
}

/// Controller under test.
#[derive(Clone, Copy, Debug)]
pub enum Subject<'a> {
    /// A base controller, under the arms' own drives.
    Base(&'a LocomotionChoice),
    /// A policy that drives all motors by itself.
    Motors(&'a LocomotionChoice),
}

impl Subject<'_> {
    /// Returns the name in reports; `motors:` marks a policy that drives all motors.
    fn name(&self) -> String {
        match self {
            Subject::Base(choice) => choice.name(),
            Subject::Motors(choice) => format!("motors:{}", choice.name()),
        }
    }
}

/// Runs every case that matches `filter`, on these seeds, with a robot named `robot` in the results.
/// `done` is called after each case. Speeds, heights, loads and forces of the cases are those of a G1; a
/// robot of another size has scaled ones.
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

/// Returns the result of `trial` for each of these seeds, running as many at once as there are processors.
pub fn over_seeds<T: Send>(seeds: &RangeInclusive<u32>, trial: impl Fn(u32) -> T + Sync) -> Vec<T> {
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    let seeds: Vec<u32> = seeds.clone().collect();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let Some(seed) = seeds.get(next.fetch_add(1, Ordering::Relaxed)) else { return done };
            done.push((*seed, trial(*seed)));
        }
    };
    let mut trials: Vec<_> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.min(seeds.len())).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("a trial never panics")).collect()
    });
    trials.sort_by_key(|(seed, _)| *seed);
    trials.into_iter().map(|(_, trial)| trial).collect()
}

impl LocomotionReport {
    /// Returns a line on the settings of the measurement, for below the table.
    pub fn settings(&self) -> String {
        let Sensing { state_estimate, sensors } = self.sensing;
        let (state_estimate, sensors) = (state_estimate.name(), sensors.name());
        format!(
            "robot {}, controller {}, state estimate {state_estimate}, sensors {sensors}",
            self.robot, self.controller
        )
    }
}

fn summarise(case: &Case, trials: &[Trial]) -> CaseReport {
    let standing: Vec<&Trial> = trials.iter().filter(|trial| !trial.fell).collect();
    let worst =
        |value: fn(&Trial) -> Option<f32>| standing.iter().filter_map(|trial| value(trial)).reduce(f32::max);
    let mean = |value: fn(&Trial) -> Option<f32>| {
        let values: Vec<f32> = standing.iter().filter_map(|trial| value(trial)).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f32>() / values.len() as f32)
    };
    CaseReport {
        survived: standing.len(),
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
        ..CaseReport::of(case.name, trials.len())
    }
}

impl CaseReport {
    /// Column heads of [`CaseReport`]'s lines.
    pub const HEAD: &str = "case                        alive  v err  heading    drift     sway   height  \
                            stands  still  steps  pelvis   tilt     load  power";

    /// Creates the report of a case without measurements.
    pub fn of(case: &str, seeds: usize) -> CaseReport {
        CaseReport {
            case: case.into(),
            seeds,
            survived: 0,
            velocity_error_share: None,
            heading_error_deg: None,
            final_drift_m: None,
            sway_m: None,
            height_error_m: None,
            standing_after_s: None,
            still_after_s: None,
            steps: None,
            pelvis_tilt_deg: None,
            load_tilt_deg: None,
            load_drift_m: None,
            power_w: 0.0,
        }
    }
}

impl fmt::Display for CaseReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let show = |value: Option<f32>, scale: f32, unit: &str| {
            value.map_or("-".into(), |value| format!("{:.1}{unit}", value * scale))
        };
        write!(
            f,
            "{:26} {:>2}/{:<2}  {:>5}  {:>7}  {:>7}  {:>7}  {:>7}  \
             {:>6}  {:>5}  {:>5}  {:>6}  {:>5}  {:>7}  {:>5}",
            self.case,
            self.survived,
            self.seeds,
            show(self.velocity_error_share, 100.0, "%"),
            show(self.heading_error_deg, 1.0, "°"),
            show(self.final_drift_m, 100.0, "cm"),
            show(self.sway_m, 100.0, "cm"),
            show(self.height_error_m, 100.0, "cm"),
            show(self.standing_after_s, 1.0, "s"),
            show(self.still_after_s, 1.0, "s"),
            self.steps.map_or("-".into(), |steps| steps.to_string()),
            show(self.pelvis_tilt_deg, 1.0, "°"),
            show(self.load_tilt_deg, 1.0, "°"),
            show(self.load_drift_m, 100.0, "cm"),
            show(Some(self.power_w), 1.0, "W"),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::DEFAULT_ROBOT;
    use crate::body::posed::model;
    use crate::robot::SensorModel;

    #[test]
    fn a_report_says_what_was_measured() {
        let sensing = Sensing { sensors: SensorModel::G1, ..Sensing::TRUTH };
        let report = run(
            DEFAULT_ROBOT,
            model(),
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

    #[test]
    fn quartiles_leave_a_quarter_on_each_side() {
        let mut values = [5.0, 1.0, 4.0, 2.0, 3.0];
        assert_eq!(Spread::of(&mut values), Spread { median: 3.0, quartiles: [2.0, 4.0] });
        assert_eq!(Spread::of(&mut [7.0]), Spread { median: 7.0, quartiles: [7.0, 7.0] });
    }
}
