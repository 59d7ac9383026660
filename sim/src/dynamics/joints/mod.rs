//! What acts along joints: drives and passive springs, implicit in the step; rows of bounds; equalities.
//!
//! A drive's effort at the end of the step, from the position q and velocity v at its beginning and v' at its end:
//!   tau = kp (target - q - dt v') - kd v' + feedforward.
//! Inserted into M (v' - v) = dt (tau - bias), the terms with v' move to the left:
//!   (M + dt kd + dt^2 kp) v' = M v + dt (kp (target - q) + feedforward - bias),
//! which is exact and costs nothing. Springs and dampers of the joint itself enter the same way. It knows no limit,
//! though: a drive near its limit is left out of the mass matrix and becomes a bounded row of the solver (`bounds`).
//! Which ones are near is guessed from the last step, and the step is repeated where the guess was wrong, so that no
//! effort, implicit parts included, is ever beyond its limit.

pub mod bounds;
pub mod equality;

use super::trees::link::Drive;
use super::trees::tree::Tree;

/// A drive's impulse in a step as a function of the velocity v' at its end:  rest - implicit v', within +-most.
#[derive(Clone, Copy, Debug)]
pub struct DriveLaw {
    pub rest: f64,
    pub implicit: f64,
    pub most: f64,
}

/// A drive that exerted more than this share of its limit in the last step is a row in the next.
const NEAR_LIMIT: f64 = 0.8;
/// Efforts keep to their limits to this share.
const TOLERANCE: f64 = 1e-9;

impl Tree {
    pub fn drive(&mut self, link: usize, drive: Drive) {
        self.drives[link] = drive;
    }

    pub(in crate::dynamics) fn drive_law(&self, link: usize, dt_s: f64) -> DriveLaw {
        let drive = &self.drives[link];
        let limit = self.links[link].joint.axis().map_or(0.0, |axis| axis.effort_limit);
        let (most, implicit) = (limit * dt_s, dt_s * (drive.kd + dt_s * drive.kp));
        let rest = dt_s * (drive.kp * (drive.target - self.q[link]) + drive.feedforward);
        DriveLaw { rest: if implicit == 0.0 { rest.clamp(-most, most) } else { rest }, implicit, most }
    }

    /// Guesses which drives will be at their limits.
    pub(in crate::dynamics) fn guess_bounded(&mut self) {
        for (i, link) in self.links.iter().enumerate() {
            let limit = link.joint.axis().map_or(f64::INFINITY, |axis| axis.effort_limit);
            self.bounded[i] = self.effort[i].abs() > NEAR_LIMIT * limit;
        }
    }

    /// Adds the drives that turned out to be beyond their limits at the velocities `v` of the end of the step; whether
    /// there were any.
    pub(in crate::dynamics) fn bound_more(&mut self, dt_s: f64, v: &[f64]) -> bool {
        let mut more = false;
        for i in 0..self.links.len() {
            if self.links[i].joint.axis().is_none() || self.bounded[i] {
                continue;
            }
            let law = self.drive_law(i, dt_s);
            let impulse = law.rest - law.implicit * v[self.layout.first_dof[i]];
            if impulse.abs() > law.most * (1.0 + TOLERANCE) {
                self.bounded[i] = true;
                more = true;
            }
        }
        more
    }

    /// Adds springs, dampers and the drives that are not rows to the right-hand side, which holds -bias, and sets their
    /// part of the diagonal. The right-hand side is that of M' (v' - v) with M' the matrix above, so the velocity's own
    /// share is taken off.
    pub(in crate::dynamics) fn joint_forces(&mut self, dt_s: f64) {
        for i in 0..self.links.len() {
            let Some(axis) = self.links[i].joint.axis() else { continue };
            let k = self.layout.first_dof[i];
            let mut impulse = dt_s * axis.stiffness * (axis.spring_rest - self.q[i]);
            self.implicit[k] = dt_s * (axis.damping + dt_s * axis.stiffness);
            if !self.bounded[i] {
                let law = self.drive_law(i, dt_s);
                impulse += law.rest;
                self.implicit[k] += law.implicit;
            }
            self.rhs[k] += (impulse - self.implicit[k] * self.v[k]) / dt_s;
        }
    }

    /// Efforts of the drives that are not rows, at the velocities `v` of the end of the step.
    pub(in crate::dynamics) fn keep_efforts(&mut self, dt_s: f64, v: &[f64]) {
        for i in 0..self.links.len() {
            if self.links[i].joint.axis().is_some() && !self.bounded[i] {
                let law = self.drive_law(i, dt_s);
                self.effort[i] = (law.rest - law.implicit * v[self.layout.first_dof[i]]) / dt_s;
            }
        }
    }
}
