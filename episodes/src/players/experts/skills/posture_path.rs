//! Paths of postures for several robots: each robot's place and its hands, as a function of the distance
//! travelled.

use tandem_sim::{CONTROL_DT_S, Pose, Sides, heading_rad, wrapped_rad};

use super::commander::{Commander, RobotMove, WALK_STEPS, WristTargets};
use super::walk::{TargetVelocity, steer};
use crate::players::PlayerError;
use crate::scoring::Facts;

const ACCELERATION_M_S2: f32 = 0.4;
const AT_END_M: f32 = 1e-4;
/// Minimum speed along a path.
const CREEP_M_S: f32 = 0.02;
/// Maximum commanded speed of a robot's base, corrections included.
const MAX_SPEED_M_S: f32 = 0.35;

/// Place of one robot on the floor and poses of its hands, in the world frame.
#[derive(Clone, Copy)]
pub struct Posture {
    pub robot: usize,
    pub stand: Pose,
    pub wrists: Sides<Pose>,
}

/// Free distance of a path without obstacles, which is its whole length.
pub const FREE: fn(&Facts) -> f32 = |_| f32::INFINITY;

/// Postures as a function of the distance travelled.
pub struct PosturePath<'a> {
    pub at: &'a dyn Fn(f32) -> Vec<Posture>,
    pub length_m: f32,
    pub pace_m_s: f32,
    /// Distance along the path that is free at present.
    pub free_m: &'a dyn Fn(&Facts) -> f32,
    /// Time for which robots still correct their places at the end.
    pub hold_s: f32,
}

/// Progress along a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathProgress {
    Completed,
    /// Something went wrong after `gone_m`.
    Interrupted {
        gone_m: f32,
    },
}

/// Follows a path from its beginning to its end, from rest to rest.
pub fn follow(commander: &mut Commander, path: &PosturePath) -> Result<(), PlayerError> {
    follow_while(commander, path, 0.0, &mut |_| true).map(drop)
}

/// Follows a path from `gone_m` on, while `well` returns `true`; see [`follow`].
pub fn follow_while(
    commander: &mut Commander,
    path: &PosturePath,
    mut gone_m: f32,
    well: &mut dyn FnMut(&Facts) -> bool,
) -> Result<PathProgress, PlayerError> {
    let dt_s = WALK_STEPS as f32 * CONTROL_DT_S;
    let (mut pace_m_s, mut held_s) = (0.0f32, 0.0f32);
    while held_s < path.hold_s {
        let left_m = path.length_m - gone_m;
        let facts = commander.facts()?;
        if !well(&facts) {
            return Ok(PathProgress::Interrupted { gone_m });
        }
        let free_m = (path.free_m)(&facts) - gone_m;
        if left_m > AT_END_M && free_m < AT_END_M {
            pace_m_s = 0.0;
        } else if left_m > AT_END_M {
            let left_m = left_m.min(free_m);
            let can_stop_m_s = (2.0 * ACCELERATION_M_S2 * left_m).sqrt();
            let most_m_s = path.pace_m_s.min(can_stop_m_s).max(CREEP_M_S);
            pace_m_s = (pace_m_s + ACCELERATION_M_S2 * dt_s).min(most_m_s);
            gone_m += (pace_m_s * dt_s).min(left_m);
        } else {
            pace_m_s = 0.0;
            held_s += dt_s;
        }
        let now = (path.at)(gone_m);
        let next = (path.at)((gone_m + pace_m_s * dt_s).min(path.length_m));
        let step = |(now, next): (&Posture, &Posture)| {
            let drift = TargetVelocity {
                velocity_m_s: (next.stand.translation - now.stand.translation) / dt_s,
                turning_rad_s: wrapped_rad(heading_rad(&next.stand) - heading_rad(&now.stand)) / dt_s,
            };
            RobotMove {
                robot: now.robot,
                base: steer(&facts.robots[now.robot].pelvis_in_world, &now.stand, drift, MAX_SPEED_M_S),
                wrists: WristTargets::InWorld(now.wrists),
            }
        };
        let moves: Vec<RobotMove> = now.iter().zip(&next).map(step).collect();
        commander.advance(WALK_STEPS, &moves)?;
    }
    Ok(PathProgress::Completed)
}
