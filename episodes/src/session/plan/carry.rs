//! `walk_to` for robots that push or carry: bases and hands follow one path from rest to rest. Each robot's
//! path is in that robot's start frame.
//!
//! A path is a sequence of legs, each a turn and a shift at constant rates, in the manner of a rigid body.
//! Robots that hold one load, with places that fit it, thus move as one body with the load, without
//! information about each other's poses. The wrists keep the poses relative to the robot's planned place that
//! they had at the first step. An error of the base therefore does not carry over to the next leg. Robots
//! walk half a second behind their commands, so base commands are ahead of the planned places by that time.

use nalgebra::{Isometry3, Rotation2, Vector2};
use tandem_sim::{CONTROL_HZ, Side, Sides};
use tandem_tools_spec::{
    ActCall, CommandReply, Destination, Grip, HandState, MoveWrists, PoseFrame, RobotReport, WalkTo,
    WristMove,
};

use super::PlanAdvance;
use super::pace::PathPace;
use super::walk_to::{ATTEMPTS, CALM_COMMANDS, THERE_M, THERE_RAD, WELL_M, WELL_RAD, all_stand};
use super::way::{Corrections, Missing, Stand, WALK_STEPS, Way, wrapped};
use crate::EpisodeError;
use crate::commands;
use crate::convert::isometry_from_sim;
use crate::session::Session;

/// Progress along the path slows down for a robot that lags by the first distance, and stops at the second.
/// The path is given up after waiting for this many commands. The angles apply to robots turned away from the
/// path.
const LAG_M: [f64; 2] = [0.13, 0.18];
const LAGS_COMMANDS: u32 = 16;
const TURNED_RAD: [f64; 2] = [0.12, 0.2];
/// Number of commands with a robot turned away, or a wrist out of reach, after which the path is given up.
const STRAYS_COMMANDS: u32 = 3;
/// Gain on the distance from the path, and limits of the total speed and of the yaw rate. Twice this gain
/// makes robots oscillate with a growing amplitude, since they walk behind their commands.
const GAIN_1_S: f64 = 0.5;
const MAX_SPEED_M_S: f64 = 0.3;
const TURN_RAD_S: f64 = 0.4;
/// Compliance of hands that carry with partners.
const COMPLIANCE_N_S_M: f64 = 250.0;
/// Number of commands for corrections at the end of the path, and maximum number of further commands until
/// rest.
const CORRECTING_COMMANDS: u32 = 4;
const RESTING_COMMANDS: u32 = 12;
/// Number of commands without a hold after which a hand has lost its object.
const LOST_COMMANDS: u32 = 4;

/// A robot on the path.
#[derive(Debug)]
struct Carrier {
    name: String,
    robot: usize,
    carries: bool,
    /// Hands that move along: those with a wrist target or a grip. The other arms keep their joints.
    hands: Sides<bool>,
    ways: Vec<Way>,
    /// Fixed wrist poses in the frame of the robot's planned place.
    stand_from_wrist: Sides<Isometry3<f64>>,
    /// Displacement to the path half a gait cycle ago.
    before_m: Option<Vector2<f64>>,
    /// Number of commands without a hold of each hand; `None` before its first hold.
    empty: Sides<Option<u32>>,
    /// Hand with a target out of reach.
    out_of_reach: Option<Side>,
    corrections: Corrections,
}

/// Next action of a team.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CarryStage {
    OnWay,
    /// Corrections at the end of the path, with the number of commands made.
    Correcting(u32),
    /// Standing, with the number of commands made, and the number of consecutive ones up to now with all
    /// robots standing.
    Resting {
        commands: u32,
        calm: u32,
    },
    /// A short walk of each robot from its standing place to its goal.
    Pulse,
}

/// Robots that follow one path.
#[derive(Debug)]
pub struct CarryPlan {
    carriers: Vec<Carrier>,
    /// Remaining control steps.
    left_steps: u32,
    /// Length of each leg: the longest among the robots.
    ways_m: Vec<f64>,
    pace: PathPace,
    stage: CarryStage,
    attempts: u32,
    /// Number of consecutive commands with a robot turned away, or a wrist out of reach.
    strays: u32,
    /// Reason why the robots stop early.
    stopped: Option<String>,
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

    /// Returns the leg on which robots are expected, and the completed fraction of it.
    fn leg(&self) -> (usize, f64) {
        self.leg_at(self.pace.expected_m())
    }

    /// Returns the leg at a distance along the path, and the completed fraction of it.
    fn leg_at(&self, mut left_m: f64) -> (usize, f64) {
        for (leg, way_m) in self.ways_m.iter().enumerate() {
            if left_m < *way_m {
                return (leg, left_m / way_m);
            }
            left_m -= way_m;
        }
        (self.ways_m.len() - 1, 1.0)
    }

    fn is_at_end(&self) -> bool {
        self.length_m() - self.pace.expected_m() < 1e-6
    }

    /// Gives up and lets the robots come to rest.
    pub fn stop(&mut self, why: String) {
        self.stopped.get_or_insert(why);
        if !matches!(self.stage, CarryStage::Resting { .. }) {
            self.stage = CarryStage::Resting { commands: 0, calm: 0 };
        }
    }

    /// Returns the next command after the reply to the previous one.
    pub fn advance(&mut self, session: &Session, last: Option<&CommandReply>) -> PlanAdvance {
        if let Some(reply) = last {
            self.left_steps = self.left_steps.saturating_sub(reply.executed_steps);
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
    /// Starts a walk of robots, some of which carry or push a load, to their places.
    pub(super) fn carry_plan(&self, walk: &WalkTo) -> Result<CarryPlan, EpisodeError> {
        let carriers = walk.robots.iter().map(|entry| self.carrier(entry, walk.frame));
        Ok(CarryPlan::new(carriers.collect::<Result<_, _>>()?, walk.steps))
    }

    fn carrier(&self, entry: &Destination, frame: PoseFrame) -> Result<Carrier, EpisodeError> {
        let robot = commands::find(&entry.robot, &self.motions)?;
        let start_from_pelvis = &self.present.robots[robot].sensed.start_from_pelvis;
        let mut from = Stand::of(start_from_pelvis);
        let stand_from_pelvis = from.start_from_stand().inverse() * isometry_from_sim(start_from_pelvis);
        let way = |to: Stand| Way::new(std::mem::replace(&mut from, to), to);
        Ok(Carrier {
            name: entry.robot.clone(),
            robot,
            carries: entry.carry == Some(true),
            hands: Sides::from_fn(|side| {
                let motion = &self.motions[robot];
                let sensed = &self.present.robots[robot].sensed;
                motion.aims_at_pose(side) || commands::grip(side, sensed, motion) != Grip::None
            }),
            ways: self.places(robot, entry, frame).into_iter().map(way).collect(),
            stand_from_wrist: self.motions[robot].wrists().map(|wrist| stand_from_pelvis * wrist.target),
            before_m: None,
            empty: Sides::both(None),
            out_of_reach: None,
            corrections: Corrections::default(),
        })
    }

    /// Returns the next command, of `steps` control steps.
    fn next_moves(&self, plan: &mut CarryPlan, steps: u32) -> ActCall {
        let leg = plan.leg();
        let off_m: Vec<_> = plan.carriers.iter_mut().map(|carrier| self.off_path_m(carrier, leg)).collect();
        if plan.stage == CarryStage::OnWay {
            let share = self.share_of_pace(plan, &off_m);
            plan.pace.go(plan.length_m(), share, f64::from(steps) / CONTROL_HZ);
        } else {
            plan.pace.stand();
        }
        let (leg, commanded) = (plan.leg(), plan.leg_at(plan.pace.gone_m));
        let several = plan.carriers.iter().filter(|carrier| carrier.carries).count() > 1;
        let robots = plan.carriers.iter_mut().zip(&off_m).map(|(carrier, off_m)| {
            let base = match plan.stage {
                CarryStage::OnWay | CarryStage::Correcting(_) => {
                    let rate_1_s = plan.pace.pace_m_s / plan.ways_m[commanded.0].max(1e-9);
                    self.velocity(carrier, [leg, commanded], rate_1_s, off_m)
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

    /// Returns the displacement from a robot to its planned place, in its start frame. It is the mean of
    /// the current value and the one half a gait cycle ago, which cancels the sway of the pelvis.
    fn off_path_m(&self, carrier: &mut Carrier, leg: (usize, f64)) -> Vector2<f64> {
        let now_m = carrier.at(leg).at_m - self.stands_at(carrier.robot).at_m;
        0.5 * (now_m + carrier.before_m.replace(now_m).unwrap_or(now_m))
    }

    /// Returns the fraction of the normal speed for a team whose robots are `off_m` from the path. It is
    /// 0 if a robot lags too far, is turned away, or cannot reach its load.
    fn share_of_pace(&self, plan: &CarryPlan, off_m: &[Vector2<f64>]) -> f64 {
        let share = |off: f64, [slows, stops]: [f64; 2]| ((stops - off) / (stops - slows)).clamp(0.0, 1.0);
        plan.carriers.iter().zip(off_m).fold(1.0, |least, (carrier, off_m)| {
            let reaches = if carrier.out_of_reach.is_some() { 0.0 } else { 1.0 };
            let turned_rad = self.turned_rad(carrier, plan.leg());
            least.min(share(off_m.norm(), LAG_M)).min(share(turned_rad, TURNED_RAD)).min(reaches)
        })
    }

    /// Returns the angle between a robot's heading and its planned heading.
    fn turned_rad(&self, carrier: &Carrier, leg: (usize, f64)) -> f64 {
        wrapped(carrier.at(leg).heading_rad - self.stands_at(carrier.robot).heading_rad).abs()
    }

    /// Returns the base command of a robot that is `off_m` from its place on the expected leg and advances on
    /// the commanded one by `rate_1_s`: ahead, left, turning.
    fn velocity(
        &self,
        carrier: &Carrier,
        [expected, commanded]: [(usize, f64); 2],
        rate_1_s: f64,
        off_m: &Vector2<f64>,
    ) -> [f64; 3] {
        let Way { shift_m, turn_rad, .. } = carrier.ways[commanded.0];
        let heading_rad = self.stands_at(carrier.robot).heading_rad;
        let shift_m = Rotation2::new(carrier.at(commanded).heading_rad) * shift_m;
        let in_start_m_s = shift_m * rate_1_s + GAIN_1_S * off_m;
        let own_m_s = (Rotation2::new(-heading_rad) * in_start_m_s).cap_magnitude(MAX_SPEED_M_S);
        let off_rad = wrapped(carrier.at(expected).heading_rad - heading_rad);
        let turning = turn_rad * rate_1_s + GAIN_1_S * off_rad;
        [own_m_s.x, own_m_s.y, turning.clamp(-TURN_RAD_S, TURN_RAD_S)]
    }

    /// Returns the reason why the robots must stop; `None` if they can continue.
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
            .map(|why| format!("stopped with the load in hand: {why}; {}", self.how_far_off(plan)))
    }

    /// Advances to the next stage after a command; `stand` is true if all robots stand. Returns true at
    /// the end.
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

    /// Returns true if a resting team has reached its places, or cannot get closer. Otherwise starts
    /// another attempt.
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
    /// Returns the planned place after a fraction of one of the legs.
    fn at(&self, (leg, share): (usize, f64)) -> Stand {
        self.ways[leg].at(share)
    }

    /// Returns a move with this base command, in which the wrists take their poses relative to `stand`.
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
        let wrist =
            |side: Side| self.hands[side].then(|| stand.start_from_stand() * self.stand_from_wrist[side]);
        let position_m = |side: Side| wrist(side).map(|wrist| wrist.translation.vector.into());
        let quaternion_wxyz = |side: Side| {
            wrist(side).map(|Isometry3 { rotation, .. }| [rotation.w, rotation.i, rotation.j, rotation.k])
        };
        WristMove {
            frame: Some(tandem_tools_spec::PoseFrame::Start),
            left_position_m: position_m(Side::Left),
            left_quaternion_wxyz: quaternion_wxyz(Side::Left),
            right_position_m: position_m(Side::Right),
            right_quaternion_wxyz: quaternion_wxyz(Side::Right),
            // Without a partner, the hands stay stiff.
            compliance_n_s_m: several.then_some(COMPLIANCE_N_S_M),
            ..base
        }
    }

    /// Returns the hand that has lost its object, if there is one.
    fn lost(&mut self, report: &RobotReport) -> Option<Side> {
        Side::BOTH.into_iter().find(|side| {
            let grip = match side {
                Side::Left => report.left.grip,
                Side::Right => report.right.grip,
            };
            let empty = &mut self.empty[*side];
            *empty = commands_without_hold(*empty, grip);
            empty.is_some_and(|commands| commands >= LOST_COMMANDS)
        })
    }
}

/// Counts the commands since a hand has lost its hold; `None` before its first one.
fn commands_without_hold(before: Option<u32>, grip: Option<Grip>) -> Option<u32> {
    match (grip, before) {
        (Some(Grip::TwoSided), _) => Some(0),
        (Some(Grip::None | Grip::Touching), Some(commands)) => Some(commands + 1),
        (Some(Grip::None | Grip::Touching | Grip::OneSided) | None, before) => before,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_that_only_touches_has_lost_its_hold() {
        let count = |grips: &[Grip]| {
            grips.iter().fold(None, |before, grip| commands_without_hold(before, Some(*grip)))
        };
        assert_eq!(count(&[Grip::Touching, Grip::None]), None, "it has held nothing yet");
        assert_eq!(count(&[Grip::TwoSided, Grip::Touching, Grip::None]), Some(2));
        assert_eq!(
            count(&[Grip::TwoSided, Grip::Touching, Grip::OneSided]),
            Some(1),
            "one side still presses"
        );
        assert_eq!(count(&[Grip::TwoSided, Grip::None, Grip::TwoSided]), Some(0));
    }
}
