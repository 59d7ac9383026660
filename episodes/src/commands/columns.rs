//! The action row: arms 14, hands 14, waist 3, base 4; and what of it lies beyond what a robot's joints and base can do.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use tandem_sim::{
    ARM_COLUMNS, ARM_JOINTS, BaseCommand, BaseLimits, HAND_COLUMNS, HAND_JOINTS, RobotModel, Side, UPPER,
    UPPER_JOINTS, WAIST_COLUMN,
};

/// Names of the last four columns, as every message with a base command has them.
const BASE: [&str; 4] = ["vx_m_s", "vy_m_s", "yaw_rate_rad_s", "pelvis_height_m"];

/// A joint target that is so much beyond a limit is counted: nearer ones come of rounding.
const COUNTED_RAD: f64 = 0.01;

/// How many joint targets were asked for, and how many of them lay beyond the joints' limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TargetCounts {
    asked: u64,
    beyond: u64,
}

impl TargetCounts {
    /// Adds those of another command.
    pub fn add(&mut self, other: TargetCounts) {
        self.asked += other.asked;
        self.beyond += other.beyond;
    }

    /// The share of those beyond their limits; 0 of none.
    pub fn beyond_share(self) -> f64 {
        self.beyond as f64 / self.asked.max(1) as f64
    }
}

/// What of a command lay beyond a limit and was moved there.
#[derive(Clone, Debug, Default)]
pub struct Clamped {
    /// Columns of the action row.
    pub columns: Vec<usize>,
    /// Fields of the base command.
    pub base: Vec<&'static str>,
    /// Joint targets, clamped or not.
    pub targets: TargetCounts,
}

impl Clamped {
    /// The joint target `asked_rad` of a column, within the joint's limits.
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

    /// The base command `asked`, within what locomotion accepts.
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

/// The columns of an arm.
pub fn arm(side: Side) -> Range<usize> {
    ARM_COLUMNS[side]..ARM_COLUMNS[side] + ARM_JOINTS
}

/// The columns of a hand.
pub fn hand(side: Side) -> Range<usize> {
    HAND_COLUMNS[side]..HAND_COLUMNS[side] + HAND_JOINTS
}

/// The joint columns of the waist.
pub fn waist() -> Range<usize> {
    WAIST_COLUMN..UPPER_JOINTS
}

/// Whether a column is a joint of a hand.
pub fn is_hand(column: usize) -> bool {
    Side::BOTH.into_iter().any(|side| hand(side).contains(&column))
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
fn clamped_fields(asked: &BaseCommand, done: &BaseCommand) -> impl Iterator<Item = &'static str> {
    let pairs = base_row(asked).into_iter().zip(base_row(done));
    BASE.into_iter().zip(pairs).filter(|(_, (asked, done))| asked != done).map(|(name, _)| name)
}
