//! `walk_to`: walks to a place by the robot's own odometry. `episodes/src/session/plan/` carries it out as a row of commands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::tool::Tool;
use crate::tools::PlanReply;

/// The most control steps of one call: thirty seconds.
const MAX_STEPS: u32 = 1500;
/// The most waypoints of a robot.
const MAX_WAYPOINTS: usize = 10;

/// Walk to places in the start frame, looking at odometry on the way: arms keep their joints and go along, or push and carry with `carry`.
/// It is carried out as short commands, each recorded and counted as a tool call, until every robot stands within 1.5 cm and 1.5 degrees of
/// its place, one gets no nearer, or the steps are used up. It walks straight and looks at nothing: go round what stands in the way by
/// `waypoints`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WalkTo {
    /// The most control steps of 20 ms to take, up to 1500. A way takes about 120, and 250 a metre and 150 a quarter turn; where robots carry, 450 a metre.
    #[schemars(range(min = 1, max = MAX_STEPS))]
    pub steps: u32,
    /// One entry per robot that is to walk; each robot at most once. Robots that are not named hold still.
    #[schemars(length(min = 1, max = limits::ROBOT_NAMES.len()), extend("not" = limits::a_robot_twice()))]
    pub robots: Vec<Destination>,
}

/// Where one robot's pelvis is to come to rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Destination {
    /// The robot, as "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// [x, y] in metres in the robot's own start frame, as pelvis_in_start has it.
    pub to_m: [f64; 2],
    /// Which way it is to face, in radians counter-clockwise from how it faced at the start. Null: as it faces now, or at the last waypoint.
    pub heading_rad: Option<f64>,
    /// Places to go by on the way, in order, without a stop. Robots of one call that carry have as many waypoints as each other, and go by
    /// them together. Null: none.
    #[schemars(length(max = MAX_WAYPOINTS))]
    pub waypoints: Option<Vec<Waypoint>>,
    /// True: it pushes or carries what its hands hold. Wrists stay where they are to it and as high over the floor though its pelvis sinks
    /// as it walks, and lead it by what it lags. Robots of one call that carry go at one pace of 0.2 m/s and give way to each other
    /// (compliance_n_s_m 250), so that several carry one load: give each its place in its own start frame. All slow down and stop where one
    /// lags by 18 cm, is turned away by 0.2 rad, or a wrist is out of reach. Null: false.
    #[schemars(extend("default" = false))]
    pub carry: Option<bool>,
}

/// A place that a robot's pelvis is to go by, within 10 cm or so.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// [x, y] in metres in the robot's own start frame.
    pub at_m: [f64; 2],
    /// Which way it is to face there, as the place's. Null: as before.
    pub heading_rad: Option<f64>,
}

impl Tool for WalkTo {
    type Reply = PlanReply;
    const NAME: &'static str = "walk_to";
    const READ_ONLY: bool = false;
    const FULL_ONLY: bool = true;

    fn example() -> Self {
        WalkTo {
            steps: 500,
            robots: vec![Destination {
                robot: "A".into(),
                to_m: [-0.2, 0.1],
                heading_rad: Some(0.0),
                waypoints: None,
                carry: None,
            }],
        }
    }

    fn robots(&self) -> Vec<&str> {
        self.robots.iter().map(|entry| entry.robot.as_str()).collect()
    }

    fn validate(&self) -> Result<(), String> {
        if !(1..=MAX_STEPS).contains(&self.steps) {
            return Err(format!("steps is {}; give 1 to {MAX_STEPS}, as 500", self.steps));
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
