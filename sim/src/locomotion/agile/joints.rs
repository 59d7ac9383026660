//! The order in which a velocity policy observes and drives joints.

use crate::body::joint_names;

pub(super) const OBSERVED_JOINTS: usize = 29;
pub(super) const CONTROLLED_JOINTS: usize = 14;

/// Joints of `joint_pos` and `joint_vel`, without `_joint`: every joint except those of the hands,
/// breadth first.
pub(super) const OBSERVED: [&str; OBSERVED_JOINTS] = [
    "left_hip_pitch",
    "right_hip_pitch",
    "waist_yaw",
    "left_hip_roll",
    "right_hip_roll",
    "waist_roll",
    "left_hip_yaw",
    "right_hip_yaw",
    "waist_pitch",
    "left_knee",
    "right_knee",
    "left_shoulder_pitch",
    "right_shoulder_pitch",
    "left_ankle_pitch",
    "right_ankle_pitch",
    "left_shoulder_roll",
    "right_shoulder_roll",
    "left_ankle_roll",
    "right_ankle_roll",
    "left_shoulder_yaw",
    "right_shoulder_yaw",
    "left_elbow",
    "right_elbow",
    "left_wrist_roll",
    "right_wrist_roll",
    "left_wrist_pitch",
    "right_wrist_pitch",
    "left_wrist_yaw",
    "right_wrist_yaw",
];

/// Joints of the actions: all joints of the legs, and the waist's roll and pitch.
pub(super) const CONTROLLED: [&str; CONTROLLED_JOINTS] = [
    "left_hip_pitch",
    "right_hip_pitch",
    "left_hip_roll",
    "right_hip_roll",
    "waist_roll",
    "left_hip_yaw",
    "right_hip_yaw",
    "waist_pitch",
    "left_knee",
    "right_knee",
    "left_ankle_pitch",
    "right_ankle_pitch",
    "left_ankle_roll",
    "right_ankle_roll",
];

/// Indices of the policy's joints in published order.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointMap {
    pub observed: [usize; OBSERVED_JOINTS],
    pub controlled: [usize; CONTROLLED_JOINTS],
}

impl JointMap {
    pub(super) fn new() -> JointMap {
        let names = joint_names();
        let published = |joint: &str| {
            let found = names.iter().position(|name| name.strip_suffix("_joint") == Some(joint));
            found.expect("the tables name joints of the robot")
        };
        JointMap { observed: OBSERVED.map(published), controlled: CONTROLLED.map(published) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Indices in published order: legs 0 to 11, waist 12 to 14, left arm 15 to 21, right arm 29 to 35.
    #[test]
    fn joints_are_found_by_name() {
        let map = JointMap::new();
        let observed = [
            0, 6, 12, 1, 7, 13, 2, 8, 14, 3, 9, 15, 29, 4, 10, 16, 30, 5, 11, 17, 31, 18, 32, 19, 33, 20, 34,
            21, 35,
        ];
        assert_eq!(map.observed, observed);
        assert_eq!(map.controlled, [0, 6, 1, 7, 13, 2, 8, 14, 3, 9, 4, 10, 5, 11]);
    }
}
