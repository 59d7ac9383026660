//! Results of the cases of base controllers.

use std::fmt;

use serde::Serialize;
use tandem_sim::Sensing;

/// Results of all cases.
#[derive(Clone, Debug, Serialize)]
pub struct LocomotionReport {
    /// Name in [`tandem_sim::assets::ROBOTS`], or the name of a file.
    pub robot: String,
    /// Name of the controller in recordings, with its loop, if any.
    pub controller: String,
    #[serde(flatten)]
    pub sensing: Sensing,
    pub cases: Vec<CaseReport>,
}

/// One case over its seeds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CaseReport {
    pub case: String,
    pub seeds: usize,
    pub survived: usize,
    #[serde(flatten)]
    pub figures: CaseFigures,
}

/// Measurements of a trial or of a case. The values of a case are the worst over all robots that did not
/// fall; velocity error and power are means. `None` if not measured in this case.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CaseFigures {
    /// Deviation of the mean velocity, as a share of the command.
    #[serde(rename = "velocity_error")]
    pub velocity_error_share: Option<f32>,
    pub heading_error_deg: Option<f32>,
    pub final_drift_m: Option<f32>,
    pub sway_m: Option<f32>,
    pub height_error_m: Option<f32>,
    /// Time from the zero command until the pelvis stays slower than 0.1 m/s; `still_after_s` is for 0.02
    /// m/s.
    pub standing_after_s: Option<f32>,
    pub still_after_s: Option<f32>,
    /// Number of times that a foot left the ground while the robot was commanded to stand.
    pub steps: Option<u32>,
    /// Largest tilt of the pelvis of a walking robot.
    pub pelvis_tilt_deg: Option<f32>,
    /// Maximum tilt of a load carried by several robots.
    pub load_tilt_deg: Option<f32>,
    /// Horizontal drift of held objects after they came to rest, averaged over each second.
    pub load_drift_m: Option<f32>,
    /// Mean absolute mechanical power of all joints.
    pub power_w: f32,
}

impl LocomotionReport {
    /// Returns a line with the settings of the measurement, to be printed below the table.
    pub fn settings(&self) -> String {
        let Sensing { state_estimate, sensors } = self.sensing;
        let (state_estimate, sensors) = (state_estimate.name(), sensors.name());
        format!(
            "robot {}, controller {}, state estimate {state_estimate}, sensors {sensors}",
            self.robot, self.controller
        )
    }
}

impl CaseReport {
    /// Header of the table whose lines [`CaseReport`] prints.
    pub const HEAD: &str = "case                        alive  v err  heading    drift     sway   height  \
                            stands  still  steps  pelvis   tilt     load  power";
}

impl fmt::Display for CaseReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let show = |value: Option<f32>, scale: f32, unit: &str| {
            value.map_or("-".into(), |value| format!("{:.1}{unit}", value * scale))
        };
        let figures = &self.figures;
        write!(
            f,
            "{:26} {:>2}/{:<2}  {:>5}  {:>7}  {:>7}  {:>7}  {:>7}  \
             {:>6}  {:>5}  {:>5}  {:>6}  {:>5}  {:>7}  {:>5}",
            self.case,
            self.survived,
            self.seeds,
            show(figures.velocity_error_share, 100.0, "%"),
            show(figures.heading_error_deg, 1.0, "°"),
            show(figures.final_drift_m, 100.0, "cm"),
            show(figures.sway_m, 100.0, "cm"),
            show(figures.height_error_m, 100.0, "cm"),
            show(figures.standing_after_s, 1.0, "s"),
            show(figures.still_after_s, 1.0, "s"),
            figures.steps.map_or("-".into(), |steps| steps.to_string()),
            show(figures.pelvis_tilt_deg, 1.0, "°"),
            show(figures.load_tilt_deg, 1.0, "°"),
            show(figures.load_drift_m, 100.0, "cm"),
            show(Some(figures.power_w), 1.0, "W"),
        )
    }
}
