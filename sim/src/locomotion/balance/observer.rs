//! Observer of pushes: forces other than gravity and the commanded ground force.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

/// Poles and rate limits of an observer.
pub(super) struct ObserverRates {
    poles_1_s: f32,
    largest_change_m_s3: f32,
    /// Maximum rate of a decreasing push.
    largest_fall_m_s3: f32,
}

/// Maximum rate of change: a blow ends before a foot lands, so only a lasting force is a push.
const LARGEST_CHANGE_M_S3: f32 = 4.5;
pub(super) const CALM: ObserverRates = ObserverRates {
    poles_1_s: 16.0,
    largest_change_m_s3: LARGEST_CHANGE_M_S3,
    largest_fall_m_s3: LARGEST_CHANGE_M_S3,
};
/// Rates for a robot that leans ahead of a pull. They recognise the end of a push sooner: a robot that
/// continues to lean against a pull that has ended falls.
pub(super) const QUICK: ObserverRates =
    ObserverRates { poles_1_s: 22.0, largest_change_m_s3: LARGEST_CHANGE_M_S3, largest_fall_m_s3: 9.0 };
const LARGEST_PUSH_M_S2: f32 = 2.0;
const GROWTH_TIME_S: f32 = 0.08;

/// Horizontal acceleration of the centre of mass by all unexpected forces, and its rate of change.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct ObservedPush {
    pub acceleration_m_s2: Vector,
    pub growth_m_s3: Vector,
}

/// A push split by its path into the robot.
pub(super) struct SplitPush {
    /// Horizontal part of the push that does not act through hands that hold an object.
    pub rest: ObservedPush,
    /// Horizontal part through the hands that the robot withstands.
    pub hands_m_s2: Vector,
    /// Height of the palms over the centre of mass.
    pub hands_lever_m: f32,
    /// Share of the hands' part to which the robot yields, 0 to 1.
    pub yield_share: f32,
}

impl From<ObservedPush> for SplitPush {
    /// Converts the push on a robot with empty hands.
    fn from(rest: ObservedPush) -> SplitPush {
        SplitPush { rest, hands_m_s2: Vector::ZERO, hands_lever_m: 0.0, yield_share: 0.0 }
    }
}

/// Luenberger observer of the horizontal  v' = expected + d,  d' = 0,  both poles at -`poles_1_s`.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct PushObserver {
    velocity_m_s: Option<Vector>,
    expected_m_s2: Vector,
    push: ObservedPush,
}

impl PushObserver {
    /// Returns the push for a robot that leans ahead of pulls by the share `ahead`. It blends this estimate
    /// with that of the faster observer `quick` by this share.
    pub(super) fn push_ahead(&self, quick: &PushObserver, ahead: f32) -> ObservedPush {
        let [calm, quick] = [self, quick].map(|observer| observer.push);
        let sooner_m_s2 = quick.acceleration_m_s2 - calm.acceleration_m_s2;
        ObservedPush {
            acceleration_m_s2: calm.acceleration_m_s2 + sooner_m_s2 * ahead,
            growth_m_s3: quick.growth_m_s3 * ahead,
        }
    }

    /// Sets the expected acceleration of the centre of mass in the coming physics step.
    pub(super) fn expect(&mut self, acceleration_m_s2: Vector) {
        self.expected_m_s2 = acceleration_m_s2;
    }

    /// Updates the estimate after one physics step.
    pub(super) fn update(&mut self, com_velocity_m_s: Vector, rates: &ObserverRates, dt_s: f32) {
        let measured = Vector::new(com_velocity_m_s.x, com_velocity_m_s.y, 0.0);
        let velocity = self.velocity_m_s.get_or_insert(measured);
        let error = measured - *velocity;
        let ObservedPush { acceleration_m_s2, growth_m_s3 } = &mut self.push;
        *velocity += (self.expected_m_s2 + *acceleration_m_s2 + error * (2.0 * rates.poles_1_s)) * dt_s;
        let change_m_s3 = error * (rates.poles_1_s * rates.poles_1_s);
        let falls = change_m_s3.dot(*acceleration_m_s2) < 0.0;
        let most_m_s3 = if falls { rates.largest_fall_m_s3 } else { rates.largest_change_m_s3 };
        let change_m_s3 = change_m_s3.clamp_length_max(most_m_s3);
        *growth_m_s3 += (change_m_s3 - *growth_m_s3) * (dt_s / GROWTH_TIME_S);
        *acceleration_m_s2 = (*acceleration_m_s2 + change_m_s3 * dt_s).clamp_length_max(LARGEST_PUSH_M_S2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f32 = 1.0 / 200.0;

    /// Observes a body that is accelerated by the expected acceleration and an unexpected push.
    fn observe(
        rates: &ObserverRates,
        seconds: f32,
        push_m_s2: impl Fn(f32) -> Vector,
    ) -> (PushObserver, f32) {
        let mut observer = PushObserver::default();
        let mut velocity_m_s = Vector::new(0.2, 0.0, 0.1);
        let mut largest_m_s2 = 0.0_f32;
        for step in 0..(seconds / DT_S) as usize {
            let time_s = step as f32 * DT_S;
            observer.update(velocity_m_s, rates, DT_S);
            let asked_m_s2 = Vector::new(time_s.sin(), -0.3, 0.0);
            observer.expect(asked_m_s2);
            velocity_m_s += (asked_m_s2 + push_m_s2(time_s)) * DT_S;
            largest_m_s2 = largest_m_s2.max(observer.push.acceleration_m_s2.length());
        }
        (observer, largest_m_s2)
    }

    #[test]
    fn a_constant_push_is_found_and_no_other() {
        for push_m_s2 in [Vector::ZERO, Vector::new(0.6, -0.4, 0.0), Vector::new(-1.2, 0.0, 0.0)] {
            let (observer, largest_m_s2) = observe(&CALM, 2.0, |_| push_m_s2);
            assert!(
                (observer.push.acceleration_m_s2 - push_m_s2).length() < 0.01,
                "{}",
                observer.push.acceleration_m_s2
            );
            assert!(largest_m_s2 < 1.25 * push_m_s2.length() + 0.01, "it overshoots to {largest_m_s2}");
        }
    }

    /// Fingers close on a load: 50 N on 34 kg within a second, then suddenly 0 N.
    #[test]
    fn a_growing_pull_is_found_as_it_grows_and_its_end_soon() {
        let pull_m_s2 = |time_s: f32| Vector::X * if time_s < 1.0 { 1.5 * time_s } else { 0.0 };
        let (observer, _) = observe(&QUICK, 1.0, pull_m_s2);
        let ObservedPush { acceleration_m_s2, growth_m_s3 } = observer.push;
        assert!((growth_m_s3 - Vector::X * 1.5).length() < 0.01, "{growth_m_s3}");
        // Two poles at `poles_1_s` follow a ramp with this delay.
        let late_s = (1.5 - acceleration_m_s2.x) / 1.5;
        assert!((late_s - 2.0 / QUICK.poles_1_s).abs() < 0.01, "{late_s} s");
        let (observer, _) = observe(&QUICK, 1.3, pull_m_s2);
        let left_m_s2 = observer.push.acceleration_m_s2.length();
        assert!(left_m_s2 < 0.3, "{left_m_s2} m/s^2 of the pull that has ended are believed");
    }

    /// A blow of 300 N for 0.08 s on 34 kg. A lasting push counts for no more than [`LARGEST_PUSH_M_S2`].
    #[test]
    fn a_blow_is_no_push_and_no_push_is_without_bound() {
        let (_, largest_m_s2) =
            observe(&CALM, 1.0, |time_s| if time_s < 0.08 { Vector::X * 9.0 } else { Vector::ZERO });
        assert!(largest_m_s2 < 1.2, "the blow counts as {largest_m_s2}");
        let (observer, _) = observe(&CALM, 3.0, |_| Vector::X * 5.0);
        assert!((observer.push.acceleration_m_s2.length() - LARGEST_PUSH_M_S2).abs() < 1e-4);
    }
}
