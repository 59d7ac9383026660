//! One step of everything.

use thiserror::Error;

use crate::dynamics::Dynamics;
use crate::dynamics::settings::Settings;
use crate::dynamics::trees::spatial::ForceVector;
use crate::dynamics::trees::tree::Tree;

impl Dynamics {
    /// Detects collisions, finds what forces act, and moves all trees by one step; once its buffers have grown it allocates
    /// nothing. An error leaves all state as it was.
    pub fn step(&mut self) -> Result<(), Diverged> {
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
        for (tree, range) in self.trees.ranges() {
            let after = &self.final_v[range.clone()];
            tree.keep_efforts(dt_s, after);
            let due = tree.due(gravity_m_s2, dt_s, after, &self.solver.w[range.clone()]);
            tree.integrate(dt_s, &self.moving_v[range], after);
            tree.kinematics();
            if let Some(due) = due {
                tree.settle(&due);
            }
        }
        Ok(())
    }

    /// Velocities at the end of the step, with the drives as they are bounded.
    fn solve(&mut self) {
        let settings = &self.settings;
        for (tree, range) in self.trees.ranges() {
            tree.prepare(settings.dt_s, settings.gravity_m_s2, &mut self.solver.w[range]);
        }
        let candidates = &self.collision.candidates;
        self.solver.prepare(&self.trees, candidates, settings);
        self.solver.correct(candidates, settings.sweeps);
        unwhiten(&self.trees.all, &self.solver.w, &mut self.moving_v);
        self.solver.relax(&self.trees, candidates, settings.relaxing_sweeps);
        unwhiten(&self.trees.all, &self.solver.w, &mut self.final_v);
    }

    /// Makes rows of the drives that exceeded their limits and of the joints that left their ranges; every round adds one at
    /// least, so that it ends.
    fn bound_more(&mut self) -> bool {
        let mut more = false;
        for (tree, range) in self.trees.ranges() {
            more |= tree.bound_more(&self.final_v[range.clone()]);
            more |= tree.hold_more(self.settings.dt_s, &self.moving_v[range]);
        }
        more
    }

    /// Positions are as finite as the velocities that they move by.
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

/// The step gave a number that is not finite or will not be for long; the state is that before the step.
#[derive(Debug, Error, PartialEq)]
#[error(
    "physics diverged at link `{link}` of `{tree}`: a velocity came out as {speed:.3e} m/s or rad/s, which is not finite or soon will not be"
)]
pub struct Diverged {
    pub tree: String,
    pub link: String,
    /// Of one of the link's degrees of freedom, m/s or rad/s.
    pub speed: f64,
}

/// m/s or rad/s. Nothing real comes near; beyond, Rapier's f32 would soon overflow.
const FASTEST: f64 = 1e6;

fn unwhiten(trees: &[Tree], w: &[f64], v: &mut [f64]) {
    let mut offset = 0;
    for tree in trees {
        let range = offset..offset + tree.dofs();
        tree.factor.unwhiten(&tree.layout, &w[range.clone()], &mut v[range.clone()]);
        offset = range.end;
    }
}

impl Tree {
    /// Factorises the mass matrix and sets `w` to the whitened velocities of a step without constraints.
    fn prepare(&mut self, dt_s: f64, gravity_m_s2: crate::dynamics::DVec3, w: &mut [f64]) {
        self.bias(gravity_m_s2);
        self.joint_forces(dt_s);
        self.composite_mass_matrix();
        self.factor.factorise(&self.layout);
        let mut start = std::mem::take(&mut self.unconstrained);
        self.spin_freely(dt_s, &mut start);
        self.factor.whiten(&self.layout, dt_s, &start, &mut self.rhs, w);
        self.unconstrained = start;
    }
}
