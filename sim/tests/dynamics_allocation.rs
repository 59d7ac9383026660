//! A step allocates nothing once its buffers have grown, beside what Rapier does to detect collisions.

// Counting allocations takes a global allocator, whose trait is unsafe to implement.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use rapier3d::math::Vector;
use rapier3d::prelude::{ColliderBuilder, PhysicsWorld};
use tandem_sim::dynamics::{
    Axis, DPose3, DVec3, Directions, Drive, Dynamics, Friction, Joint, Link, Mass, Settings, Tree,
};

struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const FRICTION: Friction = Friction {
    directions: Directions::SlideSpinRoll,
    slide: 0.6,
    spin_m: 0.005,
    roll_m: 0.0001,
    priority: 0,
};

fn scene() -> (Dynamics, PhysicsWorld) {
    let mut physics = PhysicsWorld::new();
    let mut dynamics = Dynamics::new(Settings::new(1.0 / 200.0, DVec3::new(0.0, 0.0, -9.81)));
    let slab = ColliderBuilder::cuboid(5.0, 5.0, 0.1).translation(Vector::new(0.0, 0.0, -0.1));
    dynamics.add_collider(slab, None, FRICTION, &mut physics);
    for tower in 0..3 {
        let mut axis = Axis::along(DVec3::Y);
        (axis.friction_loss, axis.range, axis.effort_limit) = (0.1, Some([-0.5, 0.5]), 2.0);
        let at = DPose3::from_translation(DVec3::new(f64::from(tower), 0.0, 0.1));
        let mass = Mass::of_box(1.0, DVec3::splat(0.1));
        let link = |parent, parent_from_link, joint| Link {
            name: "part".into(),
            parent,
            parent_from_link,
            joint,
            mass,
        };
        let above = DPose3::from_translation(DVec3::new(0.0, 0.0, 0.25));
        let links = vec![link(None, at, Joint::Free), link(Some(0), above, Joint::Hinge(axis))];
        let tree = dynamics.add_tree(Tree::new("tower", links).unwrap(), &mut physics);
        for part in 0..2 {
            dynamics.add_collider(
                ColliderBuilder::cuboid(0.1, 0.1, 0.1),
                Some(tree.link(part)),
                FRICTION,
                &mut physics,
            );
        }
        let drive = Drive { target: 2.0, kp: 10.0, kd: 0.1, feedforward: 0.0 };
        dynamics.tree_mut(tree).drive(1, drive);
    }
    (dynamics, physics)
}

#[test]
fn dynamics_allocates_nothing_after_the_first_steps() {
    let (mut dynamics, mut physics) = scene();
    for _ in 0..100 {
        dynamics.step(&mut physics, &()).unwrap();
    }
    for _ in 0..100 {
        dynamics.detect_collisions(&mut physics, &());
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        dynamics.advance(&physics.narrow_phase).unwrap();
        assert_eq!(ALLOCATIONS.load(Ordering::Relaxed), before);
        dynamics.place_bodies(&mut physics);
    }
    assert!(!dynamics.touches().is_empty());
}
