//! The published order of joints and of the action row.

use super::RobotModel;
use crate::SimError;

/// Which hand or arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Side {
    Left,
    Right,
}

impl Side {
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    pub fn index(self) -> usize {
        self as usize
    }

    pub fn other(self) -> Side {
        if self == Side::Left { Side::Right } else { Side::Left }
    }

    /// Prefix of link, joint and site names.
    pub fn name(self) -> &'static str {
        ["left", "right"][self.index()]
    }
}

/// Joints of the robot in published order.
pub const JOINTS: usize = 43;
/// Joints a task commands: arms 14, hands 14, waist 3.
pub const UPPER_JOINTS: usize = 31;
/// First joint of each group in published order: left_leg, right_leg, waist, left_arm, left_hand, right_arm, right_hand.
const LEFT_LEG: usize = 0;
const RIGHT_LEG: usize = 6;
pub(crate) const WAIST: usize = 12;
const LEFT_ARM: usize = 15;
const LEFT_HAND: usize = 22;
const RIGHT_ARM: usize = 29;
const RIGHT_HAND: usize = 36;

const LEG_JOINTS: [&str; 6] = ["hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll"];
const WAIST_JOINTS: [&str; 3] = ["waist_yaw", "waist_roll", "waist_pitch"];
const ARM_JOINTS: [&str; 7] =
    ["shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll", "wrist_pitch", "wrist_yaw"];
const HAND_JOINTS: [&str; 7] = [
    "hand_thumb_0",
    "hand_thumb_1",
    "hand_thumb_2",
    "hand_middle_0",
    "hand_middle_1",
    "hand_index_0",
    "hand_index_1",
];

/// Names of the 43 joints in published order.
pub fn joint_names() -> [String; JOINTS] {
    let limb = |side: Side, joints: &'static [&'static str]| {
        joints.iter().map(move |joint| format!("{}_{joint}_joint", side.name()))
    };
    let mut names = limb(Side::Left, &LEG_JOINTS)
        .chain(limb(Side::Right, &LEG_JOINTS))
        .chain(WAIST_JOINTS.iter().map(|joint| format!("{joint}_joint")))
        .chain(limb(Side::Left, &ARM_JOINTS))
        .chain(limb(Side::Left, &HAND_JOINTS))
        .chain(limb(Side::Right, &ARM_JOINTS))
        .chain(limb(Side::Right, &HAND_JOINTS));
    std::array::from_fn(|_| names.next().unwrap_or_default())
}

/// Index in published order of each of the 31 commanded joints, in action order:
/// left_arm 7, right_arm 7, left_hand 7, right_hand 7, waist 3.
pub const UPPER: [usize; UPPER_JOINTS] = {
    let mut order = [0; UPPER_JOINTS];
    let mut i = 0;
    while i < 7 {
        order[i] = LEFT_ARM + i;
        order[7 + i] = RIGHT_ARM + i;
        order[14 + i] = LEFT_HAND + i;
        order[21 + i] = RIGHT_HAND + i;
        i += 1;
    }
    order[28] = WAIST;
    order[29] = WAIST + 1;
    order[30] = WAIST + 2;
    order
};

/// First joint of a leg in published order.
pub(crate) const LEGS: [usize; 2] = [LEFT_LEG, RIGHT_LEG];
/// First joint of an arm in published order.
pub(crate) const ARMS: [usize; 2] = [LEFT_ARM, RIGHT_ARM];
pub(crate) const LEG_JOINT_COUNT: usize = 6;
pub(crate) const ARM_JOINT_COUNT: usize = 7;

/// Fails unless a robot file's actuators are the published joints in the published order.
pub(super) fn check(file: &str, model: &RobotModel) -> Result<(), SimError> {
    let have: Vec<&str> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
    if have == joint_names() {
        return Ok(());
    }
    let expected = joint_names().join(", ");
    let what = format!("actuators must be these joints in this order: {expected}");
    Err(SimError::Unsupported { file: file.into(), what })
}
