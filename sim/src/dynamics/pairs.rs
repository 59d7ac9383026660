//! From Rapier's narrow phase to candidates for contacts, in an order that does not depend on Rapier's.

use rapier3d::geometry::NEW_CONTACT_BIT;
use rapier3d::glamx::{DPose3, DVec3};
use rapier3d::prelude::{ColliderHandle, ContactManifold, NarrowPhase, SolverFlags};

use super::friction::Friction;
use super::settings::Settings;
use super::spatial::pose_from_rapier;
use super::touch::{Candidate, Impulses, Touch};
use super::trees::{LinkId, Trees};

/// A collider as dynamics knows it.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    /// Rank by registration: orders pairs, whatever handles Rapier gave.
    key: u32,
    /// `None` is the world.
    body: Option<LinkId>,
    /// In the link's frame, or the world's.
    body_from_shape: DPose3,
    friction: Friction,
}

#[derive(Default)]
pub(super) struct Pairs {
    /// By index of Rapier's handle.
    surfaces: Vec<Option<Surface>>,
    registered: u32,
    /// Of this step, in any order.
    pub candidates: Vec<Candidate>,
    /// Indices of candidates by key.
    pub order: Vec<u32>,
}

impl Pairs {
    pub fn register(
        &mut self,
        collider: ColliderHandle,
        body: Option<LinkId>,
        body_from_shape: DPose3,
        friction: Friction,
    ) {
        let index = index_of(collider);
        if self.surfaces.len() <= index {
            self.surfaces.resize(index + 1, None);
        }
        self.surfaces[index] = Some(Surface { key: self.registered, body, body_from_shape, friction });
        self.registered += 1;
    }

    fn surface(&self, collider: ColliderHandle) -> Option<&Surface> {
        self.surfaces.get(index_of(collider))?.as_ref()
    }

    /// Collects what touches, or will within the step. Colliders that were never registered touch nothing.
    pub fn gather(&mut self, narrow_phase: &NarrowPhase, trees: &Trees, settings: &Settings) {
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        for pair in narrow_phase.contact_pairs() {
            let colliders = [pair.collider1, pair.collider2];
            let (Some(a), Some(b)) = (self.surface(colliders[0]), self.surface(colliders[1])) else {
                continue;
            };
            if !may_touch(trees, a.body, b.body) {
                continue;
            }
            let mut number = 0;
            for manifold in pair.solver_manifolds() {
                if manifold.data.solver_flags.contains(SolverFlags::COMPUTE_RIGID_IMPULSES) {
                    let between = Between { trees, settings, colliders, surfaces: [a, b] };
                    between.gather(manifold, &mut number, &mut candidates);
                }
            }
        }
        self.candidates = candidates;
        self.order.clear();
        self.order.extend(0..self.candidates.len() as u32);
        self.order.sort_unstable_by_key(|index| self.candidates[*index as usize].touch.key);
    }
}

/// Bodies of one tree that a joint joins do not collide, as in MuJoCo; nor do two that do not move.
fn may_touch(trees: &Trees, a: Option<LinkId>, b: Option<LinkId>) -> bool {
    let moving = |body: Option<LinkId>| body.filter(|id| trees.moves(*id));
    match (moving(a), moving(b)) {
        (None, None) => false,
        (Some(a), Some(b)) if a.tree == b.tree => {
            !trees.all[a.tree.index()].layout.are_neighbours(a.link, b.link)
        }
        (Some(_), _) | (_, Some(_)) => true,
    }
}

/// A pair of colliders in Rapier's order.
struct Between<'a> {
    trees: &'a Trees,
    settings: &'a Settings,
    colliders: [ColliderHandle; 2],
    surfaces: [&'a Surface; 2],
}

impl Between<'_> {
    fn gather(&self, manifold: &ContactManifold, number: &mut u32, candidates: &mut Vec<Candidate>) {
        let [mut first, mut second] = self.surfaces.map(|surface| *surface);
        let subshapes = [manifold.subshape_pos1(), manifold.subshape_pos2()];
        for (surface, subshape) in [&mut first, &mut second].into_iter().zip(subshapes) {
            if let Some(shape_from_subshape) = subshape {
                surface.body_from_shape *= pose_from_rapier(shape_from_subshape);
            }
        }
        let [world_from_a, world_from_b] = [first, second].map(|surface| self.world_from(surface.body));
        let normal_on_a = first.body_from_shape.rotation * manifold.local_n1.as_dvec3();
        let normal = (world_from_a.rotation * normal_on_a).normalize();
        for contact in &manifold.data.solver_contacts {
            let point = &manifold.points[(contact.contact_id[0] & !NEW_CONTACT_BIT) as usize];
            let a_m = first.body_from_shape * point.local_p1.as_dvec3();
            let b_m = second.body_from_shape * point.local_p2.as_dvec3();
            let (on_a, on_b) = (world_from_a * a_m, world_from_b * b_m);
            let (gap_m, point_m) = ((on_b - on_a).dot(normal), (on_a + on_b) * 0.5);
            let parting_m_s =
                (self.velocity(second.body, point_m) - self.velocity(first.body, point_m)).dot(normal);
            if gap_m + (parting_m_s - self.settings.margin_m_s) * self.settings.dt_s > 0.0 {
                continue;
            }
            let touch = Touch {
                colliders: self.colliders,
                point_m,
                normal,
                gap_m,
                impulse_n_s: DVec3::ZERO,
                normal_impulse_n_s: 0.0,
                key: (first.key, second.key, *number),
                local_m: [a_m, b_m],
                memory: Impulses::default(),
            };
            *number += 1;
            let bodies = [first.body, second.body].map(|body| body.filter(|id| self.trees.moves(*id)));
            let friction = Friction::between(&first.friction, &second.friction);
            candidates.push(Candidate { touch, bodies, friction, directions: [normal; 3] }.in_order());
        }
    }

    fn world_from(&self, body: Option<LinkId>) -> DPose3 {
        body.map_or(DPose3::IDENTITY, |id| self.trees.all[id.tree.index()].world_from_link(id.link))
    }

    fn velocity(&self, body: Option<LinkId>, point_m: DVec3) -> DVec3 {
        body.map_or(DVec3::ZERO, |id| {
            let tree = &self.trees.all[id.tree.index()];
            tree.velocity[id.link].at(point_m - tree.reference_m)
        })
    }
}

impl Candidate {
    /// The collider with the smaller key first, and tangents for the normal.
    fn in_order(mut self) -> Candidate {
        let touch = &mut self.touch;
        let (a, b, number) = touch.key;
        if a > b {
            touch.key = (b, a, number);
            touch.colliders.reverse();
            touch.local_m.reverse();
            touch.normal = -touch.normal;
            self.bodies.reverse();
        }
        let (t1, t2) = touch.normal.any_orthonormal_pair();
        self.directions = [touch.normal, t1, t2];
        self
    }
}

fn index_of(collider: ColliderHandle) -> usize {
    collider.into_raw_parts().0 as usize
}
