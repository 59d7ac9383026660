//! `walk_to` of robots that push or carry: bases and hands go along one path, from rest to rest, each robot's
//! in its own start frame.
//!
//! A path is a row of ways, each a turn and a shift at a constant rate, as of one rigid body. Robots that hold
//! one load, and whose places fit it, so go as if they were one body with it all along, though none of them
//! knows where the others are. All along, wrists are to be where they were to their robot at the first step:
//! where a base stays off its place, the next way does not begin from there.

use nalgebra::{Isometry3, Rotation2, Vector2};
use tandem_sim::{CONTROL_HZ, Side, Sides};
use tandem_tools_spec::{
    ActCall, CommandReply, Destination, Grip, HandState, MoveWrists, RobotReport, WalkTo, WristMove,
};

use super::PlanAdvance;
use super::walk_to::{ATTEMPTS, CALM_COMMANDS, THERE_M, THERE_RAD, WELL_M, WELL_RAD, all_stand};
use super::way::{Corrections, Missing, Stand, WALK_STEPS, Way, wrapped};
use crate::EpisodeError;
use crate::commands;
use crate::convert::isometry_from_sim;
use crate::session::Session;

/// How fast a path is gone, and how soon that is so.
const PACE_M_S: f64 = 0.2;
const ACCELERATION_M_S2: f64 = 0.2;
const CREEP_M_S: f64 = 0.02;
/// A path slows down for a robot that lags by the first and waits for one that lags by the second, and is given
/// up after so many commands of that. The same for one that is turned away from its path.
const LAG_M: [f64; 2] = [0.13, 0.18];
const LAGS_COMMANDS: u32 = 16;
const TURNED_RAD: [f64; 2] = [0.12, 0.2];
/// A path is given up after so many commands with a robot turned away, or a wrist out of reach.
const STRAYS_COMMANDS: u32 = 3;
/// Velocity for what a robot is off its path, and the most of it with the path's own; turning. Twice the gain
/// makes robots that walk half a second behind their commands swing from side to side, more and more.
const GAIN_1_S: f64 = 0.5;
const MAX_SPEED_M_S: f64 = 0.3;
const TURN_RAD_S: f64 = 0.4;
/// How hands give way to partners.
const COMPLIANCE_N_S_M: f64 = 250.0;
/// At its end robots correct their places in so many commands, and then come to rest within so many.
const CORRECTING_COMMANDS: u32 = 4;
const RESTING_COMMANDS: u32 = 12;
/// A hand that held and holds nothing for so many commands has lost it.
const LOST_COMMANDS: u32 = 4;

/// One robot on its way.
#[derive(Debug)]
struct Carrier {
    name: String,
    robot: usize,
    carries: bool,
    ways: Vec<Way>,
    /// Where its wrists stay, in the frame of the place where it stands.
    stand_from_wrist: Sides<Isometry3<f64>>,
    /// What it was off its path half a cycle of its gait ago.
    before_m: Option<Vector2<f64>>,
    /// For how many commands each hand that held has held nothing; `None` before it holds.
    empty: Sides<Option<u32>>,
    /// The hand that cannot come to where it is to be.
    out_of_reach: Option<Side>,
    corrections: Corrections,
}

/// What a team does next.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CarryStage {
    OnWay,
    /// At the end of its path, for so many commands.
    Correcting(u32),
    /// Told to stand for so many commands; for the last of them, all have stood.
    Resting {
        commands: u32,
        calm: u32,
    },
    /// Robots make up by one short walk for what is missing where they stand.
    Pulse,
}

/// Robots that go along one path.
#[derive(Debug)]
pub struct CarryPlan {
    carriers: Vec<Carrier>,
    /// Control steps that are left.
    left_steps: u32,
    /// Length of each way, the longest of the robots'.
    ways_m: Vec<f64>,
    pace: PathPace,
    stage: CarryStage,
    attempts: u32,
    /// Commands in a row in which a robot was turned away or a wrist out of reach.
    strays: u32,
    /// Why the robots go no further.
    stopped: Option<String>,
}

/// How far a path has been gone, and how fast.
#[derive(Debug, Default)]
struct PathPace {
    gone_m: f64,
    pace_m_s: f64,
    waited: u32,
}

impl PathPace {
    /// Goes on for `time_s` along a path of `length_m`, at a share of its pace.
    fn go(&mut self, length_m: f64, share: f64, time_s: f64) {
        let left_m = length_m - self.gone_m;
        if share > 0.0 {
            let can_stop_m_s = (2.0 * ACCELERATION_M_S2 * left_m).sqrt().max(CREEP_M_S);
            let most_m_s = (PACE_M_S * share).max(CREEP_M_S);
            self.pace_m_s = (self.pace_m_s + ACCELERATION_M_S2 * time_s).min(can_stop_m_s).min(most_m_s);
            self.waited = 0;
        } else {
            (self.pace_m_s, self.waited) = (0.5 * self.pace_m_s, self.waited + 1);
        }
        self.pace_m_s = self.pace_m_s.min(left_m / time_s);
        self.gone_m += self.pace_m_s * time_s;
    }
}

impl CarryPlan {
    fn new(carriers: Vec<Carrier>, left_steps: u32) -> CarryPlan {
        let ways = carriers.iter().map(|carrier| carrier.ways.len()).min().unwrap_or(0);
        let longest =
            |leg: usize| carriers.iter().map(|carrier| carrier.ways[leg].length_m()).fold(0.0, f64::max);
        CarryPlan {
            ways_m: (0..ways).map(longest).collect(),
            carriers,
            left_steps,
            pace: PathPace::default(),
            stage: CarryStage::OnWay,
            attempts: 0,
            strays: 0,
            stopped: None,
        }
    }

    fn length_m(&self) -> f64 {
        self.ways_m.iter().sum()
    }

    /// The way that is gone now, and the share of it that has been.
    fn leg(&self) -> (usize, f64) {
        let mut left_m = self.pace.gone_m;
        for (leg, way_m) in self.ways_m.iter().enumerate() {
            if left_m < *way_m {
                return (leg, left_m / way_m);
            }
            left_m -= way_m;
        }
        (self.ways_m.len() - 1, 1.0)
    }

    fn is_at_end(&self) -> bool {
        self.length_m() - self.pace.gone_m < 1e-6
    }

    /// Gives up, and comes to rest.
    fn stop(&mut self, why: String) {
        self.stopped.get_or_insert(why);
        if !matches!(self.stage, CarryStage::Resting { .. }) {
            self.stage = CarryStage::Resting { commands: 0, calm: 0 };
        }
    }

    /// Returns the next command, after the reply to the one before.
    pub fn advance(&mut self, session: &Session, last: Option<&CommandReply>) -> PlanAdvance {
        if let Some(reply) = last {
            self.left_steps = self.left_steps.saturating_sub(reply.executed_steps);
            if reply.fallen.iter().any(|robot| robot.fallen) {
                return PlanAdvance::Done(Some("a robot has fallen".into()));
            }
            if let Some(why) = session.why_not_on(reply, self) {
                self.stop(why);
            }
            if session.is_done(all_stand(reply), self) {
                return PlanAdvance::Done(self.stopped.take());
            }
        }
        if self.left_steps == 0 {
            let used_up = || format!("the steps are used up; {}", session.how_far_off(self));
            return PlanAdvance::Done(Some(self.stopped.clone().unwrap_or_else(used_up)));
        }
        PlanAdvance::Make(session.next_moves(self, self.left_steps.min(WALK_STEPS)))
    }
}

impl Session {
    /// Begins a walk of robots, and what those hold that carry, to their places.
    pub(super) fn carry_plan(&self, walk: &WalkTo) -> Result<CarryPlan, EpisodeError> {
        let carriers = walk.robots.iter().map(|entry| self.carrier(entry));
        Ok(CarryPlan::new(carriers.collect::<Result<_, _>>()?, walk.steps))
    }

    fn carrier(&self, entry: &Destination) -> Result<Carrier, EpisodeError> {
        let robot = commands::find(&entry.robot, &self.motions)?;
        let start_from_pelvis = &self.present.robots[robot].sensed.start_from_pelvis;
        let mut from = Stand::of(start_from_pelvis);
        let stand_from_pelvis = from.start_from_stand().inverse() * isometry_from_sim(start_from_pelvis);
        let way = |to: Stand| Way::new(std::mem::replace(&mut from, to), to);
        Ok(Carrier {
            name: entry.robot.clone(),
            robot,
            carries: entry.carry == Some(true),
            ways: self.stands_at(robot).places(entry).into_iter().map(way).collect(),
            stand_from_wrist: self.motions[robot].told_wrists().map(|wrist| stand_from_pelvis * wrist),
            before_m: None,
            empty: Sides::both(None),
            out_of_reach: None,
            corrections: Corrections::default(),
        })
    }

    /// The next command, of so many steps.
    fn next_moves(&self, plan: &mut CarryPlan, steps: u32) -> ActCall {
        let leg = plan.leg();
        let off_m: Vec<_> = plan.carriers.iter_mut().map(|carrier| self.off_path_m(carrier, leg)).collect();
        if plan.stage == CarryStage::OnWay {
            let share = self.share_of_pace(plan, &off_m);
            plan.pace.go(plan.length_m(), share, f64::from(steps) / CONTROL_HZ);
        } else {
            plan.pace.pace_m_s = 0.0;
        }
        let leg = plan.leg();
        let several = plan.carriers.iter().filter(|carrier| carrier.carries).count() > 1;
        let robots = plan.carriers.iter_mut().zip(&off_m).map(|(carrier, off_m)| {
            let base = match plan.stage {
                CarryStage::OnWay | CarryStage::Correcting(_) => {
                    let rate_1_s = plan.pace.pace_m_s / plan.ways_m[leg.0].max(1e-9);
                    self.velocity(carrier, leg, rate_1_s, off_m)
                }
                CarryStage::Pulse => {
                    let missing = self.missing_to_end(carrier);
                    match missing.is_within(WELL_M, WELL_RAD) {
                        true => [0.0; 3],
                        false => carrier.corrections.pulse(&missing),
                    }
                }
                CarryStage::Resting { .. } => [0.0; 3],
            };
            carrier.wrist_move(&carrier.at(leg), base, several)
        });
        ActCall::MoveWrists(MoveWrists { steps, robots: robots.collect() })
    }

    /// How far a robot is from where it is to be now, start frame: the mean of now and half a cycle ago, which
    /// knows nothing of the pelvis' sway.
    fn off_path_m(&self, carrier: &mut Carrier, leg: (usize, f64)) -> Vector2<f64> {
        let now_m = carrier.at(leg).at_m - self.stands_at(carrier.robot).at_m;
        0.5 * (now_m + carrier.before_m.replace(now_m).unwrap_or(now_m))
    }

    /// The share of its pace at which a team goes on of which robots are `off_m` their path: 0 where one lags
    /// too far, is turned away or does not reach what it holds.
    fn share_of_pace(&self, plan: &CarryPlan, off_m: &[Vector2<f64>]) -> f64 {
        let share = |off: f64, [slows, stops]: [f64; 2]| ((stops - off) / (stops - slows)).clamp(0.0, 1.0);
        plan.carriers.iter().zip(off_m).fold(1.0, |least, (carrier, off_m)| {
            let reaches = if carrier.out_of_reach.is_some() { 0.0 } else { 1.0 };
            let turned_rad = self.turned_rad(carrier, plan.leg());
            least.min(share(off_m.norm(), LAG_M)).min(share(turned_rad, TURNED_RAD)).min(reaches)
        })
    }

    /// How far a robot is turned away from its path.
    fn turned_rad(&self, carrier: &Carrier, leg: (usize, f64)) -> f64 {
        wrapped(carrier.at(leg).heading_rad - self.stands_at(carrier.robot).heading_rad).abs()
    }

    /// The base command of a robot that is `off_m` its path, on which it goes on by so much of its way a
    /// second: ahead, left, turning.
    fn velocity(
        &self,
        carrier: &Carrier,
        leg: (usize, f64),
        rate_1_s: f64,
        off_m: &Vector2<f64>,
    ) -> [f64; 3] {
        let Way { shift_m, turn_rad, .. } = carrier.ways[leg.0];
        let to_be = carrier.at(leg);
        let heading_rad = self.stands_at(carrier.robot).heading_rad;
        let in_start_m_s = Rotation2::new(to_be.heading_rad) * shift_m * rate_1_s + GAIN_1_S * off_m;
        let own_m_s = (Rotation2::new(-heading_rad) * in_start_m_s).cap_magnitude(MAX_SPEED_M_S);
        let turning = turn_rad * rate_1_s + GAIN_1_S * wrapped(to_be.heading_rad - heading_rad);
        [own_m_s.x, own_m_s.y, turning.clamp(-TURN_RAD_S, TURN_RAD_S)]
    }

    /// Why the robots go no further, if they do not.
    fn why_not_on(&self, reply: &CommandReply, plan: &mut CarryPlan) -> Option<String> {
        let leg = plan.leg();
        let carrying = plan.carriers.iter_mut().zip(&reply.robots).filter(|(carrier, _)| carrier.carries);
        for (carrier, report) in carrying {
            if let Some(side) = carrier.lost(report) {
                return Some(format!("{}'s {} hand has lost what it held", carrier.name, side.name()));
            }
            carrier.out_of_reach =
                Side::BOTH.into_iter().find(|side| hand_state(report, *side) == Some(HandState::OutOfReach));
        }
        if plan.stage != CarryStage::OnWay {
            return None;
        }
        let stray = plan.carriers.iter().find_map(|carrier| {
            let turned_rad = self.turned_rad(carrier, leg);
            let turned = || format!("{} is turned away from its way by {turned_rad:.2} rad", carrier.name);
            let out = |side: Side| format!("{}'s {} wrist is out of reach", carrier.name, side.name());
            carrier.out_of_reach.map(out).or_else(|| (turned_rad > TURNED_RAD[1]).then(turned))
        });
        plan.strays = if stray.is_some() { plan.strays + 1 } else { 0 };
        if plan.pace.waited > LAGS_COMMANDS {
            return Some(format!(
                "it goes no further: something is in the way or too heavy; {}",
                self.how_far_off(plan)
            ));
        }
        stray
            .filter(|_| plan.strays >= STRAYS_COMMANDS)
            .map(|why| format!("they stopped with what they hold: {why}; {}", self.how_far_off(plan)))
    }

    /// Goes on to what comes after a command after which all `stand` or do not; whether nothing does.
    fn is_done(&self, stand: bool, plan: &mut CarryPlan) -> bool {
        plan.stage = match plan.stage {
            CarryStage::OnWay if plan.is_at_end() => CarryStage::Correcting(0),
            CarryStage::OnWay => CarryStage::OnWay,
            CarryStage::Correcting(commands) if commands + 1 < CORRECTING_COMMANDS => {
                CarryStage::Correcting(commands + 1)
            }
            CarryStage::Correcting(_) | CarryStage::Pulse => CarryStage::Resting { commands: 0, calm: 0 },
            CarryStage::Resting { commands, calm } => {
                let calm = if stand { calm + 1 } else { 0 };
                if calm >= CALM_COMMANDS || commands >= RESTING_COMMANDS {
                    return self.is_there(plan);
                }
                CarryStage::Resting { commands: commands + 1, calm }
            }
        };
        false
    }

    /// Whether a team that rests is to rest: at its places, or no nearer than it comes. Is sent once more
    /// otherwise.
    fn is_there(&self, plan: &mut CarryPlan) -> bool {
        let all_within = |most_m: f64, most_rad: f64| {
            plan.carriers.iter().all(|carrier| self.missing_to_end(carrier).is_within(most_m, most_rad))
        };
        if plan.stopped.is_some() || all_within(WELL_M, WELL_RAD) {
            return true;
        }
        if plan.attempts == ATTEMPTS {
            if !all_within(THERE_M, THERE_RAD) {
                plan.stopped = Some(format!("it came no nearer than this; {}", self.how_far_off(plan)));
            }
            return true;
        }
        plan.attempts += 1;
        plan.stage = CarryStage::Pulse;
        false
    }

    fn missing_to_end(&self, carrier: &Carrier) -> Missing {
        let now = self.stands_at(carrier.robot);
        now.missing_to(&carrier.ways.last().map_or(now, |way| way.at(1.0)))
    }

    fn how_far_off(&self, plan: &CarryPlan) -> String {
        let far = |carrier: &Carrier| self.missing_to_end(carrier).told(&carrier.name);
        plan.carriers.iter().map(far).collect::<Vec<_>>().join(", ")
    }
}

fn hand_state(report: &RobotReport, side: Side) -> Option<HandState> {
    match side {
        Side::Left => report.left.state,
        Side::Right => report.right.state,
    }
}

impl Carrier {
    /// Where it is to be after a share of one of its ways.
    fn at(&self, (leg, share): (usize, f64)) -> Stand {
        self.ways[leg].at(share)
    }

    /// Goes on with this base command while its wrists go to where they are of one that stands at `stand`.
    fn wrist_move(
        &self,
        stand: &Stand,
        [vx_m_s, vy_m_s, yaw_rate_rad_s]: [f64; 3],
        several: bool,
    ) -> WristMove {
        let base = WristMove {
            vx_m_s: Some(vx_m_s),
            vy_m_s: Some(vy_m_s),
            yaw_rate_rad_s: Some(yaw_rate_rad_s),
            ..WristMove::hold(&self.name)
        };
        if !self.carries {
            return base;
        }
        let wrist = |side: Side| stand.start_from_stand() * self.stand_from_wrist[side];
        let position_m = |side: Side| Some(wrist(side).translation.vector.into());
        let quaternion_wxyz = |side: Side| {
            let turned = wrist(side).rotation;
            Some([turned.w, turned.i, turned.j, turned.k])
        };
        WristMove {
            frame: Some(tandem_tools_spec::PoseFrame::Start),
            left_position_m: position_m(Side::Left),
            left_quaternion_wxyz: quaternion_wxyz(Side::Left),
            right_position_m: position_m(Side::Right),
            right_quaternion_wxyz: quaternion_wxyz(Side::Right),
            // One who has no partner gives way to nobody.
            compliance_n_s_m: several.then_some(COMPLIANCE_N_S_M),
            ..base
        }
    }

    /// The hand that has lost what it held, if one has.
    fn lost(&mut self, report: &RobotReport) -> Option<Side> {
        Side::BOTH.into_iter().find(|side| {
            let grip = match side {
                Side::Left => report.left.grip,
                Side::Right => report.right.grip,
            };
            let empty = &mut self.empty[*side];
            *empty = match (grip, *empty) {
                (Some(Grip::TwoSided), _) => Some(0),
                (Some(Grip::None), Some(commands)) => Some(commands + 1),
                (_, before) => before,
            };
            empty.is_some_and(|commands| commands >= LOST_COMMANDS)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_gone_from_rest_to_rest_and_waits() {
        let mut pace = PathPace::default();
        let mut paces = Vec::new();
        while 1.0 - pace.gone_m > 1e-9 {
            pace.go(1.0, 1.0, 0.26);
            paces.push(pace.pace_m_s);
        }
        assert!((pace.gone_m - 1.0).abs() < 1e-9 && paces.len() < 40, "{paces:?}");
        assert!(paces[0] < 0.06 && paces.iter().all(|pace| *pace <= PACE_M_S), "{paces:?}");
        let mut slowed = PathPace { gone_m: 0.3, pace_m_s: 0.2, waited: 0 };
        slowed.go(1.0, 0.4, 0.26);
        assert!((slowed.pace_m_s - 0.4 * PACE_M_S).abs() < 1e-9, "{}", slowed.pace_m_s);
        let mut held_up = PathPace { gone_m: 0.5, pace_m_s: 0.2, waited: 0 };
        for _ in 0..10 {
            held_up.go(1.0, 0.0, 0.26);
        }
        assert!(held_up.waited == 10 && held_up.gone_m < 0.56, "{}", held_up.gone_m);
    }
}
