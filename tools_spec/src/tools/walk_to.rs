//! `walk_to`: walks to a place by the robot's own odometry. `episodes/src/session/plan/` carries it out as a row of commands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::tool::Tool;
use crate::tools::PlanReply;

/// The most control steps of one call: thirty seconds.
const MOST_STEPS: u32 = 1500;

/// Walk to places in the start frame, looking at odometry on the way: arms keep their joints and go along, or push and carry with `carry`.
/// It is carried out as short commands, each recorded and counted as a tool call, until every robot stands within 4 cm and 0.05 rad of
/// its place (15 cm and 0.1 rad where it carries, its hands nearer), one gets no nearer, or the steps are used up. It walks straight and looks at nothing:
/// go round what stands in the way by places in between.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WalkTo {
    /// The most control steps of 20 ms to take, up to 1500. A way takes about 120, and 250 a metre and 150 a quarter turn; where robots carry, 450 a metre.
    #[schemars(range(min = 1, max = MOST_STEPS))]
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
    /// Which way it is to face, in radians counter-clockwise from how it faced at the start. Null: as it faces now.
    pub heading_rad: Option<f64>,
    /// True: it pushes or carries what its hands hold. Wrists stay where they are to it and as high over the floor though its pelvis sinks
    /// as it walks, and lead it by what it lags, up to 20 cm. Robots of one call that carry go at one pace of 0.2 m/s and give way to each other
    /// (compliance_n_s_m 250), so that several carry one load: give each its place in its own start frame. Null: false.
    #[schemars(extend("default" = false))]
    pub carry: Option<bool>,
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
                carry: None,
            }],
        }
    }

    fn robots(&self) -> Vec<&str> {
        self.robots.iter().map(|entry| entry.robot.as_str()).collect()
    }

    fn validate(&self) -> Result<(), String> {
        if !(1..=MOST_STEPS).contains(&self.steps) {
            return Err(format!("steps is {}; give 1 to {MOST_STEPS}, as 500", self.steps));
        }
        checks::robots(&self.robots())?;
        checks::each(
            &self.robots,
            |entry| &entry.robot,
            |entry| {
                checks::finite("to_m", &entry.to_m)?;
                checks::finite("heading_rad", entry.heading_rad.as_slice())
            },
        )
    }
}
