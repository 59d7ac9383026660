//! Control in real time by people, and by programs that speak as their page does.
//!
//! A page sends up to 50 setpoints a second for its robot's wrists, fingers and base; a program may send
//! joint targets or setpoints of motors. Every control step, the latest setpoint becomes a command of one
//! step by the operator of that robot. It goes through
//! the team's rounds like any other command. So the world runs no faster than real time, and pauses while
//! a person is away.
//!
//! A log of 50 commands a second replays bit for bit. The wall clock only decides, before a call is made,
//! which setpoint becomes a command. The session sees whole control steps in the order of its calls. The
//! recording holds each call with exact numbers, and replay makes the same calls again. Setpoints that
//! were never commanded leave no trace in the world or the log.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tandem_tools_spec::{
    Call, GetRobotState, JointChunk, JointDrives, MoveWrists, SendJointChunk, SendJointDrives, ToolCall,
    WristMove,
};
use tokio::{
    sync::mpsc,
    time::{MissedTickBehavior, interval},
};

use super::{Team, Wheels};
use crate::hosting::{Answer, EpisodeThread, HostingError};

/// Duration of a control step.
pub(super) const TICK: Duration = Duration::from_millis(20);

/// Silence after which a person counts as away, for example because the page is hidden or the link is
/// cut.
const AWAY_AFTER: Duration = Duration::from_millis(500);

/// Maximum speed of a wrist's target per control step, however far away the next setpoint is.
const WRIST_M_PER_STEP: f64 = 1.5 * 0.02;
const WRIST_RAD_PER_STEP: f64 = 6.0 * 0.02;

/// Number of answers that a page may lag behind.
const KEPT_ANSWERS: usize = 64;

/// Setpoint of a robot for one control step.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "one setpoint a robot; wrists are the usual one")]
pub enum Setpoint {
    /// Wrists, fingers and base.
    Wrists(WristMove),
    /// One row of joint targets and base.
    Joints(JointChunk),
    /// One row of motors' setpoints.
    Drives(JointDrives),
}

impl Setpoint {
    /// Returns the command of one control step.
    pub fn call(self) -> ToolCall {
        match self {
            Setpoint::Wrists(entry) => MoveWrists { steps: 1, robots: vec![entry] }.into(),
            Setpoint::Joints(chunk) => SendJointChunk { robots: vec![chunk] }.into(),
            Setpoint::Drives(drives) => SendJointDrives { robots: vec![drives] }.into(),
        }
    }
}

/// A person's current request for a robot.
#[derive(Debug, Clone)]
pub struct Wish {
    pub setpoint: Setpoint,
    /// True to receive the robot's state with the sensors of every physics step after each command.
    pub tells_state: bool,
    /// True while time may pass.
    pub go: bool,
    /// Control steps that may pass while `go` is false, for single stepping.
    pub steps: u32,
}

/// A person who drives; dropping it releases the robots.
#[derive(Debug)]
pub struct Driver {
    team: Arc<Team>,
    seats: Vec<usize>,
    number: u64,
}

/// Driving state of one robot.
#[derive(Debug)]
pub struct Wheel {
    /// Number of the driver among all that the team has had.
    number: u64,
    wish: Wish,
    said: Instant,
    /// Last setpoint that was commanded.
    last: Setpoint,
    answers: mpsc::Sender<Result<Answer, HostingError>>,
}

impl Driver {
    /// Takes control of `robots`. The first is the person's own; the others stand still.
    ///
    /// Earlier drivers of these robots lose control, because a reloaded page is the same person. The
    /// receiver gets the answers to the commands.
    pub fn take(
        team: &Arc<Team>,
        episode: &Arc<EpisodeThread>,
        robots: &[String],
    ) -> Result<(Driver, mpsc::Receiver<Result<Answer, HostingError>>), HostingError> {
        let seats = robots.iter().map(|robot| team.seat(robot)).collect::<Result<Vec<usize>, _>>()?;
        let (sender, answers) = mpsc::channel(KEPT_ANSWERS);
        seats.iter().for_each(|seat| team.round().set_pace(*seat, TICK));
        let mut wheels = team.wheels();
        wheels.drivers += 1;
        let number = wheels.drivers;
        for (seat, robot) in seats.iter().zip(robots) {
            let hold = Setpoint::Wrists(WristMove::hold(robot));
            let wish = Wish { setpoint: hold.clone(), tells_state: false, go: false, steps: 0 };
            let wheel = Wheel { number, wish, said: Instant::now(), last: hold, answers: sender.clone() };
            wheels.seats[*seat] = Some(wheel);
        }
        if !std::mem::replace(&mut wheels.turning, true) {
            tokio::spawn(turn(team.clone(), episode.clone()));
        }
        Ok((Driver { team: team.clone(), seats, number }, answers))
    }

    /// Sets the person's request for its own robot. The others stand still, and time passes for all of
    /// them alike.
    pub fn say(&self, wish: &Wish) {
        let mut wheels = self.team.wheels();
        for (place, seat) in self.seats.iter().enumerate() {
            if let Some(wheel) = wheels.seats[*seat].as_mut().filter(|wheel| wheel.number == self.number) {
                wheel.said = Instant::now();
                wheel.wish.go = wish.go;
                wheel.wish.steps = wheel.wish.steps.saturating_add(wish.steps);
                if place == 0 {
                    wheel.wish.setpoint = wish.setpoint.clone();
                    wheel.wish.tells_state = wish.tells_state;
                }
            }
        }
    }

    /// Returns the robots that the person waits for, once its own command has been waiting for longer
    /// than `AWAY_AFTER`.
    pub fn waits_for(&self) -> Vec<String> {
        let wheels = self.team.wheels();
        let since = self.seats.first().and_then(|seat| wheels.under_way[*seat]);
        match since.is_some_and(|since| since.elapsed() > AWAY_AFTER) {
            true => self.team.round().awaited(),
            false => Vec::new(),
        }
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        let mut wheels = self.team.wheels();
        for seat in &self.seats {
            wheels.seats[*seat].take_if(|wheel| wheel.number == self.number);
        }
    }
}

/// Turns setpoints into commands, one control step after another, until nobody drives any more or the
/// episode has ended.
async fn turn(team: Arc<Team>, episode: Arc<EpisodeThread>) {
    let mut ticks = interval(TICK);
    // Ticks that were missed are skipped, so that the loop never catches up.
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        ticks.tick().await;
        let due = {
            let mut wheels = team.wheels();
            if episode.ended() || wheels.seats.iter().all(Option::is_none) {
                wheels.turning = false;
                return;
            }
            wheels.due(Instant::now())
        };
        for (seat, setpoint, tells_state) in due {
            let (team, episode) = (team.clone(), episode.clone());
            tokio::spawn(async move {
                let robot = team.seats[seat].robot.clone();
                let call = Call { short: true, ..setpoint.call().into() };
                let mut answers = vec![team.call(&episode, &robot, call, None).await];
                if tells_state {
                    let state = ToolCall::from(GetRobotState::of(&robot));
                    let call = Call { samples: true, ..state.into() };
                    answers.push(team.call(&episode, &robot, call, None).await);
                }
                let mut wheels = team.wheels();
                wheels.under_way[seat] = None;
                if let Some(wheel) = &wheels.seats[seat] {
                    for answer in answers {
                        // A page that does not read its answers misses some.
                        let _ = wheel.answers.try_send(answer);
                    }
                }
            });
        }
    }
}

impl Wheels {
    /// Returns the seats that command now, with their setpoints: those whose last command is answered and
    /// whose time may pass. The flag of each says whether its state is to be told.
    fn due(&mut self, now: Instant) -> Vec<(usize, Setpoint, bool)> {
        let mut found = Vec::new();
        for (seat, (wheel, under_way)) in self.seats.iter_mut().zip(&mut self.under_way).enumerate() {
            let Some(wheel) = wheel else { continue };
            let is_there = now.duration_since(wheel.said) < AWAY_AFTER;
            let Wish { setpoint, tells_state, go, steps } = &mut wheel.wish;
            if under_way.is_some() || !((*go && is_there) || *steps > 0) {
                continue;
            }
            *steps = steps.saturating_sub(1);
            wheel.last = match (&*setpoint, &wheel.last) {
                (Setpoint::Wrists(wanted), Setpoint::Wrists(last)) => {
                    Setpoint::Wrists(within_speed(wanted, last))
                }
                (wanted, _) => wanted.clone(),
            };
            *under_way = Some(now);
            found.push((seat, wheel.last.clone(), *tells_state));
        }
        found
    }
}

/// Limits `wanted` to wrist targets within one step's reach of the last ones.
fn within_speed(wanted: &WristMove, last: &WristMove) -> WristMove {
    WristMove {
        left_position_m: nearer(wanted.left_position_m, last.left_position_m),
        right_position_m: nearer(wanted.right_position_m, last.right_position_m),
        left_quaternion_wxyz: turned(wanted.left_quaternion_wxyz, last.left_quaternion_wxyz),
        right_quaternion_wxyz: turned(wanted.right_quaternion_wxyz, last.right_quaternion_wxyz),
        ..wanted.clone()
    }
}

fn nearer(wanted_m: Option<[f64; 3]>, last_m: Option<[f64; 3]>) -> Option<[f64; 3]> {
    let (Some(to), Some(from)) = (wanted_m.map(Vector3::from), last_m.map(Vector3::from)) else {
        return wanted_m;
    };
    let away = to - from;
    match away.norm() {
        far if far > WRIST_M_PER_STEP => Some((from + away * (WRIST_M_PER_STEP / far)).into()),
        _ => wanted_m,
    }
}

fn turned(wanted_wxyz: Option<[f64; 4]>, last_wxyz: Option<[f64; 4]>) -> Option<[f64; 4]> {
    let unit = |[w, x, y, z]: [f64; 4]| UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6);
    let (Some(to), Some(from)) = (wanted_wxyz.and_then(unit), last_wxyz.and_then(unit)) else {
        return wanted_wxyz;
    };
    match from.angle_to(&to) {
        far if far > WRIST_RAD_PER_STEP => {
            let between = from.try_slerp(&to, WRIST_RAD_PER_STEP / far, 1e-9).unwrap_or(to);
            Some([between.w, between.i, between.j, between.k])
        }
        _ => wanted_wxyz,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wheels(wish: Wish) -> Wheels {
        let (answers, _) = mpsc::channel(1);
        let wheel = Wheel { number: 1, last: wish.setpoint.clone(), wish, said: Instant::now(), answers };
        Wheels { seats: vec![Some(wheel), None], under_way: vec![None; 2], ..Wheels::default() }
    }

    #[test]
    fn a_robot_moves_while_its_person_is_there_and_never_twice_in_a_step() {
        let setpoint = || Setpoint::Wrists(WristMove::hold("A"));
        let wish = |go, steps| Wish { setpoint: setpoint(), tells_state: false, go, steps };
        let now = Instant::now();
        assert_eq!(wheels(wish(true, 0)).due(now).len(), 1);
        assert_eq!(wheels(wish(false, 0)).due(now).len(), 0);
        assert_eq!(wheels(wish(true, 0)).due(now + 2 * AWAY_AFTER).len(), 0, "a cut link moves nothing");
        let mut stepped = wheels(wish(false, 2));
        for expected in [1, 0] {
            assert_eq!(stepped.due(now).len(), expected, "the command is not answered yet");
        }
        for expected in [1, 0] {
            stepped.under_way[0] = None;
            assert_eq!(stepped.due(now).len(), expected, "two steps were asked for");
        }
    }

    #[test]
    fn targets_move_no_faster_than_they_may() {
        let at = |x_m: f64, turn: f64| WristMove {
            right_position_m: Some([x_m, 0.0, 0.0]),
            right_quaternion_wxyz: Some([(turn / 2.0).cos(), 0.0, 0.0, (turn / 2.0).sin()]),
            ..WristMove::hold("A")
        };
        let near = at(0.01, 0.05);
        assert_eq!(within_speed(&near, &at(0.0, 0.0)), near, "what is near enough stays to the last bit");
        let mut last = at(0.0, 0.0);
        for step in 1..=10 {
            last = within_speed(&at(0.1, 0.5), &last);
            let [x_m, ..] = last.right_position_m.unwrap();
            assert!((x_m - (f64::from(step) * WRIST_M_PER_STEP).min(0.1)).abs() < 1e-9, "{x_m}");
        }
        assert_eq!(last, at(0.1, 0.5));
        let begun = within_speed(&at(0.4, 1.0), &WristMove::hold("A"));
        assert_eq!(begun, at(0.4, 1.0), "where it has no target yet, the first is its own");
    }
}
