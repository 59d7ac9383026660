//! The joints of a robot, in published order: their readings and drives.

use crate::body::{JOINTS, JointDrive, RobotModel};
use crate::dynamics::{Drive, Tree};

/// Returns the joints' coordinates (rad) and velocities (rad/s).
pub(super) fn read(tree: &Tree, model: &RobotModel) -> ([f32; JOINTS], [f32; JOINTS]) {
    let of = |value: fn(&Tree, usize) -> f64| {
        std::array::from_fn(|joint| of_joint(model, joint, |link| value(tree, link)))
    };
    (of(Tree::joint_position), of(Tree::joint_velocity))
}

/// Returns the torques that the drives exerted in the last step, limits and implicit parts included (N m).
pub(super) fn torques_n_m(tree: &Tree, model: &RobotModel) -> [f32; JOINTS] {
    std::array::from_fn(|joint| of_joint(model, joint, |link| tree.drive_effort(link)))
}

/// Returns a joint's value, or 0 for a joint that the robot lacks.
fn of_joint(model: &RobotModel, joint: usize, value: impl Fn(usize) -> f64) -> f32 {
    let joint = &model.joints[joint];
    if joint.exists() { value(joint.link) as f32 } else { 0.0 }
}

pub(super) fn drive(tree: &mut Tree, model: &RobotModel, drives: &[JointDrive; JOINTS]) {
    for (joint, drive) in model.joints.iter().zip(drives).filter(|(joint, _)| joint.exists()) {
        let drive = Drive {
            target: f64::from(drive.target_rad),
            kp: f64::from(drive.kp_n_m_rad),
            kd: f64::from(drive.kd_n_m_s_rad),
            feedforward: f64::from(drive.feedforward_n_m),
        };
        tree.drive(joint.link, drive);
    }
}
