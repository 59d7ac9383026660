//! `check_reach`: tests without motion whether the arms could reach poses.
//! `episodes/src/commands/check_reach.rs` answers it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::parts::PoseFrame;
use crate::tool::Tool;

/// Ask whether wrists could reach poses, as in move_wrists, from the robot's place, with the waist and the
/// arms that are given a pose. Nothing moves; costs no steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("allOf" = limits::at_least_one(&POSES)))]
#[serde(deny_unknown_fields)]
pub struct CheckReach {
    /// The robot, for example "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Left wrist [x, y, z]. Null: the present target.
    pub left_position_m: Option<[f64; 3]>,
    /// Left wrist orientation.
    #[schemars(extend("contains" = limits::direction()))]
    pub left_quaternion_wxyz: Option<[f64; 4]>,
    /// Right wrist.
    pub right_position_m: Option<[f64; 3]>,
    /// Right wrist orientation.
    #[schemars(extend("contains" = limits::direction()))]
    pub right_quaternion_wxyz: Option<[f64; 4]>,
    /// Frame of the poses.
    #[schemars(extend("full_only" = true, "default" = PoseFrame::Pelvis))]
    pub frame: Option<PoseFrame>,
    /// True: the waist stays fixed.
    #[schemars(extend("full_only" = true, "default" = false))]
    pub keep_waist: Option<bool>,
}

/// Fields of which at least one is required.
const POSES: [&str; 4] =
    ["left_position_m", "left_quaternion_wxyz", "right_position_m", "right_quaternion_wxyz"];

impl Tool for CheckReach {
    type Reply = ReachReply;
    const NAME: &'static str = "check_reach";
    const READ_ONLY: bool = true;

    fn example() -> Self {
        CheckReach {
            robot: "A".into(),
            left_position_m: None,
            left_quaternion_wxyz: None,
            right_position_m: Some([0.30, -0.20, 0.10]),
            right_quaternion_wxyz: Some([1.0, 0.0, 0.0, 0.0]),
            frame: None,
            keep_waist: None,
        }
    }

    fn robots(&self) -> Vec<&str> {
        vec![&self.robot]
    }

    fn validate(&self) -> Result<(), String> {
        let poses = [
            ("left", self.left_position_m, self.left_quaternion_wxyz),
            ("right", self.right_position_m, self.right_quaternion_wxyz),
        ];
        if poses.iter().all(|(_, position_m, quaternion)| position_m.is_none() && quaternion.is_none()) {
            return Err(
                "no pose is given; give at least one, for example \"right_position_m\": [0.30, -0.20, 0.10]"
                    .into(),
            );
        }
        poses.iter().try_for_each(|(side, position_m, quaternion_wxyz)| {
            checks::pose(side, position_m.as_ref(), quaternion_wxyz.as_ref())
        })
    }
}

/// The reply to `check_reach`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReachReply {
    /// The robot that was asked about.
    pub robot: String,
    /// True if every wrist that was given a pose reaches it, both at once if both were.
    pub reachable: bool,
    /// Nearest approach of the left wrist; null if it was given no pose.
    pub left: Option<HandReach>,
    /// Nearest approach of the right wrist; null if it was given no pose.
    pub right: Option<HandReach>,
    /// True if the robot would probably step for balance with its arms so far ahead: walk nearer instead.
    /// Left out otherwise, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "is_false")]
    pub needs_a_step: bool,
    /// Names of the waist and arm joints that would be at a limit, which keeps the wrists from coming nearer.
    pub joints_at_limit: Vec<String>,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

/// Nearest approach of one wrist to a pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HandReach {
    /// True if it comes within 5 mm and 0.05 rad.
    pub reachable: bool,
    /// Position error in metres.
    pub position_error_m: f64,
    /// Angle error in radians.
    pub orientation_error_rad: f64,
}
