//! Pairs of colliders near each other: Rapier's broad phase, on bounds grown by the motion within a step.

use std::collections::BTreeSet;

use rapier3d::prelude::{
    ActiveCollisionTypes, BroadPhaseBvh, BroadPhasePairEvent, ColliderBuilder, ColliderHandle, ColliderPair,
    ColliderSet, IntegrationParameters, RigidBodySet,
};

use super::collider::{ColliderId, Surface};
use crate::dynamics::trees::{LinkId, Trees};

#[derive(Default)]
pub struct NearPairs {
    /// Pairs in order, the smaller collider first. They include all pairs that could touch in this step, and
    /// some that could not. The latter depend on earlier steps, so no result may depend on them.
    pub pairs: Vec<[ColliderId; 2]>,
    apart: Apart,
    broad_phase: BroadPhaseBvh,
    /// Colliders as the broad phase reads them, without bodies.
    colliders: ColliderSet,
    handles: Vec<ColliderHandle>,
    bodies: RigidBodySet,
    parameters: IntegrationParameters,
    events: Vec<BroadPhasePairEvent>,
}

/// Pairs of links and of colliders that never touch, and the exceptions.
#[derive(Default)]
struct Apart {
    /// Pairs of links, smaller first.
    links: BTreeSet<(LinkId, LinkId)>,
    /// Pairs of colliders, smaller first.
    colliders: BTreeSet<[ColliderId; 2]>,
    /// Pairs of colliders, smaller first, that may touch nevertheless.
    together: BTreeSet<[ColliderId; 2]>,
}

impl NearPairs {
    pub fn add(&mut self, surface: &Surface) -> ColliderId {
        // For Rapier all colliders are fixed. It forms no pair of two colliders that no tree moves.
        let kinds = match surface.body {
            Some(_) => ActiveCollisionTypes::FIXED_FIXED,
            None => ActiveCollisionTypes::empty(),
        };
        let shape = surface.collider.shape.clone();
        let handle = self.colliders.insert(ColliderBuilder::new(shape).active_collision_types(kinds));
        let id = ColliderId(self.handles.len() as u32);
        assert_eq!(handle.into_raw_parts().0, id.0, "Rapier counts colliders as we do");
        self.handles.push(handle);
        self.place(id, surface);
        id
    }

    pub fn keep_apart(&mut self, a: LinkId, b: LinkId) {
        self.apart.links.insert((a.min(b), a.max(b)));
    }

    pub fn keep_colliders_apart(&mut self, a: ColliderId, b: ColliderId) {
        self.apart.colliders.insert([a.min(b), a.max(b)]);
    }

    pub fn let_touch(&mut self, pair: [ColliderId; 2]) {
        self.apart.together.insert(pair);
    }

    /// Sets the bounds of a collider; [`NearPairs::update`] must follow.
    pub fn place(&mut self, id: ColliderId, surface: &Surface) {
        self.broad_phase.set_aabb(&self.parameters, self.handles[id.index()], surface.bounds);
    }

    pub fn update(&mut self, surfaces: &[Surface], trees: &Trees) {
        self.events.clear();
        let (broad_phase, events) = (&mut self.broad_phase, &mut self.events);
        broad_phase.update(&self.parameters, &self.colliders, &self.bodies, &[], &[], events);
        for event in &self.events {
            match event {
                BroadPhasePairEvent::AddPair(pair) => {
                    let pair = in_order(pair);
                    let may_touch = may_touch(pair, surfaces, trees, &self.apart);
                    if let Err(place) = self.pairs.binary_search(&pair)
                        && may_touch
                    {
                        self.pairs.insert(place, pair);
                    }
                }
                BroadPhasePairEvent::DeletePair(pair) => {
                    if let Ok(place) = self.pairs.binary_search(&in_order(pair)) {
                        self.pairs.remove(place);
                    }
                }
            }
        }
    }
}

fn in_order(pair: &ColliderPair) -> [ColliderId; 2] {
    let [a, b] = [pair.collider1, pair.collider2].map(|handle| ColliderId(handle.into_raw_parts().0));
    [a.min(b), a.max(b)]
}

/// Returns true if two colliders may touch. As in MuJoCo, bodies of one tree that a joint connects do not
/// collide. Neither do colliders that are kept apart or whose masks exclude each other, unless the pair is
/// exempted.
fn may_touch(pair: [ColliderId; 2], surfaces: &[Surface], trees: &Trees, apart: &Apart) -> bool {
    if apart.together.contains(&pair) {
        return true;
    }
    let [a, b] = pair.map(|id| &surfaces[id.index()]);
    if !a.collider.touches.meets(b.collider.touches) || apart.colliders.contains(&pair) {
        return false;
    }
    // Fixed links can also be kept apart from others.
    if let (Some(a), Some(b)) = (a.collider.on, b.collider.on)
        && apart.links.contains(&(a.min(b), a.max(b)))
    {
        return false;
    }
    let (Some(a), Some(b)) = (a.body, b.body) else { return true };
    a.tree != b.tree || !trees.all[a.tree.index()].layout.are_neighbours(a.link, b.link)
}
