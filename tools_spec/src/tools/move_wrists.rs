//! `move_wrists`: the command for agents that specify wrist poses. `episodes/src/commands/move_wrists.rs`
//! converts it to wrist and finger trajectories.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::parts::{CommandReply, PoseFrame};
use crate::tool::Tool;

/// Softer hands would be moved by the forces that they sense from their own motion.
const MIN_COMPLIANCE_N_S_M: f64 = 50.0;
const MIN_COMPLIANCE_N_M_S_RAD: f64 = 5.0;

/// Move wrists, fingers and base for a number of control steps of 20 ms; inverse kinematics finds arm and
/// waist joints. Robots that are not named hold still; arms and fingers without targets keep their joints.
/// The reply says whether each wrist has arrived, is moving (repeat or wait), is blocked by load or
/// contact, or is out of reach.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("paper" = "Move wrists, fingers and base of one or more robots for a number of control steps of 20 ms. Inverse \
    kinematics turns wrist poses into arm and waist joints. Robots that are not named hold still; a hand without a wrist target keeps \
    its arm's joints, and fingers that are not given keep theirs. The reply says how far each wrist is from its target, where the \
    fingers are, and which joints were moved to a limit or rest at one; a hand that is not there yet goes on when the command is \
    repeated, or by wait."))]
#[serde(deny_unknown_fields)]
pub struct MoveWrists {
    /// 1 up to the budget's steps_per_command.
    #[schemars(range(min = 1), extend("most_steps" = "maximum"))]
    pub steps: u32,
    /// One entry per robot that moves.
    #[schemars(length(min = 1, max = limits::ROBOT_NAMES.len()), extend("not" = limits::a_robot_twice()))]
    pub robots: Vec<WristMove>,
}

/// Wrist poses are of the links `left_wrist_yaw_link` and `right_wrist_yaw_link` in the pelvis frame at the
/// start of the command (x forward, y left, z up, metres), and then fixed in the world unless `carried`.
/// Fingers point along a wrist's x; the right palm faces along its y, the left palm against it. A hand
/// closes on what is 0.12 m along x and 0.055 m before its palm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WristMove {
    /// The robot, for example "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Left wrist [x, y, z], for example [0.30, 0.20, 0.10]. Null: unchanged.
    pub left_position_m: Option<[f64; 3]>,
    /// Left wrist orientation; [1, 0, 0, 0]: fingers forward, palm inwards. Null: unchanged.
    #[schemars(extend("contains" = limits::direction()))]
    pub left_quaternion_wxyz: Option<[f64; 4]>,
    /// Right wrist, for example [0.30, -0.20, 0.10].
    pub right_position_m: Option<[f64; 3]>,
    /// Right wrist orientation.
    #[schemars(extend("contains" = limits::direction()))]
    pub right_quaternion_wxyz: Option<[f64; 4]>,
    /// Frame of the poses. "level": the pelvis frame, but upright; "start", "room": fixed in the room, for
    /// targets that are repeated.
    #[schemars(extend("full_only" = true, "default" = PoseFrame::Pelvis))]
    pub frame: Option<PoseFrame>,
    /// True: targets move with the pelvis, to carry something.
    #[schemars(extend("default" = false))]
    pub carried: Option<bool>,
    /// True: the waist and so the camera stay; arms alone reach.
    #[schemars(extend("full_only" = true, "default" = false))]
    pub keep_waist: Option<bool>,
    /// True: hands stop, "out_of_reach", before the robot would have to step.
    #[schemars(extend("full_only" = true, "default" = false))]
    pub stand_fast: Option<bool>,
    /// Hands give way to pulls and pushes forward or back: at 1 m/s under this force in newtons, up to 6
    /// cm. At least 50; 250 to carry together.
    #[schemars(range(min = MIN_COMPLIANCE_N_S_M))]
    pub compliance_n_s_m: Option<f64>,
    /// The same to the sides.
    #[schemars(range(min = MIN_COMPLIANCE_N_S_M))]
    pub side_compliance_n_s_m: Option<f64>,
    /// The same about the vertical between the wrists: at 1 rad/s under this torque in N m. At least 5.
    #[schemars(range(min = MIN_COMPLIANCE_N_M_S_RAD))]
    pub turn_compliance_n_m_s_rad: Option<f64>,
    /// Left fingers [thumb_0, thumb_1, thumb_2, middle_0, middle_1, index_0, index_1]: positive angles
    /// close thumb_1 and thumb_2, negative ones middle and index. Null: unchanged.
    pub left_fingers_rad: Option<[f64; 7]>,
    /// Right fingers, with opposite signs.
    pub right_fingers_rad: Option<[f64; 7]>,
    /// Forward velocity during this command.
    #[schemars(extend("default" = 0))]
    pub vx_m_s: Option<f64>,
    /// Velocity to the left.
    #[schemars(extend("default" = 0))]
    pub vy_m_s: Option<f64>,
    /// Turning rate, counter-clockwise from above.
    #[schemars(extend("default" = 0))]
    pub yaw_rate_rad_s: Option<f64>,
    /// Height above the floor of a robot that stands. Null: unchanged.
    pub pelvis_height_m: Option<f64>,
}

impl WristMove {
    /// Returns a move of `robot` that keeps all targets and does not walk.
    pub fn hold(robot: &str) -> WristMove {
        WristMove {
            robot: robot.into(),
            left_position_m: None,
            left_quaternion_wxyz: None,
            right_position_m: None,
            right_quaternion_wxyz: None,
            frame: None,
            carried: None,
            keep_waist: None,
            stand_fast: None,
            compliance_n_s_m: None,
            side_compliance_n_s_m: None,
            turn_compliance_n_m_s_rad: None,
            left_fingers_rad: None,
            right_fingers_rad: None,
            vx_m_s: None,
            vy_m_s: None,
            yaw_rate_rad_s: None,
            pelvis_height_m: None,
        }
    }

    fn validate(&self) -> Result<(), String> {
        checks::pose("left", self.left_position_m.as_ref(), self.left_quaternion_wxyz.as_ref())?;
        checks::pose("right", self.right_position_m.as_ref(), self.right_quaternion_wxyz.as_ref())?;
        checks::finite(
            "left_fingers_rad",
            self.left_fingers_rad.as_ref().map_or(&[], |fingers| &fingers[..]),
        )?;
        checks::finite(
            "right_fingers_rad",
            self.right_fingers_rad.as_ref().map_or(&[], |fingers| &fingers[..]),
        )?;
        for (name, given, least, common) in [
            ("compliance_n_s_m", self.compliance_n_s_m, MIN_COMPLIANCE_N_S_M, 250),
            ("side_compliance_n_s_m", self.side_compliance_n_s_m, MIN_COMPLIANCE_N_S_M, 500),
            ("turn_compliance_n_m_s_rad", self.turn_compliance_n_m_s_rad, MIN_COMPLIANCE_N_M_S_RAD, 40),
        ] {
            checks::finite(name, given.as_slice())?;
            if let Some(soft) = given.filter(|given| *given < least) {
                return Err(format!(
                    "{name} is {soft}; give at least {least}, for example {common}, or null for hands that do not give way"
                ));
            }
        }
        checks::base([self.vx_m_s, self.vy_m_s, self.yaw_rate_rad_s, self.pelvis_height_m])
    }
}

impl Tool for MoveWrists {
    type Reply = CommandReply;
    const NAME: &'static str = "move_wrists";
    const READ_ONLY: bool = false;

    fn example() -> Self {
        let right = WristMove {
            right_position_m: Some([0.30, -0.20, 0.10]),
            right_quaternion_wxyz: Some([1.0, 0.0, 0.0, 0.0]),
            ..WristMove::hold("A")
        };
        MoveWrists { steps: 25, robots: vec![right] }
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
        checks::each(&self.robots, |entry| &entry.robot, WristMove::validate)
    }
}
