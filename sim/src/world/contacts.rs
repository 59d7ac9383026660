//! Which colliders may touch, and what a hand feels of an object.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rapier3d::math::Vector;
use rapier3d::prelude::{ColliderHandle, PairFilterContext, PhysicsHooks, SolverFlags};

use super::World;
use super::step::{HandContacts, Touch};
use crate::body::{HandLinks, RobotModel};
use crate::owner::Owner;
use crate::{PHYSICS_DT_S, Side, Sides};

/// Leaves out the contacts inside a robot, and between the objects of a scene, that their files exclude.
pub(super) struct Exclusions {
    /// `None` while there is no robot.
    pub model: Option<Arc<RobotModel>>,
    /// Smaller index first.
    pub objects: BTreeSet<(usize, usize)>,
}

impl PhysicsHooks for Exclusions {
    fn filter_contact_pair(&self, pair: &PairFilterContext) -> Option<SolverFlags> {
        let [first, second] =
            [pair.collider1, pair.collider2].map(|handle| Owner::of_tag(pair.colliders[handle].user_data));
        let apart = match (first, second) {
            (Some(Owner::Link { robot: a, link: link_a }), Some(Owner::Link { robot: b, link: link_b })) => {
                a == b && self.model.as_ref().is_some_and(|model| !model.may_touch(link_a, link_b))
            }
            (Some(Owner::Object(a)), Some(Owner::Object(b))) => self.objects.contains(&(a.min(b), a.max(b))),
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
    /// All hands that touch an object, in the order of the objects.
    pub(super) fn touches(&self) -> Vec<Touch> {
        let mut found: BTreeMap<(usize, usize), Sides<HandContacts>> = BTreeMap::new();
        for (owners, force_n) in self.presses() {
            let (object, robot, link, force_n) = match owners {
                [Some(Owner::Link { robot, link }), Some(Owner::Object(object))] => {
                    (object, robot, link, force_n)
                }
                [Some(Owner::Object(object)), Some(Owner::Link { robot, link })] => {
                    (object, robot, link, -force_n)
                }
                _ => continue,
            };
            let hands = found.entry((object, robot)).or_default();
            for side in Side::BOTH {
                hands[side].add(&self.robots[robot].model.hands[side], link, force_n);
            }
        }
        let by_hand = found.into_iter().flat_map(|((object, robot), hands)| {
            let touch = move |(side, contacts)| Touch { robot, side, object, contacts };
            Side::BOTH.into_iter().zip(hands).map(touch)
        });
        by_hand.filter(|touch| touch.contacts != HandContacts::default()).collect()
    }

    /// Points that pressed in the last step: whose colliders they are between, and the normal force on the second (N, world).
    fn presses(&self) -> impl Iterator<Item = ([Option<Owner>; 2], Vector)> {
        let owner = |handle: ColliderHandle| Owner::of_tag(self.physics.colliders[handle].user_data);
        self.dynamics.touches().iter().filter(|touch| touch.normal_impulse_n_s > 0.0).map(move |touch| {
            let force_n = touch.normal * (touch.normal_impulse_n_s / f64::from(PHYSICS_DT_S));
            (touch.colliders.map(owner), force_n.as_vec3())
        })
    }

    /// Pairs of a robot's own links that press on each other, with the force (N): empty in a clean pose.
    pub fn self_contacts(&self, robot: usize) -> Vec<(String, String, f32)> {
        let mut forces_n: BTreeMap<(usize, usize), f32> = BTreeMap::new();
        for (owners, force_n) in self.presses() {
            if let [Some(Owner::Link { robot: a, link: first }), Some(Owner::Link { robot: b, link: second })] =
                owners
                && (a, b) == (robot, robot)
            {
                *forces_n.entry((first.min(second), first.max(second))).or_default() += force_n.length();
            }
        }
        let name = |link: usize| self.robots[robot].model.links[link].name.clone();
        forces_n.into_iter().map(|((a, b), force_n)| (name(a), name(b), force_n)).collect()
    }
}
