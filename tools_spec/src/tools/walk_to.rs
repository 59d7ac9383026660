//! `walk_to`: walks to a place by the robot's own odometry. `episodes/src/session/plan/` carries it out as a
//! sequence of commands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::parts::{PlanReply, PoseFrame};
use crate::tool::Tool;

/// Maximum number of control steps of one call: half a minute.
const MAX_STEPS: u32 = 1500;
/// Maximum number of waypoints of a robot.
const MAX_WAYPOINTS: usize = 10;

/// Walk to places by odometry; arms go along, or push and carry with `carry`. Short commands, each a tool
/// call, take every robot to within 1.5 cm and 1.5 degrees of its place, unless one gets no nearer or
/// steps run out. It does not look: go round obstacles by `waypoints`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WalkTo {
    /// Most steps, up to 1500: about 300, 170 a metre and 250 a quarter turn; with `carry` 300, 270 and 220.
    #[schemars(range(min = 1, max = MAX_STEPS))]
    pub steps: u32,
    /// Frame of places and headings.
    #[serde(default = "start_frame", skip_serializing_if = "is_start_frame")]
    #[schemars(extend("default" = PoseFrame::Start))]
    pub frame: PoseFrame,
    /// One entry per robot that walks.
    #[schemars(length(min = 1, max = limits::ROBOT_NAMES.len()), extend("not" = limits::a_robot_twice()))]
    pub robots: Vec<Destination>,
    /// True: words of another operator end it; with `carry` the robot comes to rest first.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("for_operators" = true, "default" = false))]
    pub until_heard: bool,
}

fn start_frame() -> PoseFrame {
    PoseFrame::Start
}

fn is_start_frame(frame: &PoseFrame) -> bool {
    *frame == PoseFrame::Start
}

/// A place to come to rest at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Destination {
    /// The robot, for example "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// [x, y] of the pelvis.
    pub to_m: [f64; 2],
    /// Final heading, counter-clockwise from the frame's x. Null: unchanged.
    pub heading_rad: Option<f64>,
    /// Places to pass in order, without a stop. Robots that carry together need equally many.
    #[schemars(length(max = MAX_WAYPOINTS))]
    pub waypoints: Option<Vec<Waypoint>>,
    /// True: to push or carry, wrists keep their places to the robot and their height. Robots that carry in
    /// one call go together at 0.2 m/s and give way to each other (compliance_n_s_m 250); all stop where
    /// one lags or a wrist is out of reach.
    #[schemars(extend("default" = false))]
    pub carry: Option<bool>,
}

/// A place to pass within 10 cm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// [x, y].
    pub at_m: [f64; 2],
    /// Heading there. Null: unchanged.
    pub heading_rad: Option<f64>,
}

impl WalkTo {
    /// Returns true if a robot carries or pushes a load.
    pub fn carries(&self) -> bool {
        self.robots.iter().any(|entry| entry.carry == Some(true))
    }
}

impl Tool for WalkTo {
    type Reply = PlanReply;
    const NAME: &'static str = "walk_to";
    const READ_ONLY: bool = false;
    const FULL_ONLY: bool = true;

    fn example() -> Self {
        WalkTo {
            steps: 500,
            frame: PoseFrame::Start,
            robots: vec![Destination {
                robot: "A".into(),
                to_m: [-0.2, 0.1],
                heading_rad: Some(0.0),
                waypoints: None,
                carry: None,
            }],
            until_heard: false,
        }
    }

    fn robots(&self) -> Vec<&str> {
        self.robots.iter().map(|entry| entry.robot.as_str()).collect()
    }

    fn validate(&self) -> Result<(), String> {
        if !(1..=MAX_STEPS).contains(&self.steps) {
            return Err(format!("steps is {}; give 1 to {MAX_STEPS}, for example 500", self.steps));
        }
        checks::robots(&self.robots())?;
        checks::each(
            &self.robots,
            |entry| &entry.robot,
            |entry| {
                checks::finite("to_m", &entry.to_m)?;
                checks::finite("heading_rad", entry.heading_rad.as_slice())?;
                let waypoints = entry.waypoints.as_deref().unwrap_or_default();
                if waypoints.len() > MAX_WAYPOINTS {
                    return Err(format!("{} waypoints; give {MAX_WAYPOINTS} at most", waypoints.len()));
                }
                waypoints.iter().try_for_each(|waypoint| {
                    checks::finite("at_m", &waypoint.at_m)?;
                    checks::finite("heading_rad", waypoint.heading_rad.as_slice())
                })
            },
        )?;
        let waypoints = |entry: &Destination| entry.waypoints.as_ref().map_or(0, Vec::len);
        let as_many = self.robots.iter().all(|entry| waypoints(entry) == waypoints(&self.robots[0]));
        match self.robots.iter().any(|entry| entry.carry == Some(true)) && !as_many {
            true => {
                Err("robots of one call that carry go by their waypoints together; give each as many".into())
            }
            false => Ok(()),
        }
    }
}
