//! `walk_to`: a row of short walks, each told anew from where the robot's own odometry has it.

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};
use tandem_sim::Pose;
use tandem_tools_spec::{ActCall, BaseState, Destination, PlanReply, Wait, Walk, WalkMove, WalkTo};

use super::PlanProgress;
use crate::EpisodeError;
use crate::commands;
use crate::convert::isometry_from_sim;
use crate::recording::CallerRecord;
use crate::session::Session;

/// Control steps of one walk: about half a cycle of the gait. The pelvis sways from side to side once a cycle, so that the mean of two
/// moments that are half a cycle apart knows nothing of it.
pub const WALK_STEPS: u32 = 13;
/// Speed by what is missing, and the most of it: ahead, back, to the sides; turning.
const GAIN_1_S: f64 = 0.7;
const AHEAD_M_S: f64 = 0.3;
const ASIDE_M_S: f64 = 0.2;
const TURN_RAD_S: f64 = 0.4;
/// A robot this near to its place is let come to rest; it coasts a little.
const NEAR_M: f64 = 0.03;
const NEAR_RAD: f64 = 0.04;
/// One that stands this near has arrived.
const THERE_M: f64 = 0.04;
const THERE_RAD: f64 = 0.05;
/// A robot that has not come nearer by this much in so many walks is held up.
const NEARER_M: f64 = 0.03;
const PATIENCE_WALKS: u32 = 12;
/// How often a robot that has come to rest is sent once more.
const ATTEMPTS: u32 = 3;

/// One robot on its way.
struct Walker {
    name: String,
    robot: usize,
    to_m: Vector2<f64>,
    heading_rad: f64,
    /// Where it was half a cycle ago, if it walked then.
    before_m: Option<Vector2<f64>>,
    /// The nearest that it has been, and walks since then.
    nearest_m: f64,
    walks: u32,
    rests: bool,
}

/// What is missing to a place: [ahead, left] as the robot faces, and the angle.
struct Missing {
    way_m: Vector2<f64>,
    turn_rad: f64,
}

impl Session {
    pub(super) fn check_destinations(&self, walk: &WalkTo) -> Result<(), EpisodeError> {
        walk.robots.iter().try_for_each(|entry| commands::find(&entry.robot, &self.motions).map(drop))
    }

    /// Walks until every robot stands at its place.
    pub(super) fn walk_to(&mut self, caller: CallerRecord, walk: &WalkTo) -> Result<PlanReply, EpisodeError> {
        if walk.robots.iter().any(|entry| entry.carry == Some(true)) {
            return self.carry_to(caller, walk);
        }
        let walkers = walk.robots.iter().map(|entry| self.walker(entry));
        let mut walkers: Vec<Walker> = walkers.collect::<Result<_, _>>()?;
        let mut progress = PlanProgress::default();
        let mut attempts = 0;
        loop {
            let left = walk.steps.saturating_sub(progress.executed_steps());
            if left == 0 {
                let why = format!("the steps are used up; {}", self.how_far(&walkers));
                return self.plan_reply(progress, Some(why));
            }
            let steps = left.min(WALK_STEPS);
            let moves: Vec<WalkMove> =
                walkers.iter_mut().filter_map(|walker| self.next_walk(walker)).collect();
            let walks = !moves.is_empty();
            let call = if walks {
                ActCall::Walk(Walk { steps, robots: moves })
            } else {
                ActCall::Wait(Wait { steps })
            };
            let stands = match self.make_planned(caller, call, &mut progress)? {
                Err(why) => return self.plan_reply(progress, Some(why)),
                Ok(reply) if reply.fallen.iter().any(|robot| robot.fallen) => {
                    return self.plan_reply(progress, Some("a robot has fallen".into()));
                }
                Ok(reply) => reply.robots.iter().all(|robot| {
                    robot.base.and_then(|base| base.state).is_none_or(|state| state == BaseState::Standing)
                }),
            };
            if let Some(walker) = walkers.iter().find(|walker| walker.walks > PATIENCE_WALKS) {
                let name = walker.name.clone();
                let why = format!(
                    "{name} gets no nearer: something is in its way or holds it; {}",
                    self.how_far(&walkers)
                );
                return self.plan_reply(progress, Some(why));
            }
            if walks || !stands {
                continue;
            }
            let off: Vec<bool> = walkers.iter().map(|walker| !self.is_there(walker)).collect();
            if !off.contains(&true) {
                return self.plan_reply(progress, None);
            }
            attempts += 1;
            if attempts == ATTEMPTS {
                let why = format!("it came no nearer than this; {}", self.how_far(&walkers));
                return self.plan_reply(progress, Some(why));
            }
            for (walker, off) in walkers.iter_mut().zip(off) {
                (walker.rests, walker.before_m, walker.walks) = (!off, None, 0);
                walker.nearest_m = f64::INFINITY;
            }
        }
    }

    fn walker(&self, entry: &Destination) -> Result<Walker, EpisodeError> {
        let robot = commands::find(&entry.robot, &self.motions)?;
        Ok(Walker {
            name: entry.robot.clone(),
            robot,
            to_m: entry.to_m.into(),
            heading_rad: entry.heading_rad.unwrap_or_else(|| heading_rad(&self.odometry(robot))),
            before_m: None,
            nearest_m: f64::INFINITY,
            walks: 0,
            rests: false,
        })
    }

    fn odometry(&self, robot: usize) -> Pose {
        self.present.robots[robot].sensed.start_from_pelvis
    }

    fn missing(&self, walker: &Walker, at_m: Vector2<f64>) -> Missing {
        let heading_rad = heading_rad(&self.odometry(walker.robot));
        let (sine, cosine) = heading_rad.sin_cos();
        let way_m = walker.to_m - at_m;
        Missing {
            way_m: Vector2::new(cosine * way_m.x + sine * way_m.y, cosine * way_m.y - sine * way_m.x),
            turn_rad: wrapped(walker.heading_rad - heading_rad),
        }
    }

    fn now_m(&self, walker: &Walker) -> Vector2<f64> {
        isometry_from_sim(&self.odometry(walker.robot)).translation.vector.xy()
    }

    fn is_there(&self, walker: &Walker) -> bool {
        let Missing { way_m, turn_rad } = self.missing(walker, self.now_m(walker));
        way_m.norm() <= THERE_M && turn_rad.abs() <= THERE_RAD
    }

    /// How a robot is to walk next; `None` where it is to come to rest.
    fn next_walk(&self, walker: &mut Walker) -> Option<WalkMove> {
        let now_m = self.now_m(walker);
        let mean_m = walker.before_m.map_or(now_m, |before_m| 0.5 * (before_m + now_m));
        walker.before_m = Some(now_m);
        let Missing { way_m, turn_rad } = self.missing(walker, mean_m);
        walker.rests |= way_m.norm() <= NEAR_M && turn_rad.abs() <= NEAR_RAD;
        if walker.rests {
            return None;
        }
        let missing = way_m.norm() + 0.3 * turn_rad.abs();
        if missing < walker.nearest_m - NEARER_M {
            (walker.nearest_m, walker.walks) = (missing, 0);
        } else {
            walker.walks += 1;
        }
        let wanted_m_s = GAIN_1_S * way_m;
        // The same part of every speed, so that the way stays straight.
        let most = (wanted_m_s.x.abs() / AHEAD_M_S).max(wanted_m_s.y.abs() / ASIDE_M_S).max(1.0);
        let robot = walker.name.clone();
        Some(WalkMove {
            robot,
            vx_m_s: wanted_m_s.x / most,
            vy_m_s: wanted_m_s.y / most,
            yaw_rate_rad_s: (GAIN_1_S * turn_rad).clamp(-TURN_RAD_S, TURN_RAD_S),
            pelvis_height_m: None,
            waist_yaw_rad: None,
            look_at_m: None,
        })
    }

    fn how_far(&self, walkers: &[Walker]) -> String {
        let far = |walker: &Walker| {
            let Missing { way_m, turn_rad } = self.missing(walker, self.now_m(walker));
            format!("{} is {:.2} m and {:.2} rad off its place", walker.name, way_m.norm(), turn_rad.abs())
        };
        walkers.iter().map(far).collect::<Vec<_>>().join(", ")
    }
}

pub fn heading_rad(start_from_pelvis: &Pose) -> f64 {
    let ahead = isometry_from_sim(start_from_pelvis).rotation * Vector3::x();
    ahead.y.atan2(ahead.x)
}

/// The same angle from -pi to pi.
pub fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(2.0 * PI) - PI
}
