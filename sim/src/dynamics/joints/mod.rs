//! Forces along joints: drives and passive springs, implicit in the step; rows of bounds; equalities.
//!
//! A drive's effort at the end of the step, from the position q and velocity v at its beginning and v'
//! at its end:
//!   tau = kp (target - q - dt v') - kd v' + feedforward.
//! Inserted into M (v' - v) = dt (tau - bias), the terms with v' move to the left:
//!   (M + dt kd + dt^2 kp) v' = M v + dt (kp (target - q) + feedforward - bias),
//! which is exact and has no extra cost. Springs and dampers of the joint itself enter in the same way. This
//! form cannot limit the effort, though. A drive near its limit is therefore left out of the mass matrix, and
//! becomes a bounded row of the solver (`bounds`). The set of such drives is guessed from the last step, and
//! the step is repeated if the guess was wrong. So no effort, implicit parts included, exceeds its limit. The
//! only exception is a motor that something else turns too fast.

pub mod bounds;
pub mod equality;

use super::trees::link::{Axis, Drive, DriveLaw};
use super::trees::tree::Tree;

/// Share of its limit that a drive must have exerted in the last step to be a row in the next.
const NEAR_LIMIT: f64 = 0.8;
/// Share of its speed limit above which a drive's maximum effort falls.
const SLACKENS: f64 = 0.8;
/// Relative tolerance to which efforts respect their limits.
const TOLERANCE: f64 = 1e-9;

impl DriveLaw {
    /// Returns the slope of a drive's maximum effort over speed, near its speed limit.
    fn slope(&self) -> f64 {
        self.most / (self.speed_limit * (1.0 - SLACKENS))
    }

    /// Returns true if a drive has its full effort at the velocity `v`.
    fn is_strong(&self, v: f64) -> bool {
        v.abs() <= SLACKENS * self.speed_limit
    }

    /// Returns the minimum and maximum impulse at the velocity `v` of the end of the step.
    fn bounds(&self, v: f64) -> [f64; 2] {
        if self.is_strong(v) {
            return [-self.most, self.most];
        }
        let slope = self.slope();
        let low = -slope * (self.speed_limit + v);
        let high = slope * (self.speed_limit - v);
        [low.max((-self.most).min(high)), high.min(self.most.max(low))]
    }

    /// Returns the impulse that satisfies the law at the resulting velocity:  v' = v + (T' - T) Y.Y,
    /// where v is the velocity with the impulse T. Every part of the law decreases with v', so that each
    /// is solved alone and the least one applies.
    pub(in crate::dynamics) fn meet(&self, inverse_mass: f64, v: f64, impulse: f64) -> f64 {
        let line = |rest: f64, implicit: f64| {
            impulse + (rest - implicit * v - impulse) / (1.0 + implicit * inverse_mass)
        };
        let wanted = line(self.rest, self.implicit).clamp(-self.most, self.most);
        if self.is_strong(v + (wanted - impulse) * inverse_mass) {
            return wanted;
        }
        let slope = self.slope();
        let slack = slope * self.speed_limit;
        let [low, high] = [line(-slack, slope), line(slack, slope)];
        // Not `clamp`, which panics on NaN; the step will report that physics diverged.
        wanted.max(low).min(high)
    }
}

impl Tree {
    pub fn drive(&mut self, link: usize, drive: Drive) {
        self.drives[link] = drive;
    }

    fn drive_law(&self, link: usize, axis: &Axis, dt_s: f64) -> DriveLaw {
        let drive = &self.drives[link];
        let (most, speed_limit) = (axis.effort_limit * dt_s, axis.speed_limit);
        let implicit = dt_s * (drive.kd + dt_s * drive.kp);
        let rest = dt_s * (drive.kp * (drive.target - self.q[link]) + drive.feedforward);
        DriveLaw {
            rest: if implicit == 0.0 { rest.clamp(-most, most) } else { rest },
            implicit,
            most,
            speed_limit,
        }
    }

    /// Records the drive commands, and guesses which drives will be at their limits.
    pub(in crate::dynamics) fn begin_drives(&mut self, dt_s: f64) {
        self.overrun.fill(false);
        for (i, link) in self.links.iter().enumerate() {
            let Some(axis) = link.joint.axis() else { continue };
            self.laws[i] = self.drive_law(i, axis, dt_s);
            self.bounded[i] = self.effort[i].abs() > NEAR_LIMIT * axis.effort_limit
                || self.v[self.layout.first_dof[i]].abs() > SLACKENS * axis.speed_limit;
        }
    }

    /// Marks the drives that exceed their limits at the velocities `v` of the end of the step. Returns true
    /// if there are any.
    pub(in crate::dynamics) fn bound_more(&mut self, v: &[f64]) -> bool {
        let mut more = false;
        for i in 0..self.links.len() {
            if self.links[i].joint.axis().is_none() || self.bounded[i] {
                continue;
            }
            let law = &self.laws[i];
            let v = v[self.layout.first_dof[i]];
            let impulse = law.rest - law.implicit * v;
            let ([low, high], tolerance) = (law.bounds(v), law.most * TOLERANCE);
            if impulse > high + tolerance || impulse < low - tolerance {
                self.bounded[i] = true;
                more = true;
            }
        }
        more
    }

    /// Adds springs, dampers and the drives that are not rows to the right-hand side, which holds -bias,
    /// and sets their part of the diagonal. The right-hand side is that of M' (v' - v) with M' the
    /// matrix above, so the contribution of v is subtracted.
    #[inline(always)]
    pub(in crate::dynamics) fn joint_forces(&mut self, dt_s: f64) {
        for i in 0..self.links.len() {
            let Some(axis) = self.links[i].joint.axis() else { continue };
            let k = self.layout.first_dof[i];
            let mut impulse = dt_s * axis.stiffness * (axis.spring_rest - self.q[i]);
            self.implicit[k] = dt_s * (axis.damping + dt_s * axis.stiffness);
            if !self.bounded[i] {
                let law = &self.laws[i];
                impulse += law.rest;
                self.implicit[k] += law.implicit;
            }
            self.rhs[k] += (impulse - self.implicit[k] * self.v[k]) / dt_s;
        }
    }

    /// Stores the efforts of the drives without rows, at the velocities `v` of the end of the step.
    pub(in crate::dynamics) fn keep_efforts(&mut self, dt_s: f64, v: &[f64]) {
        for i in 0..self.links.len() {
            if self.links[i].joint.axis().is_some() && !self.bounded[i] {
                let law = &self.laws[i];
                self.effort[i] = (law.rest - law.implicit * v[self.layout.first_dof[i]]) / dt_s;
            }
        }
    }
}
