//! Joint limits as one interval for each joint's displacement in a step.

use crate::model::{Configuration, Model};

/// Bounds on a joint's displacement dq in a step of dt:
///   gain (lower - q) <= dq <= gain (upper - q)                configuration
///   |dq| <= velocity dt                                       velocity
///   |dq - v_last dt| <= acceleration dt^2                     acceleration
///   |v| <= -a dt + sqrt(a^2 dt^2 + 2 a (upper - q))           braking: stopping takes v dt + v^2 / (2 a)
/// A joint that starts outside its range comes back, no faster than its velocity limit.
#[derive(Clone, Debug)]
pub struct Limits {
    /// Share of the distance to a limit that one step may take; 0.5 keeps joints off their stops, `None`
    /// leaves limits out.
    pub configuration_gain: Option<f64>,
    /// Maximum speed per joint, rad/s or m/s. A speed of 0 holds the joint, through restarts too.
    pub velocity: Vec<f64>,
    /// Maximum acceleration per joint, rad/s^2 or m/s^2.
    pub acceleration: Option<Vec<f64>>,
}

/// Kind of the tightest limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitKind {
    /// A joint's range.
    Configuration,
    /// A joint's speed.
    Velocity,
    /// A joint's acceleration or its braking distance.
    Acceleration,
}

impl Limits {
    /// Creates limits from the file's ranges and velocities, with gain 0.5 and no acceleration limit.
    pub fn of(model: &Model) -> Limits {
        let velocity = model.joints().iter().map(|joint| joint.velocity).collect();
        Limits { configuration_gain: Some(0.5), velocity, acceleration: None }
    }

    /// Returns the largest displacement of a joint downwards (negative) and upwards, with the kind of
    /// limit that sets each.
    pub(crate) fn interval(
        &self,
        configuration: &Configuration,
        joint: usize,
        dt_s: f64,
        last_velocity: f64,
    ) -> [(f64, LimitKind); 2] {
        let (range, q) = (&configuration.model().joints()[joint], configuration.q()[joint]);
        let fastest = self.velocity[joint] * dt_s;
        let mut low = (-fastest, LimitKind::Velocity);
        let mut high = (fastest, LimitKind::Velocity);
        if let Some(acceleration) = self.acceleration.as_ref().map(|acceleration| acceleration[joint]) {
            let change = acceleration * dt_s;
            let reach = change * dt_s;
            let braking =
                |room: f64| ((change * change + 2.0 * acceleration * room.max(0.0)).sqrt() - change) * dt_s;
            raise(
                &mut low,
                (last_velocity * dt_s - reach).max(-braking(q - range.lower)),
                LimitKind::Acceleration,
            );
            lower(
                &mut high,
                (last_velocity * dt_s + reach).min(braking(range.upper - q)),
                LimitKind::Acceleration,
            );
        }
        if let Some(gain) = self.configuration_gain {
            raise(&mut low, (gain * (range.lower - q)).min(fastest), LimitKind::Configuration);
            lower(&mut high, (gain * (range.upper - q)).max(-fastest), LimitKind::Configuration);
        }
        // Hard braking may contradict the range: the range wins, so that the interval is never empty.
        if low.0 > high.0 {
            if low.1 == LimitKind::Configuration { high.0 = low.0 } else { low.0 = high.0 }
        }
        [low, high]
    }
}

fn raise(bound: &mut (f64, LimitKind), value: f64, kind: LimitKind) {
    if value > bound.0 {
        *bound = (value, kind);
    }
}

fn lower(bound: &mut (f64, LimitKind), value: f64, kind: LimitKind) {
    if value < bound.0 {
        *bound = (value, kind);
    }
}
