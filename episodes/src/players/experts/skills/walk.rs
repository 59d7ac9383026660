//! Places on the floor, where robots stand and which way they look; and walking to them, several robots at once.

use tandem_sim::{BaseVelocity, CONTROL_DT_S, Pose, Rotation, Sides, Vector, heading_rad, wrapped_rad};

use super::commander::{Commander, RobotMove, WALK_STEPS, WristTargets};
use crate::players::PlayerError;

/// Velocity for each metre that a robot is off its place, and turning for each radian.
const GAIN_1_S: f32 = 1.0;
/// A place is reached within this.
const CLOSE: Tolerance = Tolerance { off_m: 0.02, off_rad: 0.04 };
/// One who stands is not asked to walk again within this.
const AT_REST: Tolerance = Tolerance { off_m: 0.03, off_rad: 0.04 };
const TRIES: u32 = 3;
/// A robot that has not come to rest by then stands close enough, or never will.
const LONGEST_S: f32 = 20.0;
/// Feet come together, and what sways comes to rest.
const SETTLE_COMMANDS: u32 = 6;

/// Where a robot is to walk.
#[derive(Clone, Copy)]
pub struct WalkGoal {
    pub robot: usize,
    /// World frame; its height does not matter.
    pub to: Pose,
    /// No faster than this.
    pub pace_m_s: f32,
}

/// How near to a place is near enough.
#[derive(Clone, Copy)]
pub struct Tolerance {
    pub off_m: f32,
    pub off_rad: f32,
}

/// What a place that itself moves does meanwhile, world frame.
#[derive(Clone, Copy, Default)]
pub struct TargetVelocity {
    pub velocity_m_s: Vector,
    pub turning_rad_s: f32,
}

/// How a robot whose pelvis is at `at` walks to stay at, or come to, a place.
pub fn steer(at: &Pose, to: &Pose, drift: TargetVelocity, pace_m_s: f32) -> BaseVelocity {
    let mut off_m = to.translation - at.translation;
    off_m.z = 0.0;
    let world_m_s = (drift.velocity_m_s + off_m * GAIN_1_S).clamp_length_max(pace_m_s);
    let own_m_s = Rotation::from_rotation_z(-heading_rad(at)) * world_m_s;
    let off_rad = wrapped_rad(heading_rad(to) - heading_rad(at));
    BaseVelocity {
        vx_m_s: own_m_s.x,
        vy_m_s: own_m_s.y,
        yaw_rate_rad_s: drift.turning_rad_s + off_rad * GAIN_1_S,
    }
}

/// Brings robots near their places, hands kept as they are relative to the body, without waiting for them to come to rest.
pub fn approach(commander: &mut Commander, goals: &[WalkGoal], within: Tolerance) -> Result<(), PlayerError> {
    let mut hands = Vec::with_capacity(goals.len());
    for goal in goals {
        hands.push(commander.facts()?.robots[goal.robot].wrist_in_pelvis);
    }
    let mut left_s = LONGEST_S;
    while left_s > 0.0 && !have_arrived(commander, goals, within)? {
        let facts = commander.facts()?;
        let walk = |goal: &WalkGoal| {
            steer(
                &facts.robots[goal.robot].pelvis_in_world,
                &goal.to,
                TargetVelocity::default(),
                goal.pace_m_s,
            )
        };
        commander.advance(WALK_STEPS, &moves(goals, &hands, walk))?;
        left_s -= WALK_STEPS as f32 * CONTROL_DT_S;
    }
    Ok(())
}

/// Brings robots to their places, hands kept as they are relative to the body. The others hold still.
pub fn walk_to(commander: &mut Commander, goals: &[WalkGoal]) -> Result<(), PlayerError> {
    let mut hands = Vec::with_capacity(goals.len());
    for goal in goals {
        hands.push(commander.facts()?.robots[goal.robot].wrist_in_pelvis);
    }
    let mut left_s = LONGEST_S;
    for _ in 0..TRIES {
        while left_s > 0.0 && !have_arrived(commander, goals, CLOSE)? {
            let facts = commander.facts()?;
            let walk = |goal: &WalkGoal| {
                steer(
                    &facts.robots[goal.robot].pelvis_in_world,
                    &goal.to,
                    TargetVelocity::default(),
                    goal.pace_m_s,
                )
            };
            commander.advance(WALK_STEPS, &moves(goals, &hands, walk))?;
            left_s -= WALK_STEPS as f32 * CONTROL_DT_S;
        }
        for _ in 0..SETTLE_COMMANDS {
            commander.advance(WALK_STEPS, &moves(goals, &hands, |_| BaseVelocity::STILL))?;
        }
        // Where a robot came by with a sway, it does not come to rest.
        if have_arrived(commander, goals, AT_REST)? {
            break;
        }
    }
    Ok(())
}

fn moves(
    goals: &[WalkGoal],
    hands: &[Sides<Pose>],
    walk: impl Fn(&WalkGoal) -> BaseVelocity,
) -> Vec<RobotMove> {
    let part = |(goal, hands): (&WalkGoal, &Sides<Pose>)| RobotMove {
        robot: goal.robot,
        base: walk(goal),
        wrists: WristTargets::InPelvis(*hands),
    };
    goals.iter().zip(hands).map(part).collect()
}

fn have_arrived(
    commander: &mut Commander,
    goals: &[WalkGoal],
    within: Tolerance,
) -> Result<bool, PlayerError> {
    let facts = commander.facts()?;
    let is_there = |goal: &WalkGoal| {
        let at = facts.robots[goal.robot].pelvis_in_world;
        let off_m = (goal.to.translation - at.translation).truncate().length();
        off_m < within.off_m && wrapped_rad(heading_rad(&goal.to) - heading_rad(&at)).abs() < within.off_rad
    };
    Ok(goals.iter().all(is_there))
}

/// The same place and heading, without any tilt.
pub fn upright(pose: &Pose) -> Pose {
    Pose::from_parts(pose.translation, Rotation::from_rotation_z(heading_rad(pose)))
}

/// A place and a heading.
pub fn place(position_m: Vector, heading_rad: f32) -> Pose {
    Pose::from_parts(position_m, Rotation::from_rotation_z(heading_rad))
}
