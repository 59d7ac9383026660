//! Torque-free rotation of a lone body.
//!
//! Euler's equation by the implicit midpoint rule, m = (w + w') / 2:
//!   I (w' - w) + dt m x I m = 0,
//! which preserves |I w| and w . I w for any step size, so that a tumbling body neither gains energy nor
//! loses it. It is solved by Newton's iteration; the derivative is  I + dt/2 ([m] I - [I m]).
//!
//! Contacts are solved for the spin at the end of this rotation, but their impulses act when the step begins:
//! the resulting spin gyrates as a whole. Without that, a top would tilt by  omega dt / 2  of its precession.

use rapier3d::glamx::{DMat3, DQuat, DVec3};

use super::tree::Tree;

/// Maximum number of iterations: eight suffice for 40 rad per step; below 1 rad per step three do.
const MAX_ITERATIONS: usize = 8;
const TOLERANCE: f64 = 1e-14;

impl Tree {
    /// Computes the velocities at the end of a step without forces. For a tree of several links these are the
    /// initial velocities, since its bias contains the gyroscopic forces. For a lone body, the gyroscopic
    /// moment is removed from the right-hand side.
    pub(in crate::dynamics) fn spin_freely(&mut self, dt_s: f64, v: &mut [f64]) {
        v.copy_from_slice(&self.v);
        self.half_gyration_rad_s = DVec3::ZERO;
        if !self.is_lone() {
            return;
        }
        let inertia = self.own_inertia[0].rotated(&self.rotation[0]).matrix();
        let before = DVec3::from_slice(&v[3..6]);
        let after = midpoint_spin(&inertia, before, dt_s);
        self.half_gyration_rad_s = (after - before) * 0.5;
        after.write_to_slice(&mut v[3..6]);
        let gyroscopic_n_m = before.cross(inertia * before);
        for (rhs, moment) in self.rhs[3..6].iter_mut().zip(gyroscopic_n_m.to_array()) {
            *rhs += moment;
        }
    }

    /// Returns the rotation of a free body in a step (rad, world axes) and its angular velocity at the end.
    /// `moving` is the angular velocity by which positions move, `after` the final one from the solver.
    pub(in crate::dynamics) fn spin_on(&self, dt_s: f64, moving: DVec3, after: DVec3) -> (DVec3, DVec3) {
        let gyration = self.half_gyration_rad_s * 2.0;
        if gyration == DVec3::ZERO {
            return (moving * dt_s, after);
        }
        let inertia = self.own_inertia[0].rotated(&self.rotation[0]).matrix();
        let pushed = moving - gyration;
        let moved = midpoint_spin(&inertia, pushed, dt_s);
        let turn_rad = (pushed + moved) * (0.5 * dt_s);
        // In body axes the new angular velocity is unchanged: the axes turn with the body.
        let carried = DQuat::from_scaled_axis(turn_rad) * DQuat::from_scaled_axis(-moved * dt_s);
        (turn_rad, carried * midpoint_spin(&inertia, after - gyration, dt_s))
    }
}

fn midpoint_spin(inertia: &DMat3, before: DVec3, dt_s: f64) -> DVec3 {
    let mut after = before;
    for _ in 0..MAX_ITERATIONS {
        let mean = (before + after) * 0.5;
        let momentum = *inertia * mean;
        let residual = *inertia * (after - before) + mean.cross(momentum) * dt_s;
        let derivative = *inertia + (skew(mean) * *inertia - skew(momentum)) * (0.5 * dt_s);
        let change = derivative.inverse() * residual;
        after -= change;
        if change.length_squared() <= TOLERANCE * TOLERANCE * after.length_squared() {
            break;
        }
    }
    after
}

/// Returns [v] with [v] u = v x u.
fn skew(v: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, v.z, -v.y), DVec3::new(-v.z, 0.0, v.x), DVec3::new(v.y, -v.x, 0.0))
}
