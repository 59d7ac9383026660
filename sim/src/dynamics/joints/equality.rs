//! Equalities: coupled joints, points held together, and welds that can be switched, for example a latch.

use pulp::Simd;
use rapier3d::glamx::{DMat3, DPose3, DVec3};
use serde::{Deserialize, Serialize};

use crate::dynamics::settings::{Pass, Settings};
use crate::dynamics::trees::rows::{ConstraintRows, Whitened};
use crate::dynamics::trees::spatial::ForceVector;
use crate::dynamics::trees::{LinkId, TreeId, Trees};

#[derive(Clone, Debug)]
pub enum Equality {
    /// MJCF's `joint`:  follower = a0 + a1 leader + ... + a4 leader^4; without a leader the follower is
    /// held at a0.
    Couple { follower: LinkId, leader: Option<LinkId>, polynomial: [f64; 5] },
    /// MJCF's `connect`: a point of `a` and one of `b` coincide; `None` is the world.
    Connect { a: LinkId, a_point_m: DVec3, b: Option<LinkId>, b_point_m: DVec3 },
    /// MJCF's `weld`: `b` keeps its pose in `a`.
    Weld { a: LinkId, a_from_b: DPose3, b: Option<LinkId> },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EqualityId(pub(in crate::dynamics) usize);

/// State of an equality that outlasts a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EqualityState {
    pub active: bool,
    /// Impulses of its rows in the last step.
    impulse: [DVec3; 2],
}

#[derive(Default)]
pub struct Equalities {
    pub all: Vec<Equality>,
    pub memory: Vec<EqualityState>,
    rows: ConstraintRows<3>,
    blocks: Vec<Block>,
}

/// Three rows that are solved together; a coupling has only the first.
struct Block {
    equality: usize,
    /// Index of this block, 0 or 1, within its equality.
    part: usize,
    /// Velocity along the rows that corrects the error.
    correction: DVec3,
    mass: DMat3,
    impulse: DVec3,
    /// Impulse after the correcting sweeps, with which the next step begins.
    remembered: DVec3,
}

/// Regularisation of the diagonal of a block's inverse mass, as a share of its trace. It keeps rows solvable
/// if no body can move along them.
const REGULARISATION: f64 = 1e-9;

impl Equalities {
    pub fn push(&mut self, equality: Equality, active: bool) -> EqualityId {
        self.all.push(equality);
        self.memory.push(EqualityState { active, impulse: [DVec3::ZERO; 2] });
        EqualityId(self.all.len() - 1)
    }

    /// Returns true if an equality acts on a tree.
    pub fn hold(&self, tree: TreeId) -> bool {
        let is_held = |link: LinkId| link.tree == tree;
        self.all.iter().any(|equality| match *equality {
            Equality::Couple { follower, leader, .. } => is_held(follower) || leader.is_some_and(is_held),
            Equality::Connect { a, b, .. } | Equality::Weld { a, b, .. } => {
                is_held(a) || b.is_some_and(is_held)
            }
        })
    }

    pub fn set_active(&mut self, id: EqualityId, active: bool) {
        if self.memory[id.0].active != active {
            self.memory[id.0] = EqualityState { active, impulse: [DVec3::ZERO; 2] };
        }
    }

    #[inline(always)]
    pub fn prepare<S: Simd>(&mut self, simd: S, trees: &Trees, settings: &Settings) {
        self.rows.clear();
        self.blocks.clear();
        for index in 0..self.all.len() {
            if !self.memory[index].active {
                continue;
            }
            match self.all[index].clone() {
                Equality::Couple { follower, leader, polynomial } => {
                    let (inverse_mass, error) = self.couple(simd, trees, follower, leader, &polynomial);
                    self.close(index, 0, inverse_mass, DVec3::new(error, 0.0, 0.0), settings);
                }
                Equality::Connect { a, a_point_m, b, b_point_m } => {
                    let ends = [world_from(trees, Some(a)) * a_point_m, world_from(trees, b) * b_point_m];
                    self.hold_point(simd, trees, index, [Some(a), b], ends, settings);
                }
                Equality::Weld { a, a_from_b, b } => {
                    let (wanted, is) = (world_from(trees, Some(a)) * a_from_b, world_from(trees, b));
                    let ends = [wanted.translation, is.translation];
                    self.hold_point(simd, trees, index, [Some(a), b], ends, settings);
                    let error = (is.rotation * wanted.rotation.inverse()).to_scaled_axis();
                    let moments = |_| DVec3::AXES.map(ForceVector::moment);
                    let inverse_mass = trees.push_rows(simd, &mut self.rows, [Some(a), b], moments);
                    self.close(index, 1, inverse_mass, error, settings);
                }
            }
        }
    }

    #[inline(always)]
    fn hold_point<S: Simd>(
        &mut self,
        simd: S,
        trees: &Trees,
        index: usize,
        bodies: [Option<LinkId>; 2],
        ends_m: [DVec3; 2],
        settings: &Settings,
    ) {
        let middle_m = (ends_m[0] + ends_m[1]) * 0.5;
        let at = |reference_m| DVec3::AXES.map(|axis| ForceVector::at(middle_m - reference_m, axis));
        let inverse_mass = trees.push_rows(simd, &mut self.rows, bodies, at);
        self.close(index, 0, inverse_mass, ends_m[1] - ends_m[0], settings);
    }

    /// Adds the row of  follower' - p'(leader) leader' = 0. Returns its inverse mass and the error
    /// follower - p(leader).
    #[inline(always)]
    fn couple<S: Simd>(
        &mut self,
        simd: S,
        trees: &Trees,
        follower: LinkId,
        leader: Option<LinkId>,
        polynomial: &[f64; 5],
    ) -> ([[f64; 3]; 3], f64) {
        self.rows.begin();
        let push = |rows: &mut ConstraintRows<3>, id: LinkId, scale: f64| {
            let tree = &trees.all[id.tree.index()];
            let dof = tree.layout.first_dof[id.link];
            rows.push_dof(simd, tree, trees.offset[id.tree.index()], dof, [scale, 0.0, 0.0]);
            tree.q[id.link]
        };
        let position = push(&mut self.rows, follower, 1.0);
        let Some(leader) = leader else {
            return (self.rows.close(), position - polynomial[0]);
        };
        let second = self.rows.columns();
        let x = trees.all[leader.tree.index()].q[leader.link];
        let (mut value, mut slope) = (0.0, 0.0);
        for coefficient in polynomial.iter().rev() {
            slope = slope * x + value;
            value = value * x + coefficient;
        }
        push(&mut self.rows, leader, -slope);
        if leader.tree == follower.tree {
            self.rows.merge(second);
        }
        (self.rows.close(), position - value)
    }

    fn close(&mut self, equality: usize, part: usize, a: [[f64; 3]; 3], error: DVec3, settings: &Settings) {
        let regularisation = REGULARISATION * (a[0][0] + a[1][1] + a[2][2]);
        let mut matrix = DMat3::from_cols_array_2d(&a);
        for c in 0..3 {
            matrix.col_mut(c)[c] += regularisation;
        }
        self.blocks.push(Block {
            equality,
            part,
            correction: error * settings.joint_correction_per_s,
            mass: matrix.inverse(),
            impulse: self.memory[equality].impulse[part],
            remembered: DVec3::ZERO,
        });
    }

    pub fn warm_start(&self, w: &mut Whitened) {
        for (group, block) in self.blocks.iter().enumerate() {
            self.rows.push_impulse(group, &block.impulse.to_array(), w);
        }
    }

    #[inline(always)]
    pub fn sweep(&mut self, pass: Pass, w: &mut Whitened) {
        for (group, block) in self.blocks.iter_mut().enumerate() {
            let mut velocity = DVec3::from_array(self.rows.velocity(group, w));
            if pass == Pass::Correcting {
                velocity += block.correction;
            }
            let change = block.mass * -velocity;
            block.impulse += change;
            self.rows.push_impulse(group, &change.to_array(), w);
        }
    }

    pub fn remember(&mut self) {
        for block in &mut self.blocks {
            block.remembered = block.impulse;
        }
    }

    pub fn commit(&mut self) {
        for block in &self.blocks {
            self.memory[block.equality].impulse[block.part] = block.remembered;
        }
    }
}

fn world_from(trees: &Trees, body: Option<LinkId>) -> DPose3 {
    body.map_or(DPose3::IDENTITY, |id| trees.all[id.tree.index()].world_from_link(id.link))
}
