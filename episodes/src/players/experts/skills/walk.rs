//! Places on the floor with headings, and walks of several robots at once to such places.

use std::collections::VecDeque;
use std::ops::RangeInclusive;

use tandem_sim::{BaseVelocity, CONTROL_DT_S, Pose, Rotation, Side, Sides, Vector, heading_rad, wrapped_rad};

use super::commander::{Commander, HandMove, RobotMove, WALK_STEPS, WristTargets, smooth};
use crate::players::PlayerError;

/// Gain from a position error to a velocity, and from a heading error to a turning rate.
const GAIN_1_S: f32 = 1.0;
/// Tolerance within which a place is reached.
const CLOSE: Tolerance = Tolerance { off_m: 0.02, off_rad: 0.04 };
/// Tolerance within which a standing robot does not have to walk again.
const AT_REST: Tolerance = Tolerance { off_m: 0.03, off_rad: 0.04 };
const TRIES: u32 = 3;
/// Maximum time of a walk. A robot that has not come to rest by then is close enough, or would never come to
/// rest.
const LONGEST_S: f32 = 20.0;
/// Number of commands for feet to come together and swaying to stop.
const SETTLE_COMMANDS: u32 = 6;
/// Number of commands in which a robot takes a step with either foot.
const TWO_STEPS_COMMANDS: usize = 6;
/// Position of a point that the right hand takes: ahead of the pelvis, and to the right.
const AT_HAND_M: Vector = Vector::new(0.40, -0.10, 0.0);
/// Time that hands take to reach out.
const REACH_S: f32 = 1.5;
/// Maximum time of a walk with hands that reach out. The hands correct the remaining error.
const LONGEST_REACHING_S: f32 = 4.0;

/// Goal of a robot's walk.
#[derive(Clone, Copy)]
pub struct WalkGoal {
    pub robot: usize,
    /// World frame; the height is ignored.
    pub to: Pose,
    /// Largest speed.
    pub pace_m_s: f32,
}

/// Distance and angle within which a robot counts as at its place.
#[derive(Clone, Copy)]
pub struct Tolerance {
    pub off_m: f32,
    pub off_rad: f32,
}

/// Velocity of a place that itself moves, world frame.
#[derive(Clone, Copy, Default)]
pub struct TargetVelocity {
    pub velocity_m_s: Vector,
    pub turning_rad_s: f32,
}

/// Returns the base velocity with which a robot whose pelvis is at `at` reaches the place `to` and stays
/// there.
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

/// Brings robots near their places, without waiting for them to come to rest. Their hands keep their poses
/// relative to the body. A robot at its place stops while the others still walk.
pub fn approach(commander: &mut Commander, goals: &[WalkGoal], within: Tolerance) -> Result<(), PlayerError> {
    let mut hands = Vec::with_capacity(goals.len());
    for goal in goals {
        hands.push(WristTargets::InPelvis(commander.facts()?.robots[goal.robot].wrist_in_pelvis));
    }
    let mut near = vec![false; goals.len()];
    let mut left_s = LONGEST_S;
    while left_s > 0.0 {
        let now = pelvises(commander, goals)?;
        for (near, (at, goal)) in near.iter_mut().zip(now.iter().zip(goals)) {
            *near |= is_there(at, goal, within);
        }
        if !near.contains(&false) {
            break;
        }
        let velocities = standing(steered(&now, goals, commander.walking()), &near);
        commander.advance(WALK_STEPS, &moves(goals, &hands, &velocities))?;
        left_s -= WALK_STEPS as f32 * CONTROL_DT_S;
    }
    Ok(())
}

/// Brings robots to their places. Their hands keep their poses relative to the body. The others hold still.
pub fn walk_to(commander: &mut Commander, goals: &[WalkGoal]) -> Result<(), PlayerError> {
    let mut hands = Vec::with_capacity(goals.len());
    for goal in goals {
        hands.push(WristTargets::InPelvis(commander.facts()?.robots[goal.robot].wrist_in_pelvis));
    }
    arrive(commander, goals, 0.0..=LONGEST_S, &|_| hands.clone())
}

/// Brings robots to their places while their hands reach out. Each pair in `reaches` belongs to the robot of
/// the goal with the same index. A robot that already stands when its arms go out takes a step afterwards,
/// because the arms shift its weight forward. A robot that walks meanwhile stops at its place with its arms
/// out.
pub fn walk_reaching(
    commander: &mut Commander,
    goals: &[WalkGoal],
    reaches: &[Sides<HandMove>],
) -> Result<(), PlayerError> {
    let mut from = Vec::with_capacity(goals.len());
    for (goal, hands) in goals.iter().zip(reaches) {
        let robot = &commander.facts()?.robots[goal.robot];
        from.push(robot.wrist_in_pelvis.map(|wrist| robot.pelvis_in_world * wrist));
        for side in Side::BOTH {
            commander.set_fingers(&hands[side]);
        }
    }
    arrive(commander, goals, REACH_S..=LONGEST_REACHING_S, &|gone_s| {
        let part = smooth((gone_s / REACH_S).min(1.0));
        let reach = |(from, hands): (&Sides<Pose>, &Sides<HandMove>)| {
            let wrist = |side: Side| {
                let to = hands[side].world_from_wrist.unwrap_or(from[side]);
                from[side].lerp(&to, part)
            };
            WristTargets::InWorld(Sides::from_fn(wrist))
        };
        from.iter().zip(reaches).map(reach).collect()
    })
}

/// Walks robots to their places; `hands` gives the wrist targets by the time since the start. Each robot
/// stops at its place, but not before the start of `time_s`.
fn arrive(
    commander: &mut Commander,
    goals: &[WalkGoal],
    time_s: RangeInclusive<f32>,
    hands: &dyn Fn(f32) -> Vec<WristTargets>,
) -> Result<(), PlayerError> {
    let mut gone_s = 0.0;
    let mut resting = vec![false; goals.len()];
    for _ in 0..TRIES {
        let mut sway = Sway::default();
        while gone_s < *time_s.end() {
            let now = pelvises(commander, goals)?;
            let mean = sway.mean(now.clone());
            for (robot, goal) in goals.iter().enumerate() {
                resting[robot] |=
                    gone_s >= *time_s.start() && sway.is_told() && is_there(&mean[robot], goal, CLOSE);
            }
            if !resting.contains(&false) {
                break;
            }
            let velocities = standing(steered(&now, goals, commander.walking()), &resting);
            gone_s += WALK_STEPS as f32 * CONTROL_DT_S;
            commander.advance(WALK_STEPS, &moves(goals, &hands(gone_s), &velocities))?;
        }
        for _ in 0..SETTLE_COMMANDS {
            gone_s += WALK_STEPS as f32 * CONTROL_DT_S;
            let still = vec![BaseVelocity::STILL; goals.len()];
            commander.advance(WALK_STEPS, &moves(goals, &hands(gone_s), &still))?;
        }
        // A robot that was in place only through its sway does not come to rest there.
        let now = pelvises(commander, goals)?;
        resting = goals.iter().zip(&now).map(|(goal, at)| is_there(at, goal, AT_REST)).collect();
        if !resting.contains(&false) || gone_s >= *time_s.end() {
            break;
        }
    }
    Ok(())
}

/// Recent positions of the robots. A pelvis sways by 3 cm to each side from step to step, so that it passes
/// its place repeatedly. The mean over two steps decides whether a robot is there.
#[derive(Default)]
struct Sway {
    recent: VecDeque<Vec<Pose>>,
}

impl Sway {
    /// Returns the mean of the robots' recent poses, including `now`.
    fn mean(&mut self, now: Vec<Pose>) -> Vec<Pose> {
        let robots = now.len();
        self.recent.push_back(now);
        if self.recent.len() > TWO_STEPS_COMMANDS {
            self.recent.pop_front();
        }
        let share = 1.0 / self.recent.len() as f32;
        let mean = |robot: usize| {
            let (mut position_m, mut ahead) = (Vector::ZERO, Vector::ZERO);
            for poses in &self.recent {
                position_m += poses[robot].translation * share;
                ahead += poses[robot].rotation * Vector::X * share;
            }
            place(position_m, ahead.y.atan2(ahead.x))
        };
        (0..robots).map(mean).collect()
    }

    /// Returns `true` if the mean is meaningful: over two steps, or for a single pose, before any sway.
    fn is_told(&self) -> bool {
        [1, TWO_STEPS_COMMANDS].contains(&self.recent.len())
    }
}

fn pelvises(commander: &mut Commander, goals: &[WalkGoal]) -> Result<Vec<Pose>, PlayerError> {
    let facts = commander.facts()?;
    Ok(goals.iter().map(|goal| facts.robots[goal.robot].pelvis_in_world).collect())
}

/// Returns the base velocities with which robots walk to their places, at this share of their pace.
fn steered(now: &[Pose], goals: &[WalkGoal], pace_share: f32) -> Vec<BaseVelocity> {
    let walk = |(at, goal): (&Pose, &WalkGoal)| {
        steer(at, &goal.to, TargetVelocity::default(), goal.pace_m_s * pace_share)
    };
    now.iter().zip(goals).map(walk).collect()
}

/// Returns the velocities with those of standing robots set to zero.
fn standing(mut velocities: Vec<BaseVelocity>, stand: &[bool]) -> Vec<BaseVelocity> {
    for (velocity, _) in velocities.iter_mut().zip(stand).filter(|(_, stands)| **stands) {
        *velocity = BaseVelocity::STILL;
    }
    velocities
}

fn moves(goals: &[WalkGoal], hands: &[WristTargets], velocities: &[BaseVelocity]) -> Vec<RobotMove> {
    let part = |((goal, wrists), base): ((&WalkGoal, &WristTargets), &BaseVelocity)| RobotMove {
        robot: goal.robot,
        base: *base,
        wrists: *wrists,
    };
    goals.iter().zip(hands).zip(velocities).map(part).collect()
}

fn is_there(at: &Pose, goal: &WalkGoal, within: Tolerance) -> bool {
    let off_m = (goal.to.translation - at.translation).truncate().length();
    off_m < within.off_m && wrapped_rad(heading_rad(&goal.to) - heading_rad(at)).abs() < within.off_rad
}

/// Returns the same place and heading, without any tilt.
pub fn upright(pose: &Pose) -> Pose {
    Pose::from_parts(pose.translation, Rotation::from_rotation_z(heading_rad(pose)))
}

/// Returns the pose of a place and a heading.
pub fn place(position_m: Vector, heading_rad: f32) -> Pose {
    Pose::from_parts(position_m, Rotation::from_rotation_z(heading_rad))
}

/// Returns the place at another height.
pub fn at_height(place: &Pose, height_m: f32) -> Pose {
    Pose::from_parts(place.translation.with_z(height_m), place.rotation)
}

/// Returns the place of a robot that has `point_m` in front of its right hand.
pub fn at_hand(point_m: Vector, heading_rad: f32) -> Pose {
    let facing = place(Vector::ZERO, heading_rad);
    place(point_m - facing * AT_HAND_M, heading_rad)
}
