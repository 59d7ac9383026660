//! Which colliders may touch, and what a hand feels of an object.

use std::sync::Arc;

use rapier3d::math::Vector;
use rapier3d::prelude::*;

use super::World;
use super::step::{HandContacts, Touch};
use crate::body::{HandLinks, RobotModel};
use crate::robot::robot_and_link;
use crate::{PHYSICS_DT_S, Side, Sides};

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

impl HandContacts {
    /// Adds the force of one of the robot's links, if it belongs to `hand`.
    fn add(&mut self, hand: &HandLinks, link: usize, force_n: Vector) {
        if hand.thumb.contains(&link) {
            self.thumb_n += force_n;
        } else if hand.fingers.contains(&link) {
            self.fingers_n += force_n;
        } else if link == hand.wrist {
            self.palm_n += force_n;
        }
    }
}

impl World {
    /// All hands that touch an object.
    pub(super) fn touches(&self) -> Vec<Touch> {
        let mut touches = Vec::new();
        for (object, colliders) in self.objects.iter().map(|object| &object.colliders).enumerate() {
            let mut hands = vec![Sides::<HandContacts>::default(); self.robots.len()];
            for (robot, link, force_n) in colliders.iter().flat_map(|collider| self.link_forces(*collider)) {
                for side in Side::BOTH {
                    hands[robot][side].add(&self.robots[robot].model.hands[side], link, force_n);
                }
            }
            for (robot, hands) in hands.into_iter().enumerate() {
                for (side, contacts) in Side::BOTH.into_iter().zip(hands) {
                    if contacts != HandContacts::default() {
                        touches.push(Touch { robot, side, object, contacts });
                    }
                }
            }
        }
        touches
    }

    /// Links of robots that press on a collider: robot, link, and the normal force on the collider (N, world).
    fn link_forces(&self, collider: ColliderHandle) -> impl Iterator<Item = (usize, usize, Vector)> {
        self.physics.narrow_phase.contact_pairs_with(collider).filter_map(move |pair| {
            let first = pair.collider1 == collider;
            let other = if first { pair.collider2 } else { pair.collider1 };
            let (robot, link) = robot_and_link(self.physics.colliders[other].user_data)?;
            let sign = if first { -1.0 } else { 1.0 };
            Some((robot, link, pair.total_impulse() * (sign / PHYSICS_DT_S)))
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
