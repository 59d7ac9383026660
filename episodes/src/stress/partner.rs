//! Partner stress: one robot of the team fails. By the seed it freezes, reacts late, walks off, drops its
//! object, or does not send messages. The failure acts between its commands and their execution, like a
//! technical fault.

use std::f32::consts::TAU;

use tandem_sim::{ARM_JOINTS, BaseCommand, BaseLimits, HAND_JOINTS, RobotCommand};

use super::{StressAxis, StressLevel, random};

/// Duration of a freeze.
const FREEZE_S: [f64; 3] = [1.0, 2.0, 4.0];
/// Delay of commands in control steps: 0.3, 0.6 and 1.2 s.
const LATE_STEPS: [usize; 3] = [15, 30, 60];
/// Duration of a walk-off; `WALK_M_S` is its speed.
const WALK_S: [f64; 3] = [1.0, 2.0, 3.0];
const WALK_M_S: f32 = 0.25;
/// Duration for which the robot's hands are open.
const OPEN_S: [f64; 3] = [0.4, 0.8, 1.6];
/// Denominator of the share of its messages that are delivered: one in two, one in four, and at the third
/// level none.
const HEARD_OF: [Option<u32>; 3] = [Some(2), Some(4), None];
/// Period of the failures; each begins within the first `LATEST_S` seconds of a period, early enough for
/// the longest.
const EVERY_S: f64 = 10.0;
const LATEST_S: f32 = 5.5;

/// The kind of failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Failing {
    Freezes,
    ReactsLate,
    WalksOff,
    Drops,
    SaysNothing,
}

/// Kinds of failure, which seeds take in turn.
const FAILINGS: [Failing; 5] =
    [Failing::Freezes, Failing::ReactsLate, Failing::WalksOff, Failing::Drops, Failing::SaysNothing];

/// The robot that fails, and its kind of failure.
#[derive(Clone, Copy, Debug)]
pub struct FailingPartner {
    pub robot: usize,
    failing: Failing,
    level: StressLevel,
    seed: u32,
}

impl FailingPartner {
    pub fn of(level: StressLevel, seed: u32, robots: usize) -> FailingPartner {
        let drawn = random(StressAxis::Partner, seed, 0).uniform([0.0, robots as f32]) as usize;
        FailingPartner { robot: drawn.min(robots - 1), failing: failing(seed), level, seed }
    }

    /// Returns the delay of its commands in control steps.
    pub fn late_steps(&self) -> usize {
        if self.failing == Failing::ReactsLate { self.level.of(LATE_STEPS) } else { 0 }
    }

    /// Returns the command that it executes instead of `told`, `time_s` after its policy took over; `None`
    /// if it executes `told`. `before` is the command of the step before.
    pub fn overrides(
        &self,
        time_s: f64,
        told: &RobotCommand,
        before: &RobotCommand,
        limits: &BaseLimits,
    ) -> Option<RobotCommand> {
        let lasts_s = match self.failing {
            Failing::Freezes => self.level.of(FREEZE_S),
            Failing::WalksOff => self.level.of(WALK_S),
            Failing::Drops => self.level.of(OPEN_S),
            Failing::ReactsLate | Failing::SaysNothing => 0.0,
        };
        let (begin_s, heading_rad) = self.event(time_s);
        if !(begin_s..begin_s + lasts_s).contains(&time_s) {
            return None;
        }
        match self.failing {
            Failing::Freezes => Some(RobotCommand { base: still(before.base), ..*before }),
            Failing::WalksOff => {
                let (vx_m_s, vy_m_s) = (WALK_M_S * heading_rad.cos(), WALK_M_S * heading_rad.sin());
                let base = BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s: 0.0, ..told.base };
                Some(RobotCommand { base: limits.clamp(base), ..*told })
            }
            Failing::Drops => {
                let mut open = *told;
                open.upper_rad[2 * ARM_JOINTS..][..2 * HAND_JOINTS].fill(0.0);
                Some(open)
            }
            Failing::ReactsLate | Failing::SaysNothing => None,
        }
    }

    /// Returns the start of the failure near this time, and the direction in which the robot walks.
    fn event(&self, time_s: f64) -> (f64, f32) {
        let number = (time_s / EVERY_S).floor().max(0.0);
        let mut random = random(StressAxis::Partner, self.seed, 1 + number as usize);
        let begin_s = number * EVERY_S + f64::from(random.uniform([0.0, LATEST_S]));
        (begin_s, random.uniform([0.0, TAU]))
    }
}

fn still(base: BaseCommand) -> BaseCommand {
    BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, ..base }
}

/// Returns the partner's kind of failure under a seed.
pub fn kind(seed: u32) -> &'static str {
    match failing(seed) {
        Failing::Freezes => "freezes",
        Failing::ReactsLate => "reacts late",
        Failing::WalksOff => "walks off",
        Failing::Drops => "drops what it holds",
        Failing::SaysNothing => "says nothing",
    }
}

fn failing(seed: u32) -> Failing {
    FAILINGS[seed as usize % FAILINGS.len()]
}

/// A robot whose messages do not all reach the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Silence {
    pub robot: usize,
    heard_of: Option<u32>,
}

impl Silence {
    pub fn of(level: StressLevel, seed: u32, robots: usize) -> Option<Silence> {
        let partner = FailingPartner::of(level, seed, robots);
        let silence = Silence { robot: partner.robot, heard_of: level.of(HEARD_OF) };
        (partner.failing == Failing::SaysNothing).then_some(silence)
    }

    /// Returns `true` if the message that this robot sends after `said` earlier ones is delivered.
    pub fn lets_hear(&self, robot: usize, said: u32) -> bool {
        robot != self.robot || self.heard_of.is_some_and(|of| said.is_multiple_of(of))
    }
}
