//! `walk_to`: a sequence of short walks, each computed from the robot's odometry, and corrections from
//! its standing place at the end.

use std::collections::VecDeque;

use nalgebra::Vector2;
use tandem_tools_spec::{
    ActCall, BaseState, CommandReply, Destination, PoseFrame, Wait, Walk, WalkMove, WalkTo,
};

use super::PlanAdvance;
use super::way::{Corrections, Missing, Stand, WALK_S, WALK_STEPS};
use crate::EpisodeError;
use crate::commands;
use crate::session::Session;

/// Gain from displacement to speed, and limits of the speed: ahead and back, to the sides, turning.
const GAIN_1_S: f64 = 0.7;
const AHEAD_M_S: f64 = 0.3;
const ASIDE_M_S: f64 = 0.2;
const TURN_RAD_S: f64 = 0.4;
/// Distance and angle to its place at which a robot is stopped, since it coasts a little. The larger distance
/// is that at which a waypoint counts as passed.
const NEAR_M: f64 = 0.03;
const NEAR_RAD: f64 = 0.04;
const PASSED_M: f64 = 0.1;
/// Number of walks without progress after which a robot this close rests and then corrects its place. At low
/// speeds the sway hides the remaining distance.
const SLOW_WALKS: u32 = 4;
const CLOSE_M: f64 = 0.15;
const CLOSE_RAD: f64 = 0.3;
/// Tolerances of a standing robot. Within the first distance and angle it has reached its place, but
/// corrections continue until it is within the second.
pub const THERE_M: f64 = 0.015;
pub const THERE_RAD: f64 = 0.026;
pub const WELL_M: f64 = 0.013;
pub const WELL_RAD: f64 = 0.023;
/// Maximum number of further attempts after the first rest; and the maximum displacement for which a standing
/// robot walks by one pulse. The end of a pulse is predictable and needs no steering.
pub const ATTEMPTS: u32 = 5;
const PULSE_M: f64 = 0.35;
const PULSE_RAD: f64 = 0.5;
/// Number of commands with all robots standing, after which their sway has ended.
pub const CALM_COMMANDS: u32 = 2;
/// Minimum decrease of the distance within this number of walks. A robot with a smaller one is blocked.
const NEARER_M: f64 = 0.03;
const PATIENCE_WALKS: u32 = 12;

/// Next motion of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
enum WalkerStage {
    Walks,
    /// A short walk from its standing place to its goal.
    Corrects,
    /// Remainder of such a walk. Commands of other operators may have shortened its command.
    Pulses {
        vx_m_s: f64,
        vy_m_s: f64,
        yaw_rate_rad_s: f64,
        left_steps: u32,
    },
    Rests,
}

/// A walking robot.
#[derive(Debug)]
struct Walker {
    name: String,
    robot: usize,
    /// Remaining waypoints, and the destination as the last.
    places: VecDeque<Stand>,
    stage: WalkerStage,
    /// Position half a gait cycle ago, if the robot walked then.
    before_m: Option<Vector2<f64>>,
    /// Smallest distance to the goal, and the number of walks since then.
    nearest_m: f64,
    walks: u32,
    corrections: Corrections,
}

/// Robots that walk to separate places.
#[derive(Debug)]
pub struct WalkPlan {
    walkers: Vec<Walker>,
    /// Remaining control steps.
    left_steps: u32,
    /// Number of further attempts after rest.
    attempts: u32,
    /// Number of consecutive commands with all robots standing.
    calm: u32,
    /// True if the last command was a walk.
    walks: bool,
}

impl WalkPlan {
    /// Returns the next command after the reply to the previous one.
    pub fn advance(&mut self, session: &Session, last: Option<&CommandReply>) -> PlanAdvance {
        if let Some(done) = last.and_then(|reply| self.after(session, reply)) {
            return done;
        }
        if self.left_steps == 0 {
            let is_there = |walker: &Walker| session.missing_of(walker).is_within(THERE_M, THERE_RAD);
            let why = (!self.walkers.iter().all(is_there)).then(|| {
                format!("the steps are used up; {}{}", session.how_far(&self.walkers), self.rests(last))
            });
            return PlanAdvance::Done(why);
        }
        let moves: Vec<WalkMove> =
            self.walkers.iter_mut().filter_map(|walker| session.next_walk(walker)).collect();
        self.walks = !moves.is_empty();
        let pulses = self.walkers.iter_mut().filter_map(|walker| walker.stage.pulse_steps().copied());
        let steps = pulses.fold(self.left_steps.min(WALK_STEPS), u32::min);
        PlanAdvance::Make(match self.walks {
            true => ActCall::Walk(Walk { steps, robots: moves }),
            false => ActCall::Wait(Wait { steps }),
        })
    }

    /// Returns the distances from their places at which robots that have not come to rest will stand; empty
    /// if all rest.
    fn rests(&self, last: Option<&CommandReply>) -> String {
        let reports = last.map_or(&[][..], |reply| &reply.robots);
        let rest = |walker: &Walker| {
            let report = reports.iter().find(|report| report.robot == walker.name)?;
            let rests_m = Vector2::from(report.base?.comes_to_rest_m?);
            let off_m = (walker.places.back()?.at_m - rests_m).norm();
            Some(format!("; {} comes to rest {off_m:.3} m from it", walker.name))
        };
        self.walkers.iter().filter_map(rest).collect()
    }

    /// Processes the reply to a command. Returns the end of the plan if it was the last.
    fn after(&mut self, session: &Session, reply: &CommandReply) -> Option<PlanAdvance> {
        self.left_steps = self.left_steps.saturating_sub(reply.executed_steps);
        for left_steps in self.walkers.iter_mut().filter_map(|walker| walker.stage.pulse_steps()) {
            *left_steps = left_steps.saturating_sub(reply.executed_steps);
        }
        let stopped = |why: String| Some(PlanAdvance::Done(Some(why)));
        if let Some(walker) = self.walkers.iter().find(|walker| walker.walks > PATIENCE_WALKS) {
            let (name, far) = (&walker.name, session.how_far(&self.walkers));
            return stopped(format!("{name} gets no nearer: something is in its way or holds it; {far}"));
        }
        self.calm = if self.walks || !all_stand(reply) { 0 } else { self.calm + 1 };
        if self.calm < CALM_COMMANDS {
            return None;
        }
        let off: Vec<Missing> = self.walkers.iter().map(|walker| session.missing_of(walker)).collect();
        let all_within = |most_m, most_rad| off.iter().all(|off| off.is_within(most_m, most_rad));
        if all_within(WELL_M, WELL_RAD) {
            return Some(PlanAdvance::Done(None));
        }
        if self.attempts == ATTEMPTS {
            let why = (!all_within(THERE_M, THERE_RAD))
                .then(|| format!("it came no nearer than this; {}", session.how_far(&self.walkers)));
            return Some(PlanAdvance::Done(why));
        }
        self.attempts += 1;
        self.walkers.iter_mut().zip(&off).for_each(|(walker, off)| walker.try_again(off));
        None
    }
}

impl Session {
    /// Starts a walk.
    ///
    /// # Errors
    ///
    /// If the episode lacks one of the robots.
    pub(super) fn walk_plan(&self, walk: &WalkTo) -> Result<WalkPlan, EpisodeError> {
        let walkers =
            walk.robots.iter().map(|entry| self.walker(entry, walk.frame)).collect::<Result<_, _>>()?;
        let left_steps = walk.steps;
        Ok(WalkPlan { walkers, left_steps, attempts: 0, calm: 0, walks: false })
    }

    fn walker(&self, entry: &Destination, frame: PoseFrame) -> Result<Walker, EpisodeError> {
        let robot = commands::find(&entry.robot, &self.motions)?;
        let mut walker = Walker {
            name: entry.robot.clone(),
            robot,
            places: self.places(robot, entry, frame).into(),
            stage: WalkerStage::Walks,
            before_m: None,
            nearest_m: f64::INFINITY,
            walks: 0,
            corrections: Corrections::default(),
        };
        let stands = self.present.robots[robot].sensed.is_stepping == Some(false);
        if stands && walker.places.len() == 1 {
            let off = self.missing_of(&walker);
            walker.try_again(&off);
        }
        Ok(walker)
    }

    /// Returns the place of a robot by its odometry.
    pub(super) fn stands_at(&self, robot: usize) -> Stand {
        Stand::of(&self.present.robots[robot].sensed.start_from_pelvis)
    }

    /// Returns the places of a robot's destination, given in `frame`, in its start frame.
    pub(super) fn places(&self, robot: usize, entry: &Destination, frame: PoseFrame) -> Vec<Stand> {
        let motion = &self.motions[robot];
        let frame = match frame {
            // A conversion would change the places by rounding.
            PoseFrame::Start => Stand::START,
            PoseFrame::Pelvis | PoseFrame::Level | PoseFrame::Room => {
                Stand::below(&motion.pelvis_from(PoseFrame::Start).inv_mul(&motion.pelvis_from(frame)))
            }
        };
        self.stands_at(robot).places(entry, &frame)
    }

    fn missing_of(&self, walker: &Walker) -> Missing {
        let now = self.stands_at(walker.robot);
        now.missing_to(walker.places.back().unwrap_or(&now))
    }

    /// Returns the next walk of a robot; `None` if it is to stop.
    fn next_walk(&self, walker: &mut Walker) -> Option<WalkMove> {
        let now = self.stands_at(walker.robot);
        match walker.stage {
            WalkerStage::Rests => return None,
            WalkerStage::Corrects => {
                let missing = self.missing_of(walker);
                let way = walker.corrections.pulse(&missing).map(|rate| rate * WALK_S);
                walker.stage = WalkerStage::pulse(way);
                return self.next_walk(walker);
            }
            WalkerStage::Pulses { left_steps: 0, .. } => {
                walker.stage = WalkerStage::Rests;
                return None;
            }
            WalkerStage::Pulses { vx_m_s, vy_m_s, yaw_rate_rad_s, .. } => {
                return Some(walker.walk([vx_m_s, vy_m_s, yaw_rate_rad_s]));
            }
            WalkerStage::Walks => {}
        }
        let mean_m = walker.before_m.map_or(now.at_m, |before_m| 0.5 * (before_m + now.at_m));
        walker.before_m = Some(now.at_m);
        let mean = Stand { at_m: mean_m, ..now };
        while walker.places.len() > 1 && mean.missing_to(&walker.places[0]).way_m.norm() < PASSED_M {
            walker.places.pop_front();
            (walker.nearest_m, walker.walks) = (f64::INFINITY, 0);
        }
        let off = mean.missing_to(walker.places.front()?);
        let is_slow = walker.walks >= SLOW_WALKS && off.is_within(CLOSE_M, CLOSE_RAD);
        if walker.places.len() == 1 && (is_slow || off.is_within(NEAR_M, NEAR_RAD)) {
            walker.stage = WalkerStage::Rests;
            return None;
        }
        let missing_m = off.way_m.norm() + 0.3 * off.turn_rad.abs();
        if missing_m < walker.nearest_m - NEARER_M {
            (walker.nearest_m, walker.walks) = (missing_m, 0);
        } else {
            walker.walks += 1;
        }
        let wanted_m_s = GAIN_1_S * off.way_m;
        // All speeds are scaled equally, so that the path stays straight.
        let most = (wanted_m_s.x.abs() / AHEAD_M_S).max(wanted_m_s.y.abs() / ASIDE_M_S).max(1.0);
        let turning_rad_s = (GAIN_1_S * off.turn_rad).clamp(-TURN_RAD_S, TURN_RAD_S);
        Some(walker.walk([wanted_m_s.x / most, wanted_m_s.y / most, turning_rad_s]))
    }

    fn how_far(&self, walkers: &[Walker]) -> String {
        let far = |walker: &Walker| self.missing_of(walker).told(&walker.name);
        walkers.iter().map(far).collect::<Vec<_>>().join(", ")
    }
}

/// Returns true if no robot in the reply steps; robots without a base state do not count.
pub fn all_stand(reply: &CommandReply) -> bool {
    let states = reply.robots.iter().map(|robot| robot.base.and_then(|base| base.state));
    states.flatten().all(|state| state == BaseState::Standing)
}

impl WalkerStage {
    /// Returns the pulse that goes this way, [ahead, left, turn], at usual speeds.
    fn pulse([ahead_m, left_m, turn_rad]: [f64; 3]) -> WalkerStage {
        let time_s =
            (ahead_m.abs() / AHEAD_M_S).max(left_m.abs() / ASIDE_M_S).max(turn_rad.abs() / TURN_RAD_S);
        let walks = (time_s / WALK_S).ceil().max(1.0);
        let time_s = walks * WALK_S;
        WalkerStage::Pulses {
            vx_m_s: ahead_m / time_s,
            vy_m_s: left_m / time_s,
            yaw_rate_rad_s: turn_rad / time_s,
            left_steps: walks as u32 * WALK_STEPS,
        }
    }

    /// Returns the control steps that are left of a pulse; `None` in other stages.
    fn pulse_steps(&mut self) -> Option<&mut u32> {
        match self {
            WalkerStage::Pulses { left_steps, .. } => Some(left_steps),
            WalkerStage::Walks | WalkerStage::Corrects | WalkerStage::Rests => None,
        }
    }
}

impl Walker {
    /// Starts another attempt from the standing place, unless the robot is close enough to its goal.
    fn try_again(&mut self, off: &Missing) {
        (self.before_m, self.walks, self.nearest_m) = (None, 0, f64::INFINITY);
        self.stage = if off.is_within(WELL_M, WELL_RAD) {
            WalkerStage::Rests
        } else if off.is_within(PULSE_M, PULSE_RAD) {
            WalkerStage::Corrects
        } else {
            WalkerStage::Walks
        };
    }

    fn walk(&self, [vx_m_s, vy_m_s, yaw_rate_rad_s]: [f64; 3]) -> WalkMove {
        WalkMove {
            robot: self.name.clone(),
            vx_m_s,
            vy_m_s,
            yaw_rate_rad_s,
            pelvis_height_m: None,
            waist_yaw_rad: None,
            look_at_m: None,
        }
    }
}
