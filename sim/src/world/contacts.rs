//! Which colliders may touch, and what a hand feels of an object.

use std::sync::Arc;

use rapier3d::math::Vector;
use rapier3d::prelude::*;

use super::World;
use crate::body::RobotModel;
use crate::robot::robot_and_link;
use crate::{PHYSICS_DT_S, Side};

/// Normal contact forces (N, world) that a hand's parts exert on an object, averaged over the last physics step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HandContacts {
    pub thumb_n: Vector,
    pub fingers_n: Vector,
    pub palm_n: Vector,
}

/// Leaves out the contacts inside a robot that its file excludes.
pub(super) struct SelfCollision {
    model: Arc<RobotModel>,
}

impl SelfCollision {
    pub(super) fn new(model: Arc<RobotModel>) -> SelfCollision {
        SelfCollision { model }
    }
}

impl PhysicsHooks for SelfCollision {
    fn filter_contact_pair(&self, pair: &PairFilterContext) -> Option<SolverFlags> {
        let tag = |handle: ColliderHandle| robot_and_link(pair.colliders[handle].user_data);
        let apart = match (tag(pair.collider1), tag(pair.collider2)) {
            (Some((robot_1, link_1)), Some((robot_2, link_2))) if robot_1 == robot_2 => {
                !self.model.may_touch(link_1, link_2)
            }
            _ => false,
        };
        (!apart).then_some(SolverFlags::COMPUTE_RIGID_IMPULSES)
    }
}

impl World {
    /// Forces of one hand on one object; zero if the object is unknown or out of touch.
    pub fn hand_contacts(&self, robot: usize, side: Side, object: &str) -> HandContacts {
        let mut contacts = HandContacts::default();
        let Some(object) = self.objects.iter().find(|candidate| candidate.name == object) else {
            return contacts;
        };
        let hand = &self.robots[robot].model.hands[side];
        for (link, force_n) in object.colliders.iter().flat_map(|collider| self.link_forces(robot, *collider))
        {
            if hand.thumb.contains(&link) {
                contacts.thumb_n += force_n;
            } else if hand.fingers.contains(&link) {
                contacts.fingers_n += force_n;
            } else if link == hand.wrist {
                contacts.palm_n += force_n;
            }
        }
        contacts
    }

    /// Links of a robot that press on a collider, with their normal force on it (N, world).
    fn link_forces(&self, robot: usize, collider: ColliderHandle) -> impl Iterator<Item = (usize, Vector)> {
        self.physics.narrow_phase.contact_pairs_with(collider).filter_map(move |pair| {
            let first = pair.collider1 == collider;
            let other = if first { pair.collider2 } else { pair.collider1 };
            let (owner, link) = robot_and_link(self.physics.colliders[other].user_data)?;
            let sign = if first { -1.0 } else { 1.0 };
            (owner == robot).then(|| (link, pair.total_impulse() * (sign / PHYSICS_DT_S)))
        })
    }

    /// Pairs of a robot's own links that press on each other, with the force (N): empty in a clean pose.
    pub fn self_contacts(&self, robot: usize) -> Vec<(String, String, f32)> {
        let links = &self.robots[robot].model.links;
        let mut pairs = Vec::new();
        for (collider, link) in &self.robots[robot].colliders {
            for pair in self.physics.narrow_phase.contact_pairs_with(*collider) {
                if pair.collider1 != *collider {
                    continue;
                }
                let Some((owner, other)) = robot_and_link(self.physics.colliders[pair.collider2].user_data)
                else {
                    continue;
                };
                let force_n = pair.total_impulse_magnitude() / PHYSICS_DT_S;
                if owner == robot && force_n > 0.0 {
                    pairs.push((links[*link].name.clone(), links[other].name.clone(), force_n));
                }
            }
        }
        pairs
    }
}
