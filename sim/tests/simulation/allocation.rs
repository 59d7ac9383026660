//! A step allocates nothing once its buffers have grown.

// Counting allocations requires a global allocator, whose trait is unsafe to implement.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use rapier3d::prelude::SharedShape;
use tandem_sim::dynamics::{
    Axis, Collider, DPose3, DVec3, Directions, Drive, Dynamics, Friction, Joint, Link, Mask, Mass, Settings,
    Tree,
};

thread_local! {
    /// Count of this thread alone: other tests run in parallel.
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
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
    left: 1.0,
};

fn scene() -> Dynamics {
    let mut dynamics = Dynamics::new(Settings::new(1.0 / 200.0, DVec3::new(0.0, 0.0, -9.81)));
    dynamics.add_collider(Collider {
        shape: SharedShape::cuboid(5.0, 5.0, 0.1),
        on: None,
        body_from_shape: DPose3::from_translation(DVec3::new(0.0, 0.0, -0.1)),
        friction: FRICTION,
        endless: false,
        tag: 0,
        touches: Mask::ALL,
    });
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
        let tree = dynamics.add_tree(Tree::new("tower", links).unwrap());
        for part in 0..2 {
            dynamics.add_collider(Collider {
                shape: SharedShape::cuboid(0.1, 0.1, 0.1),
                on: Some(tree.link(part)),
                body_from_shape: DPose3::IDENTITY,
                friction: FRICTION,
                endless: false,
                tag: 0,
                touches: Mask::ALL,
            });
        }
        let drive = Drive { target: 2.0, kp: 10.0, kd: 0.1, feedforward: 0.0 };
        dynamics.tree_mut(tree).drive(1, drive);
    }
    dynamics
}

#[test]
fn dynamics_allocates_nothing_after_the_first_steps() {
    let mut dynamics = scene();
    for _ in 0..100 {
        dynamics.step().unwrap();
    }
    for _ in 0..100 {
        let before = ALLOCATIONS.with(Cell::get);
        dynamics.step().unwrap();
        assert_eq!(ALLOCATIONS.with(Cell::get), before);
    }
    assert!(dynamics.touches().next().is_some());
}
