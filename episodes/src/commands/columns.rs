//! The action row: arms 14, hands 14, waist 3, base 4.

use tandem_sim::robot::{RobotModel, UPPER, UPPER_JOINTS};
use tandem_sim::{BaseCommand, Side};

pub const ARM_JOINTS: usize = 7;
pub const HAND_JOINTS: usize = 7;
const WAIST: usize = 28;

/// Names of the last four columns, as every message with a base command has them.
const BASE: [&str; 4] = ["vx_m_s", "vy_m_s", "yaw_rate_rad_s", "pelvis_height_m"];

/// First column of an arm.
pub fn arm(side: Side) -> usize {
    match side {
        Side::Left => 0,
        Side::Right => ARM_JOINTS,
    }
}

/// First column of a hand.
pub fn hand(side: Side) -> usize {
    match side {
        Side::Left => 2 * ARM_JOINTS,
        Side::Right => 2 * ARM_JOINTS + HAND_JOINTS,
    }
}

/// The joint columns of the waist.
pub fn waist() -> std::ops::Range<usize> {
    WAIST..UPPER_JOINTS
}

/// Whether a column is a joint of a hand.
pub fn is_hand(column: usize) -> bool {
    (hand(Side::Left)..WAIST).contains(&column)
}

/// Names of the columns.
pub fn action_row(model: &RobotModel) -> Vec<String> {
    let joints = UPPER.iter().map(|joint| model.joints[*joint].name.clone());
    joints.chain(BASE.map(String::from)).collect()
}

/// The base command as the last four columns.
pub fn base_row(base: &BaseCommand) -> [f32; 4] {
    [base.vx_m_s, base.vy_m_s, base.yaw_rate_rad_s, base.pelvis_height_m]
}

/// The base command that a row's last four columns ask for.
pub fn base_command([vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m]: [f32; 4]) -> BaseCommand {
    BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m }
}

/// Fields of the base command that differ between what was asked and what is done.
pub fn clamped_fields(asked: &BaseCommand, done: &BaseCommand) -> impl Iterator<Item = &'static str> {
    let pairs = base_row(asked).into_iter().zip(base_row(done));
    BASE.into_iter().zip(pairs).filter(|(_, (asked, done))| asked != done).map(|(name, _)| name)
}
