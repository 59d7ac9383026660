//! Setpoints of real-time drivers.

use std::time::{Duration, Instant};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tandem_tools_spec::{
    JointChunk, JointDrives, MoveWrists, SendJointChunk, SendJointDrives, ToolCall, WristMove,
};
use tokio::sync::mpsc;

use crate::hosting::{Answer, HostingError};

/// Duration of a control step.
pub const TICK: Duration = Duration::from_millis(20);

/// Time without a request after which a person counts as away, for example because the page is hidden or the
/// connection is lost.
pub const AWAY_AFTER: Duration = Duration::from_millis(500);

/// Maximum translation and rotation of a wrist's target per control step: 1.5 m/s and 6 rad/s.
const WRIST_M_PER_STEP: f64 = 1.5 * 0.02;
const WRIST_RAD_PER_STEP: f64 = 6.0 * 0.02;

/// Setpoint for one robot and one control step.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "one setpoint a robot; wrists are the usual one")]
pub enum Setpoint {
    /// Targets of wrists, fingers and base.
    Wrists(WristMove),
    /// One row of targets of joints and base.
    Joints(JointChunk),
    /// One row of motors' setpoints.
    Drives(JointDrives),
}

impl Setpoint {
    /// Returns the command that executes the setpoint for one control step.
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
pub struct DriverRequest {
    pub setpoint: Setpoint,
    /// True to receive the robot's state after each command, with the sensor readings of every physics step.
    pub tells_state: bool,
    /// True while time may pass.
    pub go: bool,
    /// Control steps that may pass while `go` is false, for single stepping.
    pub steps: u32,
}

/// Sender of the answers to a driver's commands.
pub type AnswerSender = mpsc::Sender<Result<Answer, HostingError>>;

/// State of the driver of one robot.
#[derive(Debug)]
pub struct Teleoperation {
    /// Number of the driver among all drivers that the team has had.
    pub driver: u64,
    pub answers: AnswerSender,
    request: DriverRequest,
    requested: Instant,
    /// Setpoint of the last command.
    last: Setpoint,
}

impl Teleoperation {
    /// Creates the state of a driver whose first setpoint holds the robot still.
    pub fn new(driver: u64, robot: &str, answers: AnswerSender) -> Teleoperation {
        let hold = Setpoint::Wrists(WristMove::hold(robot));
        let request = DriverRequest { setpoint: hold.clone(), tells_state: false, go: false, steps: 0 };
        Teleoperation { driver, answers, request, requested: Instant::now(), last: hold }
    }

    /// Copies `go` from `request` and adds the single steps of `request` to those left.
    pub fn pass_time(&mut self, request: &DriverRequest) {
        self.requested = Instant::now();
        self.request.go = request.go;
        self.request.steps = self.request.steps.saturating_add(request.steps);
    }

    /// Sets the setpoint of the next commands.
    pub fn set(&mut self, request: &DriverRequest) {
        self.request.setpoint = request.setpoint.clone();
        self.request.tells_state = request.tells_state;
    }

    /// Returns the next setpoint if time may pass at `now`, and true if the robot's state is to be sent.
    pub fn due(&mut self, now: Instant) -> Option<(Setpoint, bool)> {
        let is_there = now.duration_since(self.requested) < AWAY_AFTER;
        let DriverRequest { setpoint, tells_state, go, steps } = &mut self.request;
        if !(*go && is_there) && *steps == 0 {
            return None;
        }
        *steps = steps.saturating_sub(1);
        self.last = match (&*setpoint, &self.last) {
            (Setpoint::Wrists(wanted), Setpoint::Wrists(last)) => {
                Setpoint::Wrists(within_speed(wanted, last))
            }
            (wanted, _) => wanted.clone(),
        };
        Some((self.last.clone(), *tells_state))
    }
}

/// Limits the wrist targets in `wanted` to the displacement from `last` that one control step allows.
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
