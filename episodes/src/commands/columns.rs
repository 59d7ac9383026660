//! The action row: arms 14, hands 14, waist 3, base 4; and clamping of its values to the limits of joints
//! and base.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use tandem_sim::{
    ARM_COLUMNS, ARM_JOINTS, BaseCommand, BaseLimits, HAND_COLUMNS, HAND_JOINTS, RobotModel, Side, UPPER,
    UPPER_JOINTS, WAIST_COLUMN,
};

/// Names of the last four columns, as in every message with a base command.
const BASE: [&str; 4] = ["vx_m_s", "vy_m_s", "yaw_rate_rad_s", "pelvis_height_m"];

/// Minimum excess of a joint target over its limit to be counted; smaller ones are rounding errors.
const COUNTED_RAD: f64 = 0.01;

/// Number of joint targets, and of those beyond the joints' limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TargetCounts {
    asked: u64,
    beyond: u64,
}

impl TargetCounts {
    /// Adds the counts of another command.
    pub fn add(&mut self, other: TargetCounts) {
        self.asked += other.asked;
        self.beyond += other.beyond;
    }

    /// Returns the fraction of targets beyond their limits; 0 without targets.
    pub fn beyond_share(self) -> f64 {
        self.beyond as f64 / self.asked.max(1) as f64
    }
}

/// Values of a command that were clamped to a limit.
#[derive(Clone, Debug, Default)]
pub struct Clamped {
    /// Clamped columns of the action row.
    pub columns: Vec<usize>,
    /// Clamped fields of the base command.
    pub base: Vec<&'static str>,
    /// Counts of joint targets, clamped or not.
    pub targets: TargetCounts,
}

impl Clamped {
    /// Clamps the joint target of a column to the joint's limits.
    pub fn joint(&mut self, model: &RobotModel, column: usize, asked_rad: f64) -> f64 {
        let joint = &model.joints[UPPER[column]];
        let within_rad = asked_rad.clamp(joint.lower_rad.into(), joint.upper_rad.into());
        self.targets.asked += 1;
        self.targets.beyond += u64::from((asked_rad - within_rad).abs() > COUNTED_RAD);
        if within_rad != asked_rad && !self.columns.contains(&column) {
            self.columns.push(column);
        }
        within_rad
    }

    /// Clamps a base command to the limits of locomotion.
    pub fn base(&mut self, limits: &BaseLimits, asked: BaseCommand) -> BaseCommand {
        let done = limits.clamp(asked);
        for field in clamped_fields(&asked, &done) {
            if !self.base.contains(&field) {
                self.base.push(field);
            }
        }
        done
    }
}

/// Returns the columns of an arm.
pub fn arm(side: Side) -> Range<usize> {
    ARM_COLUMNS[side]..ARM_COLUMNS[side] + ARM_JOINTS
}

/// Returns the columns of a hand.
pub fn hand(side: Side) -> Range<usize> {
    HAND_COLUMNS[side]..HAND_COLUMNS[side] + HAND_JOINTS
}

/// Returns the columns of the waist.
pub fn waist() -> Range<usize> {
    WAIST_COLUMN..UPPER_JOINTS
}

/// Returns true for the column of a hand joint.
pub fn is_hand(column: usize) -> bool {
    Side::BOTH.into_iter().any(|side| hand(side).contains(&column))
}

/// Returns the names of the columns.
pub fn action_row(model: &RobotModel) -> Vec<String> {
    let joints = UPPER.iter().map(|joint| model.joints[*joint].name.clone());
    joints.chain(BASE.map(String::from)).collect()
}

/// Returns the base command as the last four columns.
pub fn base_row(base: &BaseCommand) -> [f32; 4] {
    [base.vx_m_s, base.vy_m_s, base.yaw_rate_rad_s, base.pelvis_height_m]
}

/// Returns the base command in the last four columns of a row.
pub fn base_command([vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m]: [f32; 4]) -> BaseCommand {
    BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m }
}

/// Yields the fields of the base command that clamping has changed.
fn clamped_fields(asked: &BaseCommand, done: &BaseCommand) -> impl Iterator<Item = &'static str> {
    let pairs = base_row(asked).into_iter().zip(base_row(done));
    BASE.into_iter().zip(pairs).filter(|(_, (asked, done))| asked != done).map(|(name, _)| name)
}
