//! How the spin of a lone body changes by itself.
//!
//! Euler's equation by the implicit midpoint rule, m = (w + w') / 2:
//!   I (w' - w) + dt m x I m = 0,
//! which keeps |I w| and w . I w whatever the step, so that a tumbling body neither gains energy nor loses it.
//! Newton's iteration on it; the derivative is  I + dt/2 ([m] I - [I m]).

use rapier3d::glamx::{DMat3, DVec3};

use super::tree::Tree;

/// Enough for 40 rad per step; below 1 rad per step three do.
const MOST_ITERATIONS: usize = 8;
const TOLERANCE: f64 = 1e-14;

impl Tree {
    /// Velocities with which a step without forces ends; of a tree of several links those with which it begins (its
    /// gyroscopic forces are part of the bias). Takes a lone body's gyroscopic moment out of the right-hand side.
    pub(super) fn spin_freely(&mut self, dt_s: f64, v: &mut [f64]) {
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
}

fn midpoint_spin(inertia: &DMat3, before: DVec3, dt_s: f64) -> DVec3 {
    let mut after = before;
    for _ in 0..MOST_ITERATIONS {
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

/// [v] with [v] u = v x u.
fn skew(v: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, v.z, -v.y), DVec3::new(-v.z, 0.0, v.x), DVec3::new(v.y, -v.x, 0.0))
}
