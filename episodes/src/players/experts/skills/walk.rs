//! Walking to a place, several robots at once.

use tandem_sim::{CONTROL_DT_S, Pose, Rotation, Sides, Vector, heading_rad, wrapped_rad};

use super::stage::{Hands, RobotMove, Stage, WALK_STEPS, Walk};
use crate::players::PlayerError;

/// Velocity for each metre that a robot is off its place, and turning for each radian.
const GAIN_1_S: f32 = 1.0;
/// A place is reached within this.
const CLOSE: Within = Within { off_m: 0.02, off_rad: 0.04 };
/// One who stands is not asked to walk again within this.
const AT_REST: Within = Within { off_m: 0.03, off_rad: 0.04 };
const TRIES: u32 = 3;
/// A robot that has not come to rest by then stands close enough, or never will.
const LONGEST_S: f32 = 20.0;
/// Feet come together, and what sways comes to rest.
const SETTLE_COMMANDS: u32 = 6;

/// The way to a place.
#[derive(Clone, Copy)]
pub struct Way {
    pub robot: usize,
    /// World frame; its height does not matter.
    pub to: Pose,
    /// No faster than this.
    pub pace_m_s: f32,
}

/// How near to a place is near enough.
#[derive(Clone, Copy)]
pub struct Within {
    pub off_m: f32,
    pub off_rad: f32,
}

/// What a place that itself moves does meanwhile, world frame.
#[derive(Clone, Copy, Default)]
pub struct Drift {
    pub velocity_m_s: Vector,
    pub turning_rad_s: f32,
}

/// How a robot whose pelvis is at `at` walks to stay at, or come to, a place.
pub fn steer(at: &Pose, to: &Pose, drift: Drift, pace_m_s: f32) -> Walk {
    let mut off_m = to.translation - at.translation;
    off_m.z = 0.0;
    let world_m_s = (drift.velocity_m_s + off_m * GAIN_1_S).clamp_length_max(pace_m_s);
    let own_m_s = Rotation::from_rotation_z(-heading_rad(at)) * world_m_s;
    let off_rad = wrapped_rad(heading_rad(to) - heading_rad(at));
    Walk {
        forward_m_s: own_m_s.x,
        left_m_s: own_m_s.y,
        turning_rad_s: drift.turning_rad_s + off_rad * GAIN_1_S,
    }
}

/// Brings robots near their places, hands kept as they are relative to the body, without waiting for them to come to rest.
pub fn come_near(stage: &mut Stage, ways: &[Way], within: Within) -> Result<(), PlayerError> {
    let mut hands = Vec::with_capacity(ways.len());
    for way in ways {
        hands.push(stage.facts()?.robots[way.robot].wrist_in_pelvis);
    }
    let mut left_s = LONGEST_S;
    while left_s > 0.0 && !are_there(stage, ways, within)? {
        let facts = stage.facts()?;
        let walk = |way: &Way| {
            steer(&facts.robots[way.robot].pelvis_in_world, &way.to, Drift::default(), way.pace_m_s)
        };
        stage.advance(WALK_STEPS, &moves(ways, &hands, walk))?;
        left_s -= WALK_STEPS as f32 * CONTROL_DT_S;
    }
    Ok(())
}

/// Brings robots to their places, hands kept as they are relative to the body. The others hold still.
pub fn walk_to(stage: &mut Stage, ways: &[Way]) -> Result<(), PlayerError> {
    let mut hands = Vec::with_capacity(ways.len());
    for way in ways {
        hands.push(stage.facts()?.robots[way.robot].wrist_in_pelvis);
    }
    let mut left_s = LONGEST_S;
    for _ in 0..TRIES {
        while left_s > 0.0 && !are_there(stage, ways, CLOSE)? {
            let facts = stage.facts()?;
            let walk = |way: &Way| {
                steer(&facts.robots[way.robot].pelvis_in_world, &way.to, Drift::default(), way.pace_m_s)
            };
            stage.advance(WALK_STEPS, &moves(ways, &hands, walk))?;
            left_s -= WALK_STEPS as f32 * CONTROL_DT_S;
        }
        for _ in 0..SETTLE_COMMANDS {
            stage.advance(WALK_STEPS, &moves(ways, &hands, |_| Walk::default()))?;
        }
        // Where a robot came by with a sway, it does not come to rest.
        if are_there(stage, ways, AT_REST)? {
            break;
        }
    }
    Ok(())
}

fn moves(ways: &[Way], hands: &[Sides<Pose>], walk: impl Fn(&Way) -> Walk) -> Vec<RobotMove> {
    let part = |(way, hands): (&Way, &Sides<Pose>)| RobotMove {
        robot: way.robot,
        walk: walk(way),
        hands: Hands::Carried(*hands),
    };
    ways.iter().zip(hands).map(part).collect()
}

fn are_there(stage: &mut Stage, ways: &[Way], within: Within) -> Result<bool, PlayerError> {
    let facts = stage.facts()?;
    let is_there = |way: &Way| {
        let at = facts.robots[way.robot].pelvis_in_world;
        let off_m = (way.to.translation - at.translation).truncate().length();
        off_m < within.off_m && wrapped_rad(heading_rad(&way.to) - heading_rad(&at)).abs() < within.off_rad
    };
    Ok(ways.iter().all(is_there))
}
