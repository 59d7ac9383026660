//! Collision detection: from the poses of colliders to contact candidates.
//!
//! Parry moves the points of a pair along while the pair hardly turns. Otherwise it would choose one of two
//! touching faces in some steps and the other face in others. The points of the last step are therefore part
//! of the state. Round shapes may turn by far less. Their place of contact runs ahead of a point that is
//! moved along, and a force behind that place accelerates the shape.

use std::collections::BTreeMap;

use pulp::{Arch, Simd, WithSimd};
use rapier3d::math::Vector;
use rapier3d::parry::bounding_volume::BoundingVolume;
use rapier3d::parry::query::{
    ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, TrackedContact,
};
use rapier3d::parry::shape::PackedFeatureId;
use serde::{Deserialize, Serialize};

use super::collider::{Collider, ColliderId, Surface};
use super::friction::Friction;
use super::near::NearPairs;
use super::overlap::Overlap;
use super::{Candidate, ContactPoint, Impulses};
use crate::dynamics::settings::Settings;
use crate::dynamics::trees::spatial::rounded;
use crate::dynamics::trees::{LinkId, TreeId, Trees};
use crate::dynamics::{DPose3, DVec3};

/// Angle (rad) by which a round shape turns before its points are searched anew. At Parry's one degree, a
/// bottle that whirled on its rim by two degrees gained energy until it fell over, and a cylinder that rolled
/// at 5 cm/s reached 18 cm/s. At zero, a shape at rest on a round base gets other corners in every step and
/// trembles.
const ROUND_TURNS_RAD: f64 = 0.001;
/// Maximum excess of a point's depth over the depth of the corners in a full contact of two faces.
const FACE_M: f32 = 0.001;

#[derive(Default)]
pub struct Collision {
    surfaces: Vec<Surface>,
    near: NearPairs,
    /// Candidates of this step, in the order of their colliders.
    pub candidates: Vec<Candidate>,
    /// Manifolds of the last step that have points, in the order of their colliders.
    pub manifolds: Vec<Manifold>,
    /// Friction of pairs with their own coefficients.
    pair_friction: BTreeMap<[ColliderId; 2], Friction>,
    /// Manifolds of this step; [`Collision::commit`] makes them those of the last step.
    found: Vec<Manifold>,
    spare: Vec<ContactManifold<(), ()>>,
}

/// Parry's contact points of two colliders.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Manifold {
    pub(in crate::dynamics) colliders: [ColliderId; 2],
    points: ContactManifold<(), ()>,
}

impl Collision {
    /// Adds a collider.
    ///
    /// # Panics
    ///
    /// Panics if the shape is not convex.
    pub fn add(&mut self, collider: Collider, trees: &Trees, settings: &Settings) -> ColliderId {
        assert!(collider.shape.is_convex(), "a collider has a convex shape");
        let surface = Surface::new(collider, trees, settings);
        let id = self.near.add(&surface);
        self.surfaces.push(surface);
        id
    }

    pub fn keep_apart(&mut self, a: LinkId, b: LinkId) {
        self.near.keep_apart(a, b);
    }

    pub fn keep_colliders_apart(&mut self, a: ColliderId, b: ColliderId) {
        self.near.keep_colliders_apart(a, b);
    }

    /// Lets two colliders touch regardless of their masks, with this friction between them.
    pub fn let_touch(&mut self, a: ColliderId, b: ColliderId, friction: Friction) {
        let pair = [a.min(b), a.max(b)];
        self.near.let_touch(pair);
        self.pair_friction.insert(pair, friction);
    }

    pub fn collider(&self, id: ColliderId) -> &Collider {
        &self.surfaces[id.index()].collider
    }

    pub fn colliders(&self) -> impl Iterator<Item = &Collider> {
        self.surfaces.iter().map(|surface| &surface.collider)
    }

    pub fn colliders_mut(&mut self) -> impl Iterator<Item = &mut Collider> {
        self.surfaces.iter_mut().map(|surface| &mut surface.collider)
    }

    /// Places all surfaces, and finds the pairs that are near.
    pub fn place_all(&mut self, trees: &Trees, settings: &Settings) {
        Arch::new().dispatch(Placing { collision: self, trees, settings });
        self.near.update(&self.surfaces, trees);
    }

    /// Places the surfaces of sleeping bodies, too, in the next step. Call it after their state was set.
    pub fn place_sleepers(&mut self) {
        self.surfaces.iter_mut().for_each(|surface| surface.sleeps_there = false);
    }

    /// Returns the trees that carry two colliders. An entry is `None` if the collider cannot move.
    pub fn trees_of(&self, colliders: [ColliderId; 2]) -> [Option<TreeId>; 2] {
        colliders.map(|id| self.surfaces[id.index()].body.map(|body| body.tree))
    }

    /// Returns pairs of different trees with colliders whose bounds meet.
    pub fn meeting_trees(&self) -> impl Iterator<Item = [TreeId; 2]> {
        self.near.pairs.iter().filter_map(|pair| {
            let [a, b] = pair.map(|id| &self.surfaces[id.index()]);
            let trees = [a.body?.tree, b.body?.tree];
            (trees[0] != trees[1] && a.bounds.intersects(&b.bounds)).then_some(trees)
        })
    }

    /// Collects the points that touch, or will touch within the step. All surfaces must be placed.
    pub fn detect(&mut self, trees: &Trees, settings: &Settings) {
        self.candidates.clear();
        self.spare.extend(self.found.drain(..).map(|manifold| manifold.points));
        let mut last = self.manifolds.iter().peekable();
        for &colliders in &self.near.pairs {
            while last.next_if(|manifold| manifold.colliders < colliders).is_some() {}
            let surfaces = colliders.map(|id| &self.surfaces[id.index()]);
            if surfaces.iter().all(|surface| surface.is_still(trees))
                || !surfaces[0].bounds.intersects(&surfaces[1].bounds)
            {
                continue;
            }
            let [first, second] = surfaces;
            let world_from_shapes = [first.beside(second), second.beside(first)];
            let own_friction = self.pair_friction.get(&colliders);
            let between = NearPair { colliders, surfaces, world_from_shapes, own_friction, trees, settings };
            let mut points = self.spare.pop().unwrap_or_default();
            let before = last.next_if(|manifold| manifold.colliders == colliders);
            between.find(before.map(|manifold| &manifold.points), &mut points);
            if points.points.is_empty() {
                self.spare.push(points);
            } else {
                between.collect(&points, &mut self.candidates);
                self.found.push(Manifold { colliders, points });
            }
        }
    }

    /// Keeps the manifolds with which the next step begins.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.manifolds, &mut self.found);
    }

    /// Places the moving colliders by the poses of their links.
    #[inline(always)]
    fn place(&mut self, trees: &Trees, settings: &Settings) {
        let mut last = None;
        for (index, surface) in self.surfaces.iter_mut().enumerate() {
            let Some(body) = surface.body else { continue };
            let is_asleep = trees.all[body.tree.index()].is_asleep();
            if is_asleep && surface.sleeps_there {
                continue;
            }
            surface.sleeps_there = is_asleep;
            // Colliders of one link are adjacent.
            let (pose, spin_rad_s) = match last {
                Some((link, pose, spin_rad_s)) if link == body => (pose, spin_rad_s),
                _ => (trees.world_from(body), trees.spin_rad_s(body)),
            };
            last = Some((body, pose, spin_rad_s));
            surface.place(&pose, spin_rad_s, trees, settings);
            self.near.place(ColliderId(index as u32), surface);
        }
    }
}

/// Placement on the widest vector registers of the processor, with bit-identical results.
struct Placing<'a> {
    collision: &'a mut Collision,
    trees: &'a Trees,
    settings: &'a Settings,
}

impl WithSimd for Placing<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        self.collision.place(self.trees, self.settings);
    }
}

/// Two colliders that are near each other.
struct NearPair<'a> {
    colliders: [ColliderId; 2],
    surfaces: [&'a Surface; 2],
    world_from_shapes: [DPose3; 2],
    own_friction: Option<&'a Friction>,
    trees: &'a Trees,
    settings: &'a Settings,
}

impl NearPair<'_> {
    /// Finds the contact points, starting from those of the last step if there are any.
    fn find(&self, before: Option<&ContactManifold<(), ()>>, manifold: &mut ContactManifold<(), ()>) {
        let [first, second] = self.surfaces;
        manifold.clear();
        match before {
            Some(before) if self.is_continued(before) => {
                (manifold.local_n1, manifold.local_n2) = (before.local_n1, before.local_n2);
                manifold.points.extend_from_slice(&before.points);
            }
            // Initial direction of Parry's search.
            Some(before) => manifold.local_n1 = before.local_n1,
            None => manifold.local_n1 = first.towards(second).as_vec3(),
        }
        let near_m = (first.reach_m + second.reach_m) as f32;
        let [a, b] = self.surfaces.map(|surface| &*surface.collider.shape);
        let [world_from_a, world_from_b] = self.world_from_shapes;
        let a_from_b = rounded(&(world_from_a.inverse() * world_from_b));
        DefaultQueryDispatcher
            .contact_manifold_convex_convex(&a_from_b, a, b, None, None, near_m, manifold)
            .expect("Parry knows all convex shapes");
        if let Some(overlap) = Overlap::of([a, b], &a_from_b) {
            overlap.mend(before, manifold);
        }
        // Parry may find no direction between two shapes that only just touch. In the next step they overlap
        // a little more, or are apart.
        if !manifold.local_n1.is_normalized() {
            manifold.clear();
        }
    }

    /// Returns true if the points of the last step may be moved along. Parry checks the other conditions
    /// itself.
    fn is_continued(&self, before: &ContactManifold<(), ()>) -> bool {
        if !self.surfaces.iter().any(|surface| surface.is_round) {
            return true;
        }
        let [world_from_a, world_from_b] = self.world_from_shapes;
        let a_from_b = world_from_a.rotation.inverse() * world_from_b.rotation;
        // The normals were opposite when the points were found, and each normal moves with its shape.
        let [of_a, of_b] = [before.local_n1, before.local_n2].map(Vector::as_dvec3);
        of_a.cross(a_from_b * of_b).length() < ROUND_TURNS_RAD
    }

    /// Collects the points that touch, or will touch within the step.
    fn collect(&self, manifold: &ContactManifold<(), ()>, candidates: &mut Vec<Candidate>) {
        let [first, second] = self.surfaces;
        let normal = (first.world_from_shape.rotation * manifold.local_n1.as_dvec3()).normalize();
        let (t1, t2) = normal.any_orthonormal_pair();
        let [a, b] = [&first.collider.friction, &second.collider.friction];
        let friction = self.own_friction.map_or_else(|| Friction::between(a, b), |own| own.worn(a, b));
        let bodies = self.surfaces.map(|surface| surface.body);
        let mut number = 0;
        // Parry adds the nearest point to the corners of two faces in contact; it lies between them and
        // wanders. The face of a tilted hull that is most aligned with the normal may not be the deepest
        // one. In that case the added point is needed.
        let of_faces = |point: &&TrackedContact<()>| point.fid1 != PackedFeatureId::UNKNOWN;
        let deepest_m =
            manifold.points.iter().filter(of_faces).map(|point| point.dist).fold(f32::MAX, f32::min);
        let faces =
            manifold.points.len() > 3 && manifold.points.iter().all(|point| point.dist > deepest_m - FACE_M);
        for point in manifold.points.iter().filter(|point| !faces || point.fid1 != PackedFeatureId::UNKNOWN) {
            let local_m = [point.local_p1, point.local_p2].map(Vector::as_dvec3);
            let [on_a_m, on_b_m] = [0, 1].map(|side| self.world_from_shapes[side] * local_m[side]);
            let (gap_m, point_m) = ((on_b_m - on_a_m).dot(normal), (on_a_m + on_b_m) * 0.5);
            let [before_m_s, after_m_s] = bodies.map(|body| self.velocity_m_s(body, point_m));
            let parting_m_s = (after_m_s - before_m_s).dot(normal);
            if gap_m + (parting_m_s - self.settings.margin_m_s) * self.settings.dt_s > 0.0 {
                continue;
            }
            let touch = ContactPoint {
                colliders: self.colliders,
                number,
                point_m,
                normal,
                gap_m,
                impulse_n_s: DVec3::ZERO,
                normal_impulse_n_s: 0.0,
                local_m,
                memory: Impulses::default(),
            };
            number += 1;
            candidates.push(Candidate { touch, bodies, friction, directions: [normal, t1, t2] });
        }
    }

    fn velocity_m_s(&self, body: Option<LinkId>, point_m: DVec3) -> DVec3 {
        body.map_or(DVec3::ZERO, |id| self.trees.all[id.tree.index()].point_velocity_m_s(id.link, point_m))
    }
}
