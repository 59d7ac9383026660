//! One step of all dynamics.

use pulp::{Arch, Simd, WithSimd};
use thiserror::Error;

use crate::dynamics::settings::Settings;
use crate::dynamics::trees::Trees;
use crate::dynamics::trees::spatial::ForceVector;
use crate::dynamics::trees::tree::Tree;
use crate::dynamics::{DVec3, Dynamics};

impl Dynamics {
    /// Detects collisions, computes the forces, and advances all trees by one step. It allocates nothing once
    /// its buffers have grown.
    ///
    /// # Errors
    ///
    /// Returns [`Diverged`] if a velocity is no longer finite. All state is then unchanged, but bodies may
    /// have woken.
    pub fn step(&mut self) -> Result<(), Diverged> {
        self.collision.place_all(&self.trees, &self.settings);
        self.wake_near();
        self.collision.detect(&self.trees, &self.settings);
        self.trees.all.iter_mut().for_each(|tree| tree.begin_drives(self.settings.dt_s));
        self.solve();
        while self.bound_more() {
            self.solve();
        }
        self.trees.all.iter_mut().for_each(|tree| tree.external.fill(ForceVector::default()));
        self.check()?;
        self.solver.commit(&mut self.trees, self.settings.dt_s);
        self.collision.commit();
        let Settings { dt_s, gravity_m_s2, .. } = self.settings;
        for (tree, range) in self.trees.ranges().filter(|(tree, _)| !tree.is_asleep()) {
            let after = &self.final_v[range.clone()];
            tree.keep_efforts(dt_s, after);
            let due = tree.due(gravity_m_s2, dt_s, after, &self.solver.w[range.clone()]);
            tree.integrate(dt_s, &self.moving_v[range], after);
            tree.kinematics();
            if let Some(due) = due {
                tree.settle(&due);
            }
        }
        self.fall_asleep();
        Ok(())
    }

    /// Solves for the velocities at the end of the step, with the present set of bounded drives.
    fn solve(&mut self) {
        let Dynamics { settings, trees, collision, solver, moving_v, final_v, sleeping: _ } = self;
        Arch::new().dispatch(Whitening { trees, w: &mut solver.w, settings });
        let candidates = &collision.candidates;
        solver.prepare(trees, candidates, settings);
        solver.correct(trees, candidates, settings.sweeps);
        Arch::new().dispatch(Unwhitening { trees, w: &solver.w, v: moving_v });
        solver.relax(trees, candidates, settings.relaxing_sweeps);
        Arch::new().dispatch(Unwhitening { trees, w: &solver.w, v: final_v });
    }

    /// Adds rows for the drives that exceeded their limits and for the joints that left their ranges.
    /// Every round adds at least one, so the loop ends.
    fn bound_more(&mut self) -> bool {
        let mut more = false;
        for (tree, range) in self.trees.ranges() {
            more |= tree.bound_more(&self.final_v[range.clone()]);
            more |= tree.hold_more(self.settings.dt_s, &self.moving_v[range]);
        }
        more
    }

    /// Checks that velocities are finite. Finite velocities keep positions finite.
    fn check(&self) -> Result<(), Diverged> {
        for (tree, offset) in self.trees.all.iter().zip(&self.trees.offset) {
            for (dof, link) in tree.layout.link_of.iter().enumerate() {
                let (moving, last) = (self.moving_v[offset + dof], self.final_v[offset + dof]);
                if moving.abs() + last.abs() < FASTEST {
                    continue;
                }
                return Err(Diverged {
                    tree: tree.name.clone(),
                    link: tree.links[*link].name.clone(),
                    speed: if moving.abs() < FASTEST { last } else { moving },
                });
            }
        }
        Ok(())
    }
}

/// Error of a step that produced a number which is not finite or soon would not be. The state is that before
/// the step.
#[derive(Debug, Error, PartialEq)]
#[error(
    "physics diverged at link `{link}` of `{tree}`: a velocity came out as {speed:.3e} m/s or rad/s, which \
     is not finite or soon will not be"
)]
pub struct Diverged {
    pub tree: String,
    pub link: String,
    /// Velocity of one of the link's degrees of freedom, m/s or rad/s.
    pub speed: f64,
}

/// Maximum velocity, m/s or rad/s. Real motion is far slower; beyond it, Rapier's f32 would soon overflow.
const FASTEST: f64 = 1e6;

/// Whitening on the widest vector registers of the processor, bit-identical to scalar operations.
struct Whitening<'a> {
    trees: &'a mut Trees,
    w: &'a mut [f64],
    settings: &'a Settings,
}

impl WithSimd for Whitening<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Settings { dt_s, gravity_m_s2, .. } = *self.settings;
        for tree in self.trees.all.iter_mut().filter(|tree| !tree.is_asleep()) {
            tree.prepare(dt_s, gravity_m_s2);
        }
        self.trees.whiten(dt_s, self.w);
    }
}

/// Unwhitening on the widest vector registers, like [`Whitening`].
struct Unwhitening<'a> {
    trees: &'a mut Trees,
    w: &'a [f64],
    v: &'a mut [f64],
}

impl WithSimd for Unwhitening<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        self.trees.unwhiten(self.w, self.v);
    }
}

impl Tree {
    /// Sets up the mass matrix, the right-hand side, and the velocities of a step without forces.
    #[inline(always)]
    fn prepare(&mut self, dt_s: f64, gravity_m_s2: DVec3) {
        self.bias(gravity_m_s2);
        self.joint_forces(dt_s);
        self.composite_mass_matrix();
        let mut start = std::mem::take(&mut self.unconstrained);
        self.spin_freely(dt_s, &mut start);
        self.unconstrained = start;
    }
}
