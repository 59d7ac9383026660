//! `walk_to` of robots that push or carry: bases and hands go along one path, from rest to rest, each robot's in its own start frame.
//!
//! A path is a turn and a shift at a constant rate, as of one rigid body. Robots that hold one load, and whose places fit it, so go as if
//! they were one body with it all along the way, though none of them knows where the others are.

use nalgebra::{Isometry3, Rotation2, Translation3, UnitQuaternion, Vector2, Vector3};
use tandem_sim::{CONTROL_HZ, Side, Sides};
use tandem_tools_spec::{
    ActCall, BaseState, CommandReply, Destination, Grip, MoveWrists, PlanReply, RobotReport, WalkTo,
    WristMove,
};

use super::PlanProgress;
use super::walk_to::{WALK_STEPS, heading_rad, wrapped};
use crate::EpisodeError;
use crate::commands;
use crate::convert::isometry_from_sim;
use crate::recording::CallerRecord;
use crate::session::Session;

/// How fast a path is gone, and how soon that is so. A radian is as long as so many metres.
const PACE_M_S: f64 = 0.2;
const ACCELERATION_M_S2: f64 = 0.2;
const CREEP_M_S: f64 = 0.02;
const M_PER_RAD: f64 = 0.5;
/// A path waits for a robot that lags by more, and is given up after so many commands of that.
const LEAD_M: f64 = 0.2;
const PATIENCE_COMMANDS: u32 = 16;
/// Velocity for what a robot is off its path, and the most of it with the path's own; turning. Twice the gain makes robots that walk half
/// a second behind their commands swing from side to side, more and more.
const GAIN_1_S: f64 = 0.5;
const MOST_M_S: f64 = 0.3;
const TURN_RAD_S: f64 = 0.4;
/// How hands give way to partners.
const COMPLIANCE_N_S_M: f64 = 250.0;
/// At its end robots correct their places in so many commands, and then come to rest within so many.
const CORRECTING_COMMANDS: u32 = 4;
const RESTING_COMMANDS: u32 = 12;
/// One that stands this near has arrived.
const THERE_M: f64 = 0.15;
const THERE_RAD: f64 = 0.1;
/// A hand that held and holds nothing for so many commands has lost it.
const LOST_COMMANDS: u32 = 4;

/// A place and a heading on the floor, in a start frame.
#[derive(Clone, Copy, Debug)]
struct Stand {
    at_m: Vector2<f64>,
    heading_rad: f64,
}

/// The way from one place to another, as a rigid body goes that turns and shifts at constant rates:
///   p(s) = p_0 + R_0 V(s w) s v,   V(a) = [sin a, -(1 - cos a); 1 - cos a, sin a] / a,   s in 0..=1.
/// v is chosen so that p(1) is the other place. Each point of that body goes along such a way with the same w.
#[derive(Clone, Copy, Debug)]
struct Way {
    from: Stand,
    /// v and w, for the whole way.
    shift_m: Vector2<f64>,
    turn_rad: f64,
}

/// One robot on its way.
struct Carrier {
    name: String,
    robot: usize,
    carries: bool,
    way: Way,
    /// Where its wrists stay, in the frame of the place where it stands.
    stand_from_wrist: Sides<Isometry3<f64>>,
    /// What it was off its path half a cycle of its gait ago.
    before_m: Option<Vector2<f64>>,
    /// For how many commands each hand that held has held nothing; `None` before it holds.
    empty: Sides<Option<u32>>,
}

/// How far a path has been gone, and how fast.
#[derive(Default)]
struct PathPace {
    gone_m: f64,
    pace_m_s: f64,
    waited: u32,
}

impl Stand {
    fn of(start_from_pelvis: &tandem_sim::Pose) -> Stand {
        let at = isometry_from_sim(start_from_pelvis).translation.vector;
        Stand { at_m: at.xy(), heading_rad: heading_rad(start_from_pelvis) }
    }

    fn start_from_stand(&self) -> Isometry3<f64> {
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.heading_rad);
        Isometry3::from_parts(Translation3::new(self.at_m.x, self.at_m.y, 0.0), turned)
    }
}

impl Way {
    fn new(from: Stand, to: Stand) -> Way {
        let turn_rad = wrapped(to.heading_rad - from.heading_rad);
        let [x, y]: [f64; 2] = (Rotation2::new(-from.heading_rad) * (to.at_m - from.at_m)).into();
        // V^-1 = [c, w/2; -w/2, c], c = w/2 / tan(w/2)
        let half = 0.5 * turn_rad;
        let c = if half.abs() < 1e-6 { 1.0 } else { half / half.tan() };
        Way { from, shift_m: Vector2::new(c * x + half * y, c * y - half * x), turn_rad }
    }

    fn length_m(&self) -> f64 {
        self.shift_m.norm().max(M_PER_RAD * self.turn_rad.abs())
    }

    fn at(&self, share: f64) -> Stand {
        let angle = share * self.turn_rad;
        let (sine, versine) = if angle.abs() < 1e-6 {
            (1.0, 0.5 * angle)
        } else {
            (angle.sin() / angle, (1.0 - angle.cos()) / angle)
        };
        let [x, y]: [f64; 2] = (share * self.shift_m).into();
        let moved_m = Vector2::new(sine * x - versine * y, versine * x + sine * y);
        Stand {
            at_m: self.from.at_m + Rotation2::new(self.from.heading_rad) * moved_m,
            heading_rad: self.from.heading_rad + angle,
        }
    }
}

impl PathPace {
    /// Goes on for `time_s` along a path of `length_m`, on which somebody lags by `lag_m`.
    fn go(&mut self, length_m: f64, lag_m: f64, time_s: f64) {
        let left_m = length_m - self.gone_m;
        if lag_m > LEAD_M {
            (self.pace_m_s, self.waited) = (0.5 * self.pace_m_s, self.waited + 1);
        } else {
            let can_stop_m_s = (2.0 * ACCELERATION_M_S2 * left_m).sqrt().max(CREEP_M_S);
            self.pace_m_s = (self.pace_m_s + ACCELERATION_M_S2 * time_s).min(can_stop_m_s).min(PACE_M_S);
            self.waited = 0;
        }
        self.pace_m_s = self.pace_m_s.min(left_m / time_s);
        self.gone_m += self.pace_m_s * time_s;
    }
}

impl Session {
    /// Takes robots, and what those hold that carry, to their places.
    pub(super) fn carry_to(
        &mut self,
        caller: CallerRecord,
        walk: &WalkTo,
    ) -> Result<PlanReply, EpisodeError> {
        let carriers = walk.robots.iter().map(|entry| self.carrier(entry));
        let mut carriers: Vec<Carrier> = carriers.collect::<Result<_, _>>()?;
        let length_m = carriers.iter().map(|carrier| carrier.way.length_m()).fold(0.0, f64::max);
        let mut progress = PlanProgress::default();
        let mut pace = PathPace::default();
        let mut at_end = 0;
        loop {
            let left = walk.steps.saturating_sub(progress.executed_steps());
            if left == 0 {
                let why = format!("the steps are used up; {}", self.how_far_off(&carriers));
                return self.plan_reply(progress, Some(why));
            }
            let steps = left.min(WALK_STEPS);
            let is_there = length_m - pace.gone_m < 1e-6;
            let part = |gone_m: f64| if length_m > 0.0 { (gone_m / length_m).min(1.0) } else { 1.0 };
            let off_m = self.off_path(&mut carriers, part(pace.gone_m));
            if is_there {
                (pace.pace_m_s, at_end) = (0.0, at_end + 1);
            } else {
                let lag_m = off_m.iter().map(Vector2::norm).fold(0.0, f64::max);
                pace.go(length_m, lag_m, f64::from(steps) / CONTROL_HZ);
            }
            let rests = at_end > CORRECTING_COMMANDS;
            let rate_1_s = if length_m > 0.0 { pace.pace_m_s / length_m } else { 0.0 };
            let several = carriers.iter().filter(|carrier| carrier.carries).count() > 1;
            let robots = carriers.iter().zip(&off_m).map(|(carrier, off_m)| {
                let base =
                    if rests { [0.0; 3] } else { self.velocity(carrier, part(pace.gone_m), rate_1_s, off_m) };
                carrier.wrist_move(&carrier.way.at(part(pace.gone_m)), base, several)
            });
            let call = ActCall::MoveWrists(MoveWrists { steps, robots: robots.collect() });
            let reply = match self.make_planned(caller, call, &mut progress)? {
                Err(why) => return self.plan_reply(progress, Some(why)),
                Ok(reply) => reply,
            };
            let stands = rests && stand(reply);
            if let Some(why) = self.why_not_on(reply, &mut carriers, pace.waited) {
                return self.plan_reply(progress, Some(why));
            }
            if stands || at_end > CORRECTING_COMMANDS + RESTING_COMMANDS {
                let off = carriers.iter().any(|carrier| !self.has_arrived(carrier));
                let why =
                    off.then(|| format!("it came no nearer than this; {}", self.how_far_off(&carriers)));
                return self.plan_reply(progress, why);
            }
        }
    }

    fn carrier(&self, entry: &Destination) -> Result<Carrier, EpisodeError> {
        let robot = commands::find(&entry.robot, &self.motions)?;
        let start_from_pelvis = &self.present.robots[robot].sensed.start_from_pelvis;
        let from = Stand::of(start_from_pelvis);
        let to =
            Stand { at_m: entry.to_m.into(), heading_rad: entry.heading_rad.unwrap_or(from.heading_rad) };
        let stand_from_pelvis = from.start_from_stand().inverse() * isometry_from_sim(start_from_pelvis);
        Ok(Carrier {
            name: entry.robot.clone(),
            robot,
            carries: entry.carry == Some(true),
            way: Way::new(from, to),
            stand_from_wrist: self.motions[robot].told_wrists().map(|wrist| stand_from_pelvis * wrist),
            before_m: None,
            empty: Sides::both(None),
        })
    }

    fn stands_at(&self, carrier: &Carrier) -> Stand {
        Stand::of(&self.present.robots[carrier.robot].sensed.start_from_pelvis)
    }

    /// How far each robot is from where it is to be after this part of its way, start frame: the mean of now and half a cycle ago, which
    /// knows nothing of the pelvis' sway.
    fn off_path(&self, carriers: &mut [Carrier], share: f64) -> Vec<Vector2<f64>> {
        let off = |carrier: &mut Carrier| {
            let now_m = carrier.way.at(share).at_m - self.stands_at(carrier).at_m;
            0.5 * (now_m + carrier.before_m.replace(now_m).unwrap_or(now_m))
        };
        carriers.iter_mut().map(off).collect()
    }

    /// The base command of a robot that is `off_m` its path, on which it goes on by so much of it a second: ahead, left, turning.
    fn velocity(&self, carrier: &Carrier, share: f64, rate_1_s: f64, off_m: &Vector2<f64>) -> [f64; 3] {
        let Way { shift_m, turn_rad, .. } = carrier.way;
        let to_be = carrier.way.at(share);
        let heading_rad = self.stands_at(carrier).heading_rad;
        let in_start_m_s = Rotation2::new(to_be.heading_rad) * shift_m * rate_1_s + GAIN_1_S * off_m;
        let own_m_s = (Rotation2::new(-heading_rad) * in_start_m_s).cap_magnitude(MOST_M_S);
        let turning = turn_rad * rate_1_s + GAIN_1_S * wrapped(to_be.heading_rad - heading_rad);
        [own_m_s.x, own_m_s.y, turning.clamp(-TURN_RAD_S, TURN_RAD_S)]
    }

    /// Why the robots go no further, if they do not.
    fn why_not_on(&self, reply: &CommandReply, carriers: &mut [Carrier], waited: u32) -> Option<String> {
        if reply.fallen.iter().any(|robot| robot.fallen) {
            return Some("a robot has fallen".into());
        }
        for (carrier, report) in carriers.iter_mut().zip(&reply.robots).filter(|(carrier, _)| carrier.carries)
        {
            if let Some(side) = carrier.lost(report) {
                return Some(format!("{}'s {} hand has lost what it held", carrier.name, side.name()));
            }
        }
        (waited > PATIENCE_COMMANDS).then(|| {
            format!(
                "it goes no further: something is in the way or too heavy; {}",
                self.how_far_off(carriers)
            )
        })
    }

    fn has_arrived(&self, carrier: &Carrier) -> bool {
        let (is, to_be) = (self.stands_at(carrier), carrier.way.at(1.0));
        (to_be.at_m - is.at_m).norm() <= THERE_M
            && wrapped(to_be.heading_rad - is.heading_rad).abs() <= THERE_RAD
    }

    fn how_far_off(&self, carriers: &[Carrier]) -> String {
        let far = |carrier: &Carrier| {
            let (is, to_be) = (self.stands_at(carrier), carrier.way.at(1.0));
            let (off_m, off_rad) =
                ((to_be.at_m - is.at_m).norm(), wrapped(to_be.heading_rad - is.heading_rad).abs());
            format!("{} is {off_m:.2} m and {off_rad:.2} rad off its place", carrier.name)
        };
        carriers.iter().map(far).collect::<Vec<_>>().join(", ")
    }
}

fn stand(reply: &CommandReply) -> bool {
    let states = reply.robots.iter().map(|robot| robot.base.and_then(|base| base.state));
    states.flatten().all(|state| state == BaseState::Standing)
}

impl Carrier {
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
    use std::f64::consts::PI;

    use super::*;

    fn stand(x_m: f64, y_m: f64, heading_rad: f64) -> Stand {
        Stand { at_m: Vector2::new(x_m, y_m), heading_rad }
    }

    /// Two robots that face each other across a load, each with a start frame of its own: all along their ways they are where they were to
    /// each other.
    #[test]
    fn robots_whose_places_fit_go_as_one_body() {
        // The start frame of B in that of A, and where B stands as A stands.
        let a_from_b = stand(1.3, 0.1, 2.9).start_from_stand();
        let stand_from_partner = stand(1.2, 0.05, PI).start_from_stand();
        let b_of = |a: &Stand| {
            let there = a_from_b.inverse() * a.start_from_stand() * stand_from_partner;
            let ahead = there.rotation * Vector3::x();
            stand(there.translation.x, there.translation.y, ahead.y.atan2(ahead.x))
        };
        let (from, to) = (stand(0.1, -0.2, 0.3), stand(-0.6, 0.9, 1.5));
        let ways = [Way::new(from, to), Way::new(b_of(&from), b_of(&to))];
        for part in [0.0, 0.3, 0.5, 0.8, 1.0] {
            let [a, b] = ways.map(|way| way.at(part));
            let fits = b_of(&a);
            assert!((fits.at_m - b.at_m).norm() < 1e-9, "{part}: {fits:?} and {b:?}");
            assert!(wrapped(fits.heading_rad - b.heading_rad).abs() < 1e-9, "{part}");
        }
        for (part, end) in [(0.0, from), (1.0, to)] {
            let at = ways[0].at(part);
            assert!((at.at_m - end.at_m).norm() < 1e-9 && (at.heading_rad - end.heading_rad).abs() < 1e-9);
        }
        let straight = Way::new(stand(0.0, 0.0, 0.5), stand(1.0, 2.0, 0.5));
        assert!((straight.at(0.5).at_m - Vector2::new(0.5, 1.0)).norm() < 1e-9, "{straight:?}");
    }

    #[test]
    fn a_path_is_gone_from_rest_to_rest_and_waits() {
        let mut pace = PathPace::default();
        let mut paces = Vec::new();
        while 1.0 - pace.gone_m > 1e-9 {
            pace.go(1.0, 0.05, 0.26);
            paces.push(pace.pace_m_s);
        }
        assert!((pace.gone_m - 1.0).abs() < 1e-9 && paces.len() < 40, "{paces:?}");
        assert!(paces[0] < 0.06 && paces.iter().all(|pace| *pace <= PACE_M_S), "{paces:?}");
        let mut held_up = PathPace { gone_m: 0.5, pace_m_s: 0.2, waited: 0 };
        for _ in 0..10 {
            held_up.go(1.0, LEAD_M + 0.01, 0.26);
        }
        assert!(held_up.waited == 10 && held_up.gone_m < 0.56, "{}", held_up.gone_m);
    }
}
