//! Round bodies that rock on a rim and roll.

use rapier3d::glamx::{DMat3, DPose3, DQuat, DVec3};
use rapier3d::prelude::SharedShape;

use super::super::{Collider, Directions, Friction, Mask, Mass, TreeId};
use super::bench::{Bench, DOWN, lone, sliding};

const RADIUS_M: f64 = 0.035;
const HALF_HEIGHT_M: f64 = 0.1;
const STILL_RAD_S: f64 = 0.01;

/// Builds a bottle as in `sim/assets/objects/bottle.xml`, on its rim.
fn bottle(bench: &mut Bench, tilt: DVec3, spin_rad_s: DVec3, friction: Friction) -> TreeId {
    let mass = Mass {
        mass_kg: 0.5,
        com_m: DVec3::new(0.0, 0.0, 0.105),
        inertia_kg_m2: DMat3::from_diagonal(DVec3::new(0.0031, 0.0031, 0.0004)),
    };
    let at = DPose3::from_parts(DVec3::Z * RADIUS_M * tilt.length().sin(), DQuat::from_scaled_axis(tilt));
    let tree = bench.add(lone("bottle", at, mass));
    let lie = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    bench.dynamics.add_collider(Collider {
        shape: SharedShape::cylinder(HALF_HEIGHT_M as f32, RADIUS_M as f32),
        on: Some(tree.link(0)),
        body_from_shape: DPose3::from_parts(DVec3::Z * HALF_HEIGHT_M, lie),
        friction,
        endless: false,
        tag: 0,
        touches: Mask::ALL,
    });
    bench.dynamics.tree_mut(tree).set_base(at, DVec3::ZERO, spin_rad_s);
    tree
}

/// Tilt (degrees), heading of the tilt axis in the floor plane, spin about the vertical, and spin across that
/// axis.
const ROCKS: [[f64; 4]; 8] = [
    [1.0, 0.3, 0.0, 0.6],
    [2.0, 0.0, 0.0, 0.6],
    [2.0, 0.3, 0.0, 1.6],
    [4.0, 0.0, 0.0, 0.0],
    [4.0, 0.3, 2.0, 0.0],
    [6.0, 0.7, -3.4, 0.0],
    [8.0, 0.0, 0.0, 0.0],
    [8.0, 0.3, 0.0, 0.0],
];

fn rocking(
    [tilt_deg, heading_rad, spin_rad_s, across_rad_s]: [f64; 4],
    friction: Friction,
) -> (Bench, TreeId) {
    let mut bench = Bench::with_floor(DOWN, sliding(0.4));
    let (sin, cos) = heading_rad.sin_cos();
    let tilt = DVec3::new(cos, sin, 0.0) * tilt_deg.to_radians();
    let spin = DVec3::new(-sin * across_rad_s, cos * across_rad_s, spin_rad_s);
    let tree = bottle(&mut bench, tilt, spin, friction);
    (bench, tree)
}

/// A bottle released on its rim gains no energy, in whichever direction it turns.
#[test]
fn dynamics_bottle_that_whirls_on_its_rim_gains_nothing() {
    for rock in ROCKS {
        let (mut bench, tree) = rocking(rock, sliding(0.4));
        let start_j = bench.energy_j(tree);
        let mut least_j = start_j;
        for step in 0..1600 {
            bench.step();
            let now_j = bench.energy_j(tree);
            // 1 mJ lifts it by 0.2 mm; correcting penetration does less.
            assert!(now_j < least_j + 1e-3, "{rock:?}: {now_j} J after {least_j} J in step {step}");
            least_j = least_j.min(now_j);
        }
    }
}

/// With the friction of its file the bottle comes to rest upright from every orientation.
#[test]
fn dynamics_bottle_on_its_rim_comes_to_rest() {
    let friction = Friction {
        directions: Directions::SlideSpinRoll,
        slide: 0.4,
        spin_m: 0.00001,
        roll_m: 0.0003,
        priority: 0,
        left: 1.0,
    };
    for rock in ROCKS {
        let (mut bench, tree) = rocking(rock, friction);
        bench.run_s(15.0);
        let bottle = bench.dynamics.tree(tree);
        let up = bottle.world_from_link(0).rotation * DVec3::Z;
        assert!(up.z > 0.99999, "{rock:?}: {up}");
        assert!(bottle.link_spin_rad_s(0).length() < STILL_RAD_S, "{rock:?}: {}", bottle.link_spin_rad_s(0));
    }
}

/// A cylinder that rolls slowly on its side does not accelerate.
#[test]
fn dynamics_cylinder_that_rolls_slowly_does_not_speed_up() {
    let speed_m_s = 0.05;
    let about_axis = 0.5 * 0.5 * RADIUS_M * RADIUS_M;
    for shape in [SharedShape::cylinder(0.1, 0.035), SharedShape::cylinder(0.02, 0.035)] {
        let mut bench = Bench::with_floor(DOWN, sliding(0.4));
        let mass = Mass {
            mass_kg: 0.5,
            com_m: DVec3::ZERO,
            inertia_kg_m2: DMat3::from_diagonal(DVec3::new(0.0031, about_axis, 0.0031)),
        };
        let at = DPose3::from_translation(DVec3::Z * RADIUS_M);
        let tree = bench.add(lone("cylinder", at, mass));
        bench.add_shape(tree.link(0), shape, sliding(0.4));
        bench.dynamics.tree_mut(tree).set_base(at, DVec3::X * speed_m_s, DVec3::Y * speed_m_s / RADIUS_M);
        bench.run_s(0.1);
        for step in 0..1600 {
            bench.step();
            let now_m_s = bench.dynamics.tree(tree).link_velocity_m_s(0).length();
            assert!(now_m_s < 1.1 * speed_m_s, "{now_m_s} m/s in step {step}");
        }
    }
}
