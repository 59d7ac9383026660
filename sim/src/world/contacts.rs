//! Contacts of hands with objects, and of a robot with itself.

use std::collections::{BTreeMap, BTreeSet};

use rapier3d::math::Vector;

use super::World;
use super::step::{BodyTouch, HandContacts, Touch};
use crate::body::HandLinks;
use crate::dynamics::{ColliderId, ContactPoint};
use crate::owner::Owner;
use crate::{PHYSICS_DT_S, Side, Sides};

/// A point at which a link presses on an object, with the normal force on the object (N, world).
struct Press {
    object: usize,
    robot: usize,
    link: usize,
    force_n: Vector,
}

/// A point at which a robot pressed on another body.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotPress {
    /// The robot's link.
    pub link: String,
    /// The object or the other robot; `None` for the room.
    pub on: Option<String>,
    /// Position in the world frame.
    pub at_m: Vector,
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
    /// Returns all hands that touch an object, in the order of the objects.
    pub(super) fn touches(&self) -> Vec<Touch> {
        let mut found: BTreeMap<(usize, usize), Sides<HandContacts>> = BTreeMap::new();
        for Press { object, robot, link, force_n } in self.presses_on_objects() {
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

    /// Returns all robots that touch an object, in the order of the objects.
    pub(super) fn body_touches(&self) -> Vec<BodyTouch> {
        let touch = |press: Press| BodyTouch { object: press.object, robot: press.robot };
        let found: BTreeSet<BodyTouch> = self.presses_on_objects().map(touch).collect();
        found.into_iter().collect()
    }

    /// Returns the points at which robots pressed on objects in the last step.
    fn presses_on_objects(&self) -> impl Iterator<Item = Press> {
        self.presses().filter_map(|(owners, force_n)| match owners {
            [Some(Owner::Link { robot, link }), Some(Owner::Object(object))] => {
                Some(Press { object, robot, link, force_n })
            }
            [Some(Owner::Object(object)), Some(Owner::Link { robot, link })] => {
                Some(Press { object, robot, link, force_n: -force_n })
            }
            _ => None,
        })
    }

    /// Returns the contact points with a force in the last step: the owners of both colliders, and the normal
    /// force on the second collider (N, world).
    fn presses(&self) -> impl Iterator<Item = ([Option<Owner>; 2], Vector)> {
        let owner = |id: ColliderId| Owner::of_tag(self.dynamics.collider(id).tag);
        self.dynamics.touches().filter(|touch| touch.normal_impulse_n_s > 0.0).map(move |touch| {
            let force_n = touch.normal * (touch.normal_impulse_n_s / f64::from(PHYSICS_DT_S));
            (touch.colliders.map(owner), force_n.as_vec3())
        })
    }

    /// Returns the points at which a robot's links pressed on other bodies in the last step.
    pub fn presses_of(&self, robot: usize) -> Vec<RobotPress> {
        let owner = |id: ColliderId| Owner::of_tag(self.dynamics.collider(id).tag);
        let press = |touch: &ContactPoint| {
            let [one, other] = touch.colliders.map(owner);
            let (link, on) = match (one, other) {
                (Some(Owner::Link { robot: found, link }), on) if found == robot => (link, on),
                (on, Some(Owner::Link { robot: found, link })) if found == robot => (link, on),
                _ => return None,
            };
            let on = match on {
                Some(Owner::Link { robot: other, .. }) if other == robot => return None,
                Some(Owner::Link { robot: other, .. }) => Some(self.robots[other].name.clone()),
                Some(Owner::Object(object)) => Some(self.objects[object].name.clone()),
                None => None,
            };
            let link = self.robots[robot].model.links[link].name.clone();
            Some(RobotPress { link, on, at_m: touch.point_m.as_vec3() })
        };
        let pressed = self.dynamics.touches().filter(|touch| touch.normal_impulse_n_s > 0.0);
        pressed.filter_map(press).collect()
    }

    /// Returns pairs of a robot's own links that press on each other, with the force (N).
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
