//! What pushes the robot beside gravity and the ground force that was asked for.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

const RATE_1_S: f32 = 11.5;
const LARGEST_PUSH_M_S2: f32 = 2.0;
/// A blow is over before a foot lands: only what lasts is a push.
const LARGEST_CHANGE_M_S3: f32 = 4.5;

/// Luenberger observer of the horizontal  v' = expected + d,  d' = 0,  both poles at -[`RATE_1_S`].
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct Observer {
    velocity_m_s: Option<Vector>,
    expected_m_s2: Vector,
    push_m_s2: Vector,
}

impl Observer {
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
