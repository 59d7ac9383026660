//! The published order of joints and of the action row.

use crate::{Side, Sides};

/// Number of joints of the robot, in published order.
pub const JOINTS: usize = 43;
/// Number of joints that a task commands: arms 14, hands 14, waist 3.
pub const UPPER_JOINTS: usize = 31;
pub(crate) const LEG_JOINTS: usize = 6;
pub const WAIST_JOINTS: usize = 3;
pub const ARM_JOINTS: usize = 7;
pub const HAND_JOINTS: usize = 7;
/// Number of thumb joints, which are the first of a hand.
pub(crate) const THUMB_JOINTS: usize = 3;

/// First joint of each group in published order: left leg, right leg, waist, left arm, left hand, right
/// arm, right hand.
pub const LEGS: Sides<usize> = Sides { left: 0, right: 6 };
pub(crate) const WAIST: usize = 12;
pub const ARMS: Sides<usize> = Sides { left: 15, right: 29 };
pub(crate) const HANDS: Sides<usize> = Sides { left: 22, right: 36 };

/// First joint of each group in action order: left arm, right arm, left hand, right hand, waist.
pub const ARM_COLUMNS: Sides<usize> = Sides { left: 0, right: 7 };
pub const HAND_COLUMNS: Sides<usize> = Sides { left: 14, right: 21 };
pub const WAIST_COLUMN: usize = 28;

const LEG_NAMES: [&str; LEG_JOINTS] =
    ["hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll"];
const WAIST_NAMES: [&str; WAIST_JOINTS] = ["waist_yaw", "waist_roll", "waist_pitch"];
const ARM_NAMES: [&str; ARM_JOINTS] =
    ["shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll", "wrist_pitch", "wrist_yaw"];
/// True for the roll and yaw joints, which turn in opposite directions on the right and left arms.
pub const MIRRORED_ARM: [bool; ARM_JOINTS] = [false, true, true, false, true, false, true];
const HAND_NAMES: [&str; HAND_JOINTS] = [
    "hand_thumb_0",
    "hand_thumb_1",
    "hand_thumb_2",
    "hand_middle_0",
    "hand_middle_1",
    "hand_index_0",
    "hand_index_1",
];

/// Returns the names of the 43 joints in published order.
pub fn joint_names() -> [String; JOINTS] {
    let limb = |side: Side, joints: &'static [&'static str]| {
        joints.iter().map(move |joint| format!("{}_{joint}_joint", side.name()))
    };
    let mut names = limb(Side::Left, &LEG_NAMES)
        .chain(limb(Side::Right, &LEG_NAMES))
        .chain(WAIST_NAMES.iter().map(|joint| format!("{joint}_joint")))
        .chain(limb(Side::Left, &ARM_NAMES))
        .chain(limb(Side::Left, &HAND_NAMES))
        .chain(limb(Side::Right, &ARM_NAMES))
        .chain(limb(Side::Right, &HAND_NAMES));
    std::array::from_fn(|_| names.next().unwrap_or_default())
}

/// Index in published order of each of the 31 commanded joints, in action order: left_arm 7, right_arm
/// 7, left_hand 7, right_hand 7, waist 3.
pub const UPPER: [usize; UPPER_JOINTS] = {
    let mut order = [0; UPPER_JOINTS];
    let mut i = 0;
    while i < ARM_JOINTS {
        order[ARM_COLUMNS.left + i] = ARMS.left + i;
        order[ARM_COLUMNS.right + i] = ARMS.right + i;
        i += 1;
    }
    i = 0;
    while i < HAND_JOINTS {
        order[HAND_COLUMNS.left + i] = HANDS.left + i;
        order[HAND_COLUMNS.right + i] = HANDS.right + i;
        i += 1;
    }
    i = WAIST_COLUMN;
    while i < UPPER_JOINTS {
        order[i] = WAIST + i - WAIST_COLUMN;
        i += 1;
    }
    order
};
