//! Footsteps that bring a pushed pendulum to rest, and walk.

use super::*;
use crate::Side;
use crate::body::BodyScale;

const DT_S: f32 = 1.0 / 200.0;
const RATE_1_S: f32 = 3.75;

/// The linear inverted pendulum on planned feet:
///   x' = w (xi - x),   xi' = w (xi - p).
struct Pendulum {
    com_m: Vector,
    capture_m: Vector,
    stance: Side,
    stance_m: Vector,
    swing_m: Vector,
}

impl Pendulum {
    /// Creates a pendulum in the middle of stepping in place, at the landing of a steady gait.
    fn stepping() -> Pendulum {
        let gait = Gait::new(&BodyScale::G1, RATE_1_S, Vector::ZERO, Vector::Y);
        let stance_m = Vector::ZERO;
        Pendulum {
            com_m: stance_m - gait.offset_m,
            capture_m: stance_m - gait.offset_m,
            stance: Side::Left,
            stance_m,
            swing_m: gait.step_m,
        }
    }

    /// Runs one step, until the foot is down.
    fn step(&mut self, velocity_m_s: Vector) {
        let foot = |sole_m: Vector| Pose::from_translation(sole_m - BodyScale::G1.sole_in_foot_m);
        let outside = Vector::Y * self.stance.sign();
        let gait = Gait::new(&BodyScale::G1, RATE_1_S, velocity_m_s, outside);
        let mut swing = Swing::at(foot(self.swing_m));
        let old_m = self.swing_m;
        let mut time_s = 0.0;
        while time_s < PERIOD_S {
            let situation = FootstepInputs {
                scale: &BodyScale::G1,
                gait: &gait,
                swing: &swing,
                capture_m: self.capture_m,
                stance: Pose::from_translation(self.stance_m),
                old_m,
                ahead_axis: Vector::X,
                outside_axis: outside,
                time_s,
            };
            let plan = situation.plan(DT_S);
            time_s += DT_S * plan.pace;
            swing.advance(foot(plan.foothold_m), time_s - TRANSFER_S, plan.pace, DT_S);
            self.com_m += (self.capture_m - self.com_m) * (RATE_1_S * DT_S);
            self.capture_m += (self.capture_m - plan.pressure_m) * (RATE_1_S * DT_S);
        }
        self.swing_m = self.stance_m;
        self.stance_m = flat(swing.sole_m(&BodyScale::G1));
        self.stance = self.stance.other();
    }

    /// Returns the mean velocity over two steps.
    fn velocity_m_s(&mut self, command_m_s: Vector) -> Vector {
        let before_m = self.com_m;
        self.step(command_m_s);
        self.step(command_m_s);
        (self.com_m - before_m) / (2.0 * PERIOD_S)
    }
}

/// After any push within the reach of the feet it steps in place again.
#[test]
fn steps_bring_a_pushed_pendulum_to_rest() {
    for (x, y) in [(0.0, 0.0), (0.12, 0.0), (-0.1, 0.0), (0.05, 0.04), (-0.05, -0.04)] {
        let mut pendulum = Pendulum::stepping();
        pendulum.capture_m += Vector::new(x, y, 0.0);
        (0..10).for_each(|_| pendulum.step(Vector::ZERO));
        let velocity_m_s = pendulum.velocity_m_s(Vector::ZERO);
        assert!(velocity_m_s.length() < 0.01, "pushed by {x}, {y} m: still at {velocity_m_s} m/s");
        let ahead_m = (pendulum.capture_m - pendulum.stance_m).x;
        assert!(ahead_m.abs() < 0.005, "the foot is not under the capture point: {ahead_m} m");
        let width_m = (pendulum.stance_m - pendulum.swing_m).y.abs();
        let steady_m = -Gait::new(&BodyScale::G1, RATE_1_S, Vector::ZERO, Vector::Y).step_m.y;
        assert!((width_m - steady_m).abs() < 0.01, "feet {width_m} m apart, not {steady_m}");
    }
}

#[test]
fn a_commanded_velocity_is_walked() {
    for (x, y) in [(0.4, 0.0), (-0.3, 0.0), (0.0, 0.3), (0.2, -0.2)] {
        let command_m_s = Vector::new(x, y, 0.0);
        let mut pendulum = Pendulum::stepping();
        (0..10).for_each(|_| pendulum.step(command_m_s));
        let velocity_m_s = pendulum.velocity_m_s(command_m_s);
        let error_m_s = (velocity_m_s - command_m_s).length();
        assert!(error_m_s < 0.1 * command_m_s.length(), "{velocity_m_s}, not {command_m_s}");
    }
}

#[test]
fn feet_do_not_cross_and_hurry_only_when_they_must() {
    let gait = Gait::new(&BodyScale::G1, RATE_1_S, Vector::ZERO, Vector::Y);
    let swing = Swing::at(Pose::from_translation(gait.step_m - BodyScale::G1.sole_in_foot_m));
    let plan = |push_m: Vector| {
        let mut situation = FootstepInputs {
            scale: &BodyScale::G1,
            gait: &gait,
            swing: &swing,
            capture_m: Vector::ZERO,
            stance: Pose::IDENTITY,
            old_m: gait.step_m,
            ahead_axis: Vector::X,
            outside_axis: Vector::Y,
            time_s: TRANSFER_S + 0.02,
        };
        situation.capture_m = situation.steady_capture_m(PERIOD_S - situation.time_s - DT_S) + push_m;
        situation.plan(DT_S)
    };
    let steady = plan(Vector::ZERO);
    assert!(steady.pace == 1.0 && (steady.foothold_m - gait.step_m).length() < 0.01, "{}", steady.foothold_m);
    let outwards = plan(Vector::Y * 0.15);
    assert!(outwards.foothold_m.y <= -SPREAD_M[0] + 1e-5, "the feet cross at {}", outwards.foothold_m);
    assert!(plan(Vector::X * 0.25).pace > 1.0);
}
