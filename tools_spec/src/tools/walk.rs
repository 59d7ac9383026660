//! `walk`: moves the base while the arms keep their joints. `episodes/src/commands/walk.rs` carries it out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::parts::CommandReply;
use crate::tool::Tool;

/// Walk, turn, change the pelvis height or look around for a number of control steps of 20 ms. Arms and
/// hands keep their joints and go along. Velocities are in the robot's own frame and apply during this
/// command; the height persists.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Walk {
    /// 1 up to the budget's steps_per_command.
    #[schemars(range(min = 1), extend("most_steps" = "maximum"))]
    pub steps: u32,
    /// One entry per robot that moves. Others hold still.
    #[schemars(length(min = 1, max = limits::ROBOT_NAMES.len()), extend("not" = limits::a_robot_twice()))]
    pub robots: Vec<WalkMove>,
}

/// Values beyond the briefing's ranges are clamped and reported.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("not" = limits::all_of(&[("waist_yaw_rad", "number"), ("look_at_m", "array")])))]
pub struct WalkMove {
    /// The robot, for example "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Forward velocity, for example 0.3.
    pub vx_m_s: f64,
    /// Velocity to the left.
    pub vy_m_s: f64,
    /// Turning rate, counter-clockwise from above.
    pub yaw_rate_rad_s: f64,
    /// Height above the floor of a robot that stands. Null: unchanged.
    pub pelvis_height_m: Option<f64>,
    /// Waist angle to the left of straight ahead: head and arms turn along, at 1 rad/s. Null: unchanged.
    pub waist_yaw_rad: Option<f64>,
    /// Point [x, y, z] in the pelvis frame to look at: the waist turns and, as far as the picture needs,
    /// bends; arms go along. In place of waist_yaw_rad.
    pub look_at_m: Option<[f64; 3]>,
}

impl WalkMove {
    fn validate(&self) -> Result<(), String> {
        checks::finite("waist_yaw_rad", self.waist_yaw_rad.as_slice())?;
        checks::finite("look_at_m", self.look_at_m.as_ref().map_or(&[], |point_m| &point_m[..]))?;
        if self.waist_yaw_rad.is_some() && self.look_at_m.is_some() {
            return Err("waist_yaw_rad and look_at_m both turn the waist; give one of them".into());
        }
        checks::base([Some(self.vx_m_s), Some(self.vy_m_s), Some(self.yaw_rate_rad_s), self.pelvis_height_m])
    }
}

impl Tool for Walk {
    type Reply = CommandReply;
    const NAME: &'static str = "walk";
    const READ_ONLY: bool = false;

    fn example() -> Self {
        let forward = WalkMove {
            robot: "A".into(),
            vx_m_s: 0.3,
            vy_m_s: 0.0,
            yaw_rate_rad_s: 0.0,
            pelvis_height_m: None,
            waist_yaw_rad: None,
            look_at_m: None,
        };
        Walk { steps: 25, robots: vec![forward] }
    }

    fn robots(&self) -> Vec<&str> {
        self.robots.iter().map(|entry| entry.robot.as_str()).collect()
    }

    fn steps(&self) -> u32 {
        self.steps
    }

    fn validate(&self) -> Result<(), String> {
        checks::steps(self.steps)?;
        checks::robots(&self.robots())?;
        checks::each(&self.robots, |entry| &entry.robot, WalkMove::validate)
    }
}
