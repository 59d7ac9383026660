//! The constraint solver: contacts, joints and equalities of a step, by projected Gauss-Seidel on
//! whitened velocities.

mod heaps;
mod step;

pub use step::Diverged;

use heaps::Heaps;
use pulp::{Arch, Simd, WithSimd};

use crate::dynamics::contacts::friction::{Contacts, Directions, Terms};
use crate::dynamics::contacts::{Candidate, ContactPoint, Impulses, continued};
use crate::dynamics::joints::bounds::JointRows;
use crate::dynamics::joints::equality::Equalities;
use crate::dynamics::settings::{Pass, Settings};
use crate::dynamics::trees::link::Joint;
use crate::dynamics::trees::rows::Whitened;
use crate::dynamics::trees::spatial::ForceVector;
use crate::dynamics::trees::{LinkId, Trees};

/// Velocity (rad/s or m/s) removed in the last sweep above which more sweeps follow, and the maximum number
/// of these. Only ends of ranges and motors that are turned too fast count, for example when a heavy body
/// presses a light link against its stop.
const UNSETTLED: f64 = 2.0;
const MORE_SWEEPS: usize = 32;
/// Number of these extra sweeps after which contacts change only by a share of their full update.
/// Without it, friction at a finger wedged between the floor and its stop oscillates forever, each sweep
/// undoing the one before.
const WHOLE_SWEEPS: usize = 8;
const DAMPED_SHARE: f64 = 0.5;
/// Penetration depth above which the same number of sweeps is added, for example when a heavy body presses a
/// light one into the floor.
const DEEP_M: f64 = 0.01;
/// Penetration depth above which a contact is rigid.
const RIGID_M: f64 = 0.02;
/// Lower bound of the inverse mass along a contact's normal, as a share of the inverse masses of the two
/// links.
const MIN_SHARE: f64 = 0.01;
/// Energy (J) removed by the relaxing sweeps above which [`Solver::take_only`] scales the contact impulses.
const HARD_J: f64 = 0.3;

#[derive(Default)]
pub struct Solver {
    /// Whitened velocities of all trees.
    pub w: Whitened,
    /// Whitened velocities before the step, and their change by contacts. Only [`Solver::take_only`] uses
    /// them.
    before: Vec<f64>,
    change: Whitened,
    joints: JointRows,
    pub equalities: Equalities,
    heaps: Heaps,
    /// Contacts that slide and spin, and contacts that also resist rolling. Both are in the order in which
    /// heaps take turns.
    plain: Contacts<4>,
    rolling: Contacts<6>,
    /// Initial impulses of each candidate, and its index among the contacts of its kind.
    begins: Vec<[f64; 6]>,
    places: Vec<usize>,
    /// Contact points of the last step, in the order of their colliders.
    pub touches: Vec<ContactPoint>,
    /// Contact points of this step; [`Solver::commit`] makes them those of the last step.
    found: Vec<ContactPoint>,
}

impl Solver {
    /// Builds all rows. The trees must be factorised, and `w` must contain the unconstrained velocities.
    pub fn prepare(&mut self, trees: &Trees, candidates: &[Candidate], settings: &Settings) {
        self.w.clear_margins();
        self.begin(candidates, settings);
        Arch::new().dispatch(Gathering { solver: self, trees, candidates, settings });
    }

    #[inline(always)]
    fn gather<S: Simd>(&mut self, simd: S, trees: &Trees, candidates: &[Candidate], settings: &Settings) {
        self.joints.prepare(trees, settings);
        self.equalities.prepare(simd, trees, settings);
        self.plain.clear();
        self.rolling.clear();
        self.places.clear();
        self.places.resize(candidates.len(), 0);
        self.heaps.find(trees.all.len(), candidates);
        for index in self.heaps.in_turn(candidates) {
            let (candidate, impulse) = (&candidates[index], self.begins[index]);
            self.places[index] = match candidate.friction.directions {
                Directions::None | Directions::Slide | Directions::SlideSpin => {
                    push(simd, &mut self.plain, candidate, impulse, trees, settings)
                }
                Directions::SlideSpinRoll => {
                    push(simd, &mut self.rolling, candidate, impulse, trees, settings)
                }
            };
        }
    }

    /// Finds the initial impulses of candidates: those of the contacts that they continue.
    fn begin(&mut self, candidates: &[Candidate], settings: &Settings) {
        self.begins.clear();
        let mut before = 0;
        for candidate in candidates {
            let touch = &candidate.touch;
            while self.touches.get(before).is_some_and(|old| old.colliders < touch.colliders) {
                before += 1;
            }
            let of_pair = |old: &&ContactPoint| old.colliders == touch.colliders;
            let same = self.touches[before..].iter().take_while(of_pair).count();
            let old = continued(touch, &self.touches[before..before + same], settings.match_m);
            self.begins.push(old.unwrap_or_default().lanes(candidate.directions));
        }
    }

    /// Finds the impulses that correct positions; `w` becomes the velocity of the positions. The next
    /// step begins with these impulses.
    pub fn correct(&mut self, trees: &Trees, candidates: &[Candidate], sweeps: usize) {
        self.joints.warm_start(trees, &mut self.w);
        self.equalities.warm_start(&mut self.w);
        self.plain.push_impulses(&mut self.w);
        self.rolling.push_impulses(&mut self.w);
        let deep = candidates.iter().any(|candidate| candidate.touch.gap_m < -DEEP_M);
        self.settle(trees, Pass::Correcting, if deep { sweeps + MORE_SWEEPS } else { sweeps });
        self.equalities.remember();
        self.found.clear();
        for (index, candidate) in candidates.iter().enumerate() {
            let memory = Impulses::of_lanes(self.impulse(index, candidate), candidate.directions);
            self.found.push(ContactPoint { memory, ..candidate.touch });
        }
    }

    /// Finds the impulses without correction. `w` then is the velocity at the end of the step, and the
    /// contact points report the impulses that acted.
    pub fn relax(&mut self, trees: &Trees, candidates: &[Candidate], sweeps: usize) {
        let corrected_j = kinetic_j(&self.w);
        self.settle(trees, Pass::Relaxing, sweeps);
        if corrected_j - kinetic_j(&self.w) > HARD_J {
            self.take_only(trees, candidates);
        }
        for (index, candidate) in candidates.iter().enumerate() {
            let acted = Impulses::of_lanes(self.impulse(index, candidate), candidate.directions);
            let touch = &mut self.found[index];
            touch.normal_impulse_n_s = acted.normal;
            touch.impulse_n_s = touch.normal * acted.normal + acted.tangent;
        }
    }

    /// Keeps the state with which the next step begins. State of the last step is unchanged before this call.
    pub fn commit(&mut self, trees: &mut Trees, dt_s: f64) {
        self.joints.commit(trees, dt_s);
        self.equalities.commit();
        std::mem::swap(&mut self.touches, &mut self.found);
    }

    /// Runs `sweeps` sweeps, and more if ends of ranges or motors that are turned too fast have not settled.
    fn settle(&mut self, trees: &Trees, pass: Pass, sweeps: usize) {
        Arch::new().dispatch(Settling { solver: self, trees, pass, sweeps });
    }

    #[inline(always)]
    fn settle_with(&mut self, trees: &Trees, pass: Pass, sweeps: usize) {
        let mut pushed = 0.0;
        for sweep in 0..sweeps + MORE_SWEEPS {
            if sweep >= sweeps && pushed < UNSETTLED {
                break;
            }
            let share = if sweep < sweeps + WHOLE_SWEEPS { 1.0 } else { DAMPED_SHARE };
            pushed = self.sweep(trees, pass, share);
        }
    }

    /// Scales contact impulses so that contacts only remove energy. Sweeps that have not settled can
    /// leave part of the speed that separates penetrating bodies. The impulses P of all contacts of a
    /// heap have then done work, and a share s of them does
    ///   W(s) = s P . (v + v' - (1 - s) M^-1 P) / 2,   v and v' the velocities before and after the step.
    /// The share with which the contacts do no work is used. It preserves all momentum and all friction
    /// cones. Remaining approach velocities, and joints that move on into their stops, are stopped in the
    /// next step.
    fn take_only(&mut self, trees: &Trees, candidates: &[Candidate]) {
        self.before.resize(self.w.len(), 0.0);
        for (tree, offset) in trees.all.iter().zip(&trees.offset) {
            tree.factor.whiten_velocity(
                &tree.layout,
                &tree.v,
                &mut self.before[*offset..offset + tree.dofs()],
            );
        }
        self.change.resize(self.w.len());
        self.change.fill(0.0);
        self.plain.push_impulses(&mut self.change);
        self.rolling.push_impulses(&mut self.change);
        let mut work = vec![HeapWork::default(); trees.all.len()];
        for (index, (tree, offset)) in trees.all.iter().zip(&trees.offset).enumerate() {
            let of_heap = &mut work[self.heaps.of_tree(index)];
            for at in *offset..offset + tree.dofs() {
                of_heap.twice_j += self.change[at] * (self.before[at] + self.w[at]);
                of_heap.own_j += self.change[at] * self.change[at];
            }
        }
        if work.iter().all(|work| work.twice_j <= 0.0) {
            return;
        }
        for (index, (tree, offset)) in trees.all.iter().zip(&trees.offset).enumerate() {
            let left_out = 1.0 - work[self.heaps.of_tree(index)].share();
            for at in *offset..offset + tree.dofs() {
                self.w[at] -= left_out * self.change[at];
            }
        }
        for (place, candidate) in self.places.iter().zip(candidates) {
            let share = work[self.heaps.of_contact(candidate)].share();
            let impulse = match candidate.friction.directions {
                Directions::None | Directions::Slide | Directions::SlideSpin => {
                    &mut self.plain.all[*place].impulse[..]
                }
                Directions::SlideSpinRoll => &mut self.rolling.all[*place].impulse[..],
            };
            impulse.iter_mut().for_each(|impulse| *impulse *= share);
        }
    }

    /// Returns the impulses of the contact made from a candidate.
    fn impulse(&self, index: usize, candidate: &Candidate) -> [f64; 6] {
        let mut lanes = [0.0; 6];
        match candidate.friction.directions {
            Directions::None | Directions::Slide | Directions::SlideSpin => {
                lanes[..4].copy_from_slice(&self.plain.all[self.places[index]].impulse);
            }
            Directions::SlideSpinRoll => lanes = self.rolling.all[self.places[index]].impulse,
        }
        lanes
    }

    /// Runs one sweep, in which contacts change by `share` of their full update. Returns the largest velocity
    /// (rad/s or m/s) that joints removed, see [`JointRows::sweep`].
    #[inline(always)]
    fn sweep(&mut self, trees: &Trees, pass: Pass, share: f64) -> f64 {
        let pushed = self.joints.sweep(pass, trees, &mut self.w);
        self.equalities.sweep(pass, &mut self.w);
        self.plain.sweep(pass, share, &mut self.w);
        self.rolling.sweep(pass, share, &mut self.w);
        pushed
    }
}

/// Sweeps on the widest vector registers of the processor, bit-identical to scalar operations.
struct Settling<'a> {
    solver: &'a mut Solver,
    trees: &'a Trees,
    pass: Pass,
    sweeps: usize,
}

impl WithSimd for Settling<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        self.solver.settle_with(self.trees, self.pass, self.sweeps);
    }
}

/// Construction of all rows of contacts on the widest vector registers, like [`Settling`].
struct Gathering<'a> {
    solver: &'a mut Solver,
    trees: &'a Trees,
    candidates: &'a [Candidate],
    settings: &'a Settings,
}

impl WithSimd for Gathering<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.solver.gather(simd, self.trees, self.candidates, self.settings);
    }
}

/// Work of the contacts of a heap in a step.
#[derive(Clone, Copy, Default)]
struct HeapWork {
    /// Twice the work of the impulses, and twice the work of the same impulses on bodies at rest.
    twice_j: f64,
    own_j: f64,
}

impl HeapWork {
    /// Returns the share of the impulses that does no work.
    fn share(self) -> f64 {
        match self.twice_j > 0.0 {
            true => (1.0 - self.twice_j / self.own_j).max(0.0),
            false => 1.0,
        }
    }
}

/// Returns the kinetic energy, including the terms that springs, dampers and drives add to the mass matrix.
fn kinetic_j(w: &[f64]) -> f64 {
    0.5 * w.iter().map(|w| w * w).sum::<f64>()
}

/// Returns the remaining share of a contact's softness: 1 up to a depth of 1 cm, 0 at 2 cm. Without it, a
/// finger stretched against its stop would stay 2 cm deep in an obstacle, if an arm presses it with 300 times
/// the finger's weight.
fn giving_share(gap_m: f64) -> f64 {
    ((RIGID_M + gap_m) / (RIGID_M - DEEP_M)).clamp(0.0, 1.0)
}

/// Returns the least inverse mass (1/kg) along a contact's normal: [`MIN_SHARE`] of the inverse masses of the
/// two links. The actual inverse mass is lower only if joints let neither link move. Returns 0 between two
/// trees, or a tree and the world, if a tree is free: the actual inverse mass is then at least that of the
/// whole tree.
fn least_inverse_mass(trees: &Trees, bodies: [Option<LinkId>; 2]) -> f64 {
    let held = |body: LinkId| !matches!(trees.all[body.tree.index()].links[0].joint, Joint::Free);
    let within_one = matches!(bodies, [Some(a), Some(b)] if a.tree == b.tree);
    if !within_one && !bodies.into_iter().flatten().all(held) {
        return 0.0;
    }
    let own = |body: LinkId| {
        let mass_kg = trees.all[body.tree.index()].links[body.link].mass.mass_kg;
        if mass_kg > 0.0 { mass_kg.recip() } else { 0.0 }
    };
    MIN_SHARE * bodies.into_iter().flatten().map(own).sum::<f64>()
}

/// Adds a contact. Returns its index.
#[inline(always)]
fn push<S: Simd, const N: usize>(
    simd: S,
    contacts: &mut Contacts<N>,
    candidate: &Candidate,
    impulse: [f64; 6],
    trees: &Trees,
    settings: &Settings,
) -> usize {
    let [normal, t1, t2] = candidate.directions;
    let point_m = candidate.touch.point_m;
    let inverse_mass = trees.push_rows(simd, &mut contacts.rows, candidate.bodies, |reference_m| {
        let at = |direction| ForceVector::at(point_m - reference_m, direction);
        let lanes = [
            at(normal),
            at(t1),
            at(t2),
            ForceVector::moment(normal),
            ForceVector::moment(t1),
            ForceVector::moment(t2),
        ];
        std::array::from_fn(|lane| lanes[lane])
    });
    let grounded = candidate.bodies.iter().any(|body| body.is_none());
    let softness = if grounded { settings.ground_contact } else { settings.contact };
    let gap_m = candidate.touch.gap_m;
    let open_m_s = gap_m.max(0.0) / settings.dt_s;
    let depth_m = (gap_m + settings.slop_m).min(0.0);
    let correction_m_s = depth_m * softness.correction_per_s(settings.dt_s);
    let mut friction = candidate.friction.lanes();
    if gap_m > 0.0 {
        // Only a loaded contact resists rolling. Otherwise a ball in a bowl would lose part of its spin to
        // every face that it is about to touch.
        friction[4..].fill(0.0);
    }
    let terms = Terms {
        bias_m_s: [open_m_s + correction_m_s.max(-settings.fastest_correction_m_s), open_m_s],
        softness: softness.compliance(settings.dt_s) * giving_share(gap_m),
        least_inverse_mass: least_inverse_mass(trees, candidate.bodies),
        friction: std::array::from_fn(|lane| friction[lane]),
        impulse: std::array::from_fn(|lane| if friction[lane] > 0.0 { impulse[lane] } else { 0.0 }),
    };
    contacts.push(inverse_mass, terms);
    contacts.all.len() - 1
}
