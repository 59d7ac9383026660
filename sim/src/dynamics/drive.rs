//! Drives and passive springs of joints, implicit in the step.
//!
//! A drive's effort at the end of the step, from the position q and velocity v at its beginning and v' at its end:
//!   tau = kp (target - q - dt v') - kd v' + feedforward.
//! Inserted into M (v' - v) = dt (tau - bias), the terms with v' move to the left:
//!   (M + dt kd + dt^2 kp) v' = M v + dt (kp (target - q) + feedforward - bias).
//! Springs and dampers of the joint itself enter the same way. Effort beyond the limit is taken off by a row of the
//! solver (`joint_rows`), so that the sum, implicit parts included, keeps to the limit.

use super::tree::Tree;

/// What a joint's drive is told; it stays until it is told again and is not part of a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// rad or m.
    pub target: f64,
    /// Effort per position.
    pub kp: f64,
    /// Effort per velocity; the damper acts on the joint's own velocity.
    pub kd: f64,
    /// Effort.
    pub feedforward: f64,
}

impl Drive {
    pub const NONE: Drive = Drive { target: 0.0, kp: 0.0, kd: 0.0, feedforward: 0.0 };

    /// The part of the impulse dt tau that does not depend on the velocity v' at the end of a step.
    pub(super) fn impulse_at_rest(&self, q: f64, dt_s: f64) -> f64 {
        dt_s * (self.kp * (self.target - q) + self.feedforward)
    }

    /// What v' takes from the impulse, per velocity.
    pub(super) fn implicit(&self, dt_s: f64) -> f64 {
        dt_s * (self.kd + dt_s * self.kp)
    }
}

impl Tree {
    pub fn drive(&mut self, link: usize, drive: Drive) {
        self.drives[link] = drive;
    }

    /// Adds drives, springs and dampers to the right-hand side, which holds -bias, and sets their part of the diagonal.
    /// The right-hand side is that of M' (v' - v) with M' the matrix above, so the velocity's own share is taken off.
    pub(super) fn joint_forces(&mut self, dt_s: f64) {
        for (i, link) in self.links.iter().enumerate() {
            let Some(axis) = link.joint.axis() else { continue };
            let k = self.layout.first_dof[i];
            let (q, drive) = (self.q[i], &self.drives[i]);
            let passive = dt_s * (axis.damping + dt_s * axis.stiffness);
            self.implicit[k] = passive + drive.implicit(dt_s);
            let spring = axis.stiffness * (axis.spring_rest - q);
            self.rhs[k] += spring + (drive.impulse_at_rest(q, dt_s) - self.implicit[k] * self.v[k]) / dt_s;
        }
    }
}
