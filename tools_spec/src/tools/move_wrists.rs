//! `move_wrists`: the command of agents that think in poses. `episodes/src/commands/move_wrists.rs` makes wrist and finger
//! trajectories of it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::parts::{CommandReply, PoseFrame};
use crate::tool::Tool;

/// Softer hands would be thrown about by what they feel of their own motion.
const MIN_COMPLIANCE_N_S_M: f64 = 50.0;
const MIN_COMPLIANCE_N_M_S_RAD: f64 = 5.0;

/// Move wrists, fingers and base of one or more robots for a number of control steps of 20 ms. Inverse kinematics turns
/// wrist poses into arm and waist joints. Robots that are not named hold still; a hand without a wrist target keeps its
/// arm's joints, and fingers that are not given keep theirs. The reply says of each wrist and its fingers whether they have
/// arrived, are moving (repeat the command or call wait), are blocked by load or contact, or are out of reach.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("paper" = "Move wrists, fingers and base of one or more robots for a number of control steps of 20 ms. Inverse \
    kinematics turns wrist poses into arm and waist joints. Robots that are not named hold still; a hand without a wrist target keeps \
    its arm's joints, and fingers that are not given keep theirs. The reply says how far each wrist is from its target, where the \
    fingers are, and which joints were moved to a limit or rest at one; a hand that is not there yet goes on when the command is \
    repeated, or by wait."))]
#[serde(deny_unknown_fields)]
pub struct MoveWrists {
    /// Control steps of 20 ms: 1 up to the budget's steps_per_command.
    #[schemars(range(min = 1), extend("most_steps" = "maximum"))]
    pub steps: u32,
    /// One entry per robot that is to move; each robot at most once.
    #[schemars(length(min = 1, max = limits::ROBOT_NAMES.len()), extend("not" = limits::a_robot_twice()))]
    pub robots: Vec<WristMove>,
}

/// What one robot is to do. Wrist poses are of the links `left_wrist_yaw_link` and `right_wrist_yaw_link` in the robot's
/// own pelvis frame as it is when the command begins: x forward, y left, z up, metres. From then on they are fixed in the
/// world: a robot that walks or sways does not take its hands along, unless `carried` is true. The fingers point along a
/// wrist's x axis; the right palm faces along its y axis, the left palm against it, so that with [1, 0, 0, 0] the fingers
/// point forward and the palms face each other. A hand closes on what lies 0.12 m along x and 0.055 m before its palm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("hint" = "To grasp an upright bottle from the side with [1, 0, 0, 0], open the thumb, bring the right wrist \
    to [-0.12, -0.135, 0] from the bottle's axis, then to [-0.12, -0.055, 0], palm first, then close the fingers."))]
#[serde(deny_unknown_fields)]
pub struct WristMove {
    /// The robot, as "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Left wrist position [x, y, z] in metres, as [0.30, 0.20, 0.10]. Null: it stays where it is to be; without an orientation
    /// either, the arm keeps its joints.
    pub left_position_m: Option<[f64; 3]>,
    /// Left wrist orientation [w, x, y, z], as [1, 0, 0, 0]. Null: it stays as it is to be turned; without a position either, the
    /// arm keeps its joints.
    #[schemars(extend("contains" = limits::direction()))]
    pub left_quaternion_wxyz: Option<[f64; 4]>,
    /// Right wrist position [x, y, z] in metres, as [0.30, -0.20, 0.10]. Null: it stays where it is to be; without an orientation
    /// either, the arm keeps its joints.
    pub right_position_m: Option<[f64; 3]>,
    /// Right wrist orientation [w, x, y, z], as [1, 0, 0, 0]. Null: it stays as it is to be turned; without a position either,
    /// the arm keeps its joints.
    #[schemars(extend("contains" = limits::direction()))]
    pub right_quaternion_wxyz: Option<[f64; 4]>,
    /// The frame of the wrist poses of this entry: "pelvis"; "level", upright in the pelvis; or "start", which stays in the room while
    /// the robot moves: in it a target may be sent again and again without moving with a pelvis that was pushed. Null: "pelvis".
    #[schemars(extend("full_only" = true, "default" = PoseFrame::Pelvis))]
    pub frame: Option<PoseFrame>,
    /// True: the wrist targets move with the pelvis from the command's beginning on, as a robot that carries something wants
    /// it. False or null: they are fixed in the world.
    #[schemars(extend("default" = false))]
    pub carried: Option<bool>,
    /// True: the waist stays as it is and the arms alone reach, so that the camera keeps its view; until the next command for this robot.
    /// False or null: the waist turns and leans where the arms do not suffice.
    #[schemars(extend("full_only" = true, "default" = false))]
    pub keep_waist: Option<bool>,
    /// True: hands stop, as "out_of_reach", before they are so far ahead that the robot would have to step (check_reach: needs_a_step);
    /// until the next command for this robot. False or null: it steps.
    #[schemars(extend("full_only" = true, "default" = false))]
    pub stand_fast: Option<bool>,
    /// How both hands give way to what pulls or pushes them along the way that the robot faces, as a partner at the other end of
    /// a load does: at 1 m/s under as many newtons, up to 6 cm. 250 suits two robots that walk with a load; at least 50.
    /// Null: hands keep to their targets.
    #[schemars(range(min = MIN_COMPLIANCE_N_S_M))]
    pub compliance_n_s_m: Option<f64>,
    /// How both hands together give way to what pulls or pushes them to the robot's left or right, as a partner who sways does: at
    /// 1 m/s under as many newtons, up to 6 cm; at least 50. Null: not to the sides.
    #[schemars(range(min = MIN_COMPLIANCE_N_S_M))]
    pub side_compliance_n_s_m: Option<f64>,
    /// How both hands together give way to what turns them about the vertical through the middle between the wrists: at 1 rad/s under
    /// as many newton metres, up to 0.15 rad; at least 5. Null: they do not turn.
    #[schemars(range(min = MIN_COMPLIANCE_N_M_S_RAD))]
    pub turn_compliance_n_m_s_rad: Option<f64>,
    /// Left finger joint angles in radians: [thumb_0, thumb_1, thumb_2, middle_0, middle_1, index_0, index_1]. Positive angles
    /// close thumb_1 and thumb_2, negative ones middle and index. Null: the target stays.
    #[schemars(extend("hint" = "Closed around a bottle: [0, 0.75, 0.8, -1.1, -1.3, -1.1, -1.3]; open: [0, -0.3, 0, 0, 0, 0, 0]."))]
    pub left_fingers_rad: Option<[f64; 7]>,
    /// Right finger joint angles in radians: [thumb_0, thumb_1, thumb_2, middle_0, middle_1, index_0, index_1]. Negative angles
    /// close thumb_1 and thumb_2, positive ones middle and index. Null: the target stays.
    #[schemars(extend("hint" = "Closed around a bottle: [0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3]; open: [0, 0.3, 0, 0, 0, 0, 0]."))]
    pub right_fingers_rad: Option<[f64; 7]>,
    /// Forward velocity in metres per second during this command. Null: 0.
    #[schemars(extend("default" = 0))]
    pub vx_m_s: Option<f64>,
    /// Velocity to the left in metres per second during this command. Null: 0.
    #[schemars(extend("default" = 0))]
    pub vy_m_s: Option<f64>,
    /// Turning rate in radians per second during this command, counter-clockwise seen from above. Null: 0.
    #[schemars(extend("default" = 0))]
    pub yaw_rate_rad_s: Option<f64>,
    /// Height of the pelvis above the floor in metres, for a robot that stands; while it steps it may be lower.
    /// Null: the target stays.
    pub pelvis_height_m: Option<f64>,
}

impl WristMove {
    /// A move of `robot` that keeps every target and does not walk.
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
                    "{name} is {soft}; give at least {least}, as {common}, or null for hands that do not give way"
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
