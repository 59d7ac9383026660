//! `walk`: moves the base while the arms keep their joints. `episodes/src/commands/walk.rs` carries it out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::parts::CommandReply;
use crate::tool::Tool;

/// Walk, turn, change the pelvis height or look around with one or more robots for a number of control steps of 20 ms, while their arms
/// and hands keep their joints and so go along. Velocities are in the robot's own frame and apply during this command only;
/// the height persists.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Walk {
    /// Control steps of 20 ms: 1 up to the budget's steps_per_command.
    #[schemars(range(min = 1), extend("most_steps" = "maximum"))]
    pub steps: u32,
    /// One entry per robot that is to move; each robot at most once. Robots that are not named hold still.
    #[schemars(length(min = 1, max = limits::ROBOT_NAMES.len()), extend("not" = limits::a_robot_twice()))]
    pub robots: Vec<WalkMove>,
}

/// What one robot's base is to do. start_episode names the range of each field; values beyond it are clamped and reported.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("not" = limits::all_of(&[("waist_yaw_rad", "number"), ("look_at_m", "array")])))]
pub struct WalkMove {
    /// The robot, as "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Forward velocity in metres per second, as 0.3.
    pub vx_m_s: f64,
    /// Velocity to the left in metres per second.
    pub vy_m_s: f64,
    /// Turning rate in radians per second, counter-clockwise seen from above.
    pub yaw_rate_rad_s: f64,
    /// Height of the pelvis above the floor in metres, for a robot that stands; while it steps it may be lower.
    /// Null: the target stays.
    pub pelvis_height_m: Option<f64>,
    /// Where the waist is to turn, in radians to the left, at 1 rad/s at most: head and arms turn with it. 0 is straight ahead. Null: it
    /// stays.
    pub waist_yaw_rad: Option<f64>,
    /// A point to turn the head to by the waist, [x, y, z] in the pelvis frame, in place of waist_yaw_rad. Null: none.
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
