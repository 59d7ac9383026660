//! Energy balance of a step by sources, for benchmarks and tests. A step itself does not compute it.
//!
//! The solver finds velocities v' from those before, v, by
//!   M(q) (v' - v) = P - dt h,
//! with the impulses P of everything that acts and the Coriolis and gyroscopic forces h, which in truth
//! do no work. With the mean velocity u = (v + v') / 2, the impulses have done the work
//!   P . u = K(q, v') - K(q, v) + dt h . u,
//! exactly. Part of it is known term by term: gravity, springs, drives, pushes. The rest is the work of
//! contacts, ends of ranges, dry friction, dampers and equalities, which can only remove energy:
//!   taken = P . u - W_gravity - W_springs - W_drives - W_pushes <= 0.
//! The step then moves positions to q' and ends with velocities v''. Its spurious energy is the
//! remainder, with U the potential of gravity and springs:
//!   made = [K + U](q', v'') - [K + U](q, v) - W_drives - W_pushes - taken
//!        = K(q', v'') - K(q, v') - dt h . u + U(q') - U(q) + W_gravity + W_springs.
//! Correction of penetration changes positions alone. Energy from lifting a body that way counts as made,
//! too.

use super::trees::spatial::{ForceVector, Inertia, MotionVector};
use super::trees::tree::Tree;
use super::{DVec3, Dynamics};

/// State before a step, pushes included, for [`Dynamics::energy_balance`].
pub struct EnergyBefore {
    trees: Vec<TreeBefore>,
}

struct TreeBefore {
    q: Vec<f64>,
    v: Vec<f64>,
    axis: Vec<MotionVector>,
    velocity: Vec<MotionVector>,
    inertia: Vec<Inertia>,
    external: Vec<ForceVector>,
    kinetic: f64,
    potential: f64,
}

/// The energy of one step, J.
#[derive(Clone, Debug, Default)]
pub struct EnergyBalance {
    /// Kinetic energy before the step.
    pub kinetic: f64,
    /// Sum of all positive work: of each drive, push and spring, and of gravity on each tree.
    pub put_in: f64,
    /// Work of contacts, ends of ranges, dry friction, dampers and equalities. It is not above 0 if they are
    /// solved accurately.
    pub taken: f64,
    /// Spurious energy, by tree.
    pub made: Vec<f64>,
}

impl Dynamics {
    /// Records the state before a step. Call it after drives and pushes are set and before
    /// [`Dynamics::step`].
    pub fn energy_before(&self) -> EnergyBefore {
        let gravity = self.settings.gravity_m_s2;
        EnergyBefore { trees: self.trees.all.iter().map(|tree| TreeBefore::of(tree, gravity)).collect() }
    }

    /// Returns the energy balance of the step after `before`.
    pub fn energy_balance(&self, before: &EnergyBefore) -> EnergyBalance {
        let mut balance = EnergyBalance::default();
        for ((tree, before), offset) in self.trees.all.iter().zip(&before.trees).zip(&self.trees.offset) {
            let solved = &self.final_v[*offset..offset + tree.dofs()];
            before.close(tree, solved, self.settings.dt_s, self.settings.gravity_m_s2, &mut balance);
        }
        balance
    }
}

impl TreeBefore {
    fn of(tree: &Tree, gravity: DVec3) -> TreeBefore {
        let inertia = inertias(tree);
        TreeBefore {
            q: tree.q.clone(),
            v: tree.v.clone(),
            axis: tree.axis.clone(),
            velocity: tree.velocity.clone(),
            external: tree.external.clone(),
            kinetic: kinetic(tree, &inertia, &tree.velocity, &tree.v),
            potential: potential(tree, gravity),
            inertia,
        }
    }

    /// Adds the energies of one tree's step. `tree` is in its state at the end, and `solved` are the
    /// velocities from the solver.
    fn close(&self, tree: &Tree, solved: &[f64], dt_s: f64, gravity: DVec3, balance: &mut EnergyBalance) {
        let mut solved = solved.to_vec();
        if tree.is_lone() {
            // A lone body's gyration is integrated separately and exactly. Impulses act before it, and
            // the solver's velocity includes it.
            let gyration = tree.half_gyration_rad_s * 2.0;
            (DVec3::from_slice(&solved[3..6]) - gyration).write_to_slice(&mut solved[3..6]);
        }
        let after = self.link_velocities(tree, &solved);
        let mean: Vec<MotionVector> =
            self.velocity.iter().zip(&after).map(|(before, after)| (*before + *after) * 0.5).collect();
        let coriolis = if tree.is_lone() { 0.0 } else { dt_s * self.coriolis_power(tree, &mean) };
        let links = || self.inertia.iter().zip(&mean);
        let weights = dt_s * links().map(|(inertia, v)| gravity.dot(inertia.mul(*v).linear)).sum::<f64>();
        let pushes = dt_s * self.external.iter().zip(&mean).map(|(force, v)| v.dot(*force)).sum::<f64>();
        let (mut springs, mut drives) = (0.0, 0.0);
        balance.put_in += weights.max(0.0) + pushes.max(0.0);
        for (i, link) in tree.links.iter().enumerate() {
            let Some(axis) = link.joint.axis() else { continue };
            let k = tree.layout.first_dof[i];
            let moved = dt_s * 0.5 * (self.v[k] + solved[k]);
            let spring = axis.stiffness * (axis.spring_rest - self.q[i] - dt_s * solved[k]) * moved;
            let drive = tree.effort[i] * moved;
            balance.put_in += spring.max(0.0) + drive.max(0.0);
            springs += spring;
            drives += drive;
        }
        let kinetic_solved = kinetic(tree, &self.inertia, &after, &solved);
        let whole = kinetic_solved - self.kinetic + coriolis;
        let kinetic_now = kinetic(tree, &inertias(tree), &tree.velocity, &tree.v);
        let lifted = potential(tree, gravity) - self.potential;
        balance.kinetic += self.kinetic;
        balance.taken += whole - weights - springs - drives - pushes;
        balance.made.push(kinetic_now - kinetic_solved - coriolis + lifted + weights + springs);
    }

    /// Returns the links' velocities, v = v_p + S q', in the configuration before the step.
    fn link_velocities(&self, tree: &Tree, v: &[f64]) -> Vec<MotionVector> {
        let mut velocities: Vec<MotionVector> = Vec::with_capacity(tree.links.len());
        for (i, link) in tree.links.iter().enumerate() {
            let (dof, dofs) = (tree.layout.first_dof[i], link.joint.dofs());
            let mut velocity = link.parent.map_or(MotionVector::default(), |parent| velocities[parent]);
            for (axis, rate) in self.axis[dof..dof + dofs].iter().zip(&v[dof..]) {
                velocity += *axis * *rate;
            }
            velocities.push(velocity);
        }
        velocities
    }

    /// Returns h . u, summed over the links: the power at the mean velocity of the force that each link's
    /// present motion requires, without gravity.
    fn coriolis_power(&self, tree: &Tree, mean: &[MotionVector]) -> f64 {
        let mut accelerations: Vec<MotionVector> = Vec::with_capacity(tree.links.len());
        let mut power = 0.0;
        for (i, link) in tree.links.iter().enumerate() {
            let velocity = self.velocity[i];
            let acceleration = match link.parent {
                Some(parent) => {
                    let before = self.velocity[parent];
                    accelerations[parent] + before.cross(velocity - before)
                }
                // `equations` does the same: the degrees of freedom of a free link are the velocity of a
                // moving point.
                None if link.joint.dofs() == 6 => {
                    MotionVector { angular: DVec3::ZERO, linear: -velocity.angular.cross(velocity.linear) }
                }
                None => MotionVector::default(),
            };
            accelerations.push(acceleration);
            let inertia = &self.inertia[i];
            let force = inertia.mul(acceleration) + velocity.cross_force(inertia.mul(velocity));
            power += mean[i].dot(force);
        }
        power
    }
}

/// Returns the inertia of each link about the tree's reference, in the current configuration.
fn inertias(tree: &Tree) -> Vec<Inertia> {
    (0..tree.links.len()).map(|link| tree.inertia_of(link)).collect()
}

fn kinetic(tree: &Tree, inertia: &[Inertia], velocity: &[MotionVector], v: &[f64]) -> f64 {
    let links = inertia.iter().zip(velocity).map(|(inertia, v)| v.dot(inertia.mul(*v))).sum::<f64>();
    let rotor = |(i, link): (usize, &super::Link)| {
        let axis = link.joint.axis()?;
        Some(axis.armature * v[tree.layout.first_dof[i]].powi(2))
    };
    0.5 * (links + tree.links.iter().enumerate().filter_map(rotor).sum::<f64>())
}

fn potential(tree: &Tree, gravity: DVec3) -> f64 {
    let link = |(i, link): (usize, &super::Link)| {
        let spring = link
            .joint
            .axis()
            .map_or(0.0, |axis| 0.5 * axis.stiffness * (axis.spring_rest - tree.q[i]).powi(2));
        spring - link.mass.mass_kg * gravity.dot(tree.reference_m + tree.centre_m(i))
    };
    tree.links.iter().enumerate().map(link).sum()
}
