//! What pushes the robot beside gravity and the ground force that was asked for.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

const RATE_1_S: f32 = 16.0;
const LARGEST_PUSH_M_S2: f32 = 2.0;
/// A blow is over before a foot lands: only what lasts is a push.
const LARGEST_CHANGE_M_S3: f32 = 4.5;

/// Luenberger observer of the horizontal  v' = expected + d,  d' = 0,  both poles at -[`RATE_1_S`].
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct PushObserver {
    velocity_m_s: Option<Vector>,
    expected_m_s2: Vector,
    push_m_s2: Vector,
}

impl PushObserver {
    /// Horizontal acceleration of the centre of mass by everything that was not expected.
    pub(super) fn push_m_s2(&self) -> Vector {
        self.push_m_s2
    }

    /// Acceleration of the centre of mass that the coming physics step should bring.
    pub(super) fn expect(&mut self, acceleration_m_s2: Vector) {
        self.expected_m_s2 = acceleration_m_s2;
    }

    /// One physics step later.
    pub(super) fn update(&mut self, com_velocity_m_s: Vector, dt_s: f32) {
        let measured = Vector::new(com_velocity_m_s.x, com_velocity_m_s.y, 0.0);
        let velocity = self.velocity_m_s.get_or_insert(measured);
        let error = measured - *velocity;
        *velocity += (self.expected_m_s2 + self.push_m_s2 + error * (2.0 * RATE_1_S)) * dt_s;
        let change_m_s3 = (error * (RATE_1_S * RATE_1_S)).clamp_length_max(LARGEST_CHANGE_M_S3);
        self.push_m_s2 = (self.push_m_s2 + change_m_s3 * dt_s).clamp_length_max(LARGEST_PUSH_M_S2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f32 = 1.0 / 200.0;

    /// A body that is accelerated by what was asked for and a push that nobody told of.
    fn observe(seconds: f32, push_m_s2: impl Fn(f32) -> Vector) -> (PushObserver, f32) {
        let mut observer = PushObserver::default();
        let mut velocity_m_s = Vector::new(0.2, 0.0, 0.1);
        let mut largest_m_s2 = 0.0_f32;
        for step in 0..(seconds / DT_S) as usize {
            let time_s = step as f32 * DT_S;
            observer.update(velocity_m_s, DT_S);
            let asked_m_s2 = Vector::new(time_s.sin(), -0.3, 0.0);
            observer.expect(asked_m_s2);
            velocity_m_s += (asked_m_s2 + push_m_s2(time_s)) * DT_S;
            largest_m_s2 = largest_m_s2.max(observer.push_m_s2().length());
        }
        (observer, largest_m_s2)
    }

    #[test]
    fn a_constant_push_is_found_and_no_other() {
        for push_m_s2 in [Vector::ZERO, Vector::new(0.6, -0.4, 0.0), Vector::new(-1.2, 0.0, 0.0)] {
            let (observer, largest_m_s2) = observe(2.0, |_| push_m_s2);
            assert!((observer.push_m_s2() - push_m_s2).length() < 0.01, "{}", observer.push_m_s2());
            assert!(largest_m_s2 < 1.25 * push_m_s2.length() + 0.01, "it overshoots to {largest_m_s2}");
        }
    }

    /// 300 N for 0.08 s on 34 kg. What lasts may count for no more than [`LARGEST_PUSH_M_S2`].
    #[test]
    fn a_blow_is_no_push_and_no_push_is_without_bound() {
        let (_, largest_m_s2) =
            observe(1.0, |time_s| if time_s < 0.08 { Vector::X * 9.0 } else { Vector::ZERO });
        assert!(largest_m_s2 < 1.2, "the blow counts as {largest_m_s2}");
        let (observer, _) = observe(3.0, |_| Vector::X * 5.0);
        assert!((observer.push_m_s2().length() - LARGEST_PUSH_M_S2).abs() < 1e-4);
    }
}
