//! Both sides of every threshold of TrashCollection.

use tandem_sim::Side::{Left, Right};
use tandem_sim::Vector;

use super::*;
use crate::scoring::B;
use crate::scoring::Grip::Touching;

fn held() -> Facts {
    Facts::at_rest(&TASK).held_by(&[A], "bin")
}

/// A holds the bin, its base at `base_m`, `beside_m` off the carry point.
fn held_at(beside_m: Vector, base_m: f32) -> Facts {
    let mut facts = held();
    let point_m = facts.position_m("carry_point");
    facts.object_mut("bin").pose_in_world.translation = point_m + beside_m + Vector::Z * base_m;
    facts
}

#[test]
fn lift_on_both_sides_of_2_cm_and_by_a() {
    assert!(lifted(&held().raised("bin", 0.0201)));
    assert!(!lifted(&held().raised("bin", 0.0199)));
    assert!(!lifted(&Facts::at_rest(&TASK).held_by(&[B], "bin").raised("bin", 0.0201)));
    let touched = held().grip(A, Left, "bin", Touching).grip(A, Right, "bin", Touching);
    assert!(!lifted(&touched.raised("bin", 0.0201)));
}

#[test]
fn deliver_on_both_sides_of_every_threshold() {
    for (beside_m, base_m, expected) in [
        (Vector::ZERO, 0.0201, true),
        (Vector::ZERO, 0.0199, false),
        // The bin is 0.72 m tall, the bench 0.80 m.
        (Vector::ZERO, 0.0899, true),
        (Vector::ZERO, 0.0903, false),
        (Vector::X * 0.2499, 0.06, true),
        (Vector::X * 0.2501, 0.06, false),
        (Vector::new(0.17, 0.18, 0.0), 0.06, true),
        (Vector::new(-0.18, 0.18, 0.0), 0.06, false),
    ] {
        assert_eq!(delivered(&held_at(beside_m, base_m)), expected, "{beside_m} {base_m}");
    }
}

#[test]
fn the_bottle_is_between_the_walls_of_the_bin_that_a_holds() {
    let with_bottle_at = |in_bin_m: Vector| {
        let mut facts = held_at(Vector::ZERO, 0.06);
        let bottle_m = facts.point_m("bin", in_bin_m);
        facts.object_mut("pet_bottle").pose_in_world.translation = bottle_m;
        facts
    };
    for (in_bin_m, expected) in [
        (Vector::new(0.0, 0.0, 0.1), true),
        (Vector::new(0.143, 0.0, 0.1), true),
        (Vector::new(0.145, 0.0, 0.1), false),
        (Vector::new(0.0, -0.078, 0.1), true),
        (Vector::new(0.0, -0.080, 0.1), false),
        (Vector::new(0.0, 0.0, 0.719), true),
        (Vector::new(0.0, 0.0, 0.721), false),
        (Vector::new(0.0, 0.0, 0.001), true),
        (Vector::new(0.0, 0.0, -0.001), false),
    ] {
        assert_eq!(swept(&with_bottle_at(in_bin_m)), expected, "{in_bin_m}");
    }
    let dropped =
        with_bottle_at(Vector::Z * 0.1).grip(A, Left, "bin", Touching).grip(A, Right, "bin", Touching);
    assert!(!swept(&dropped));
}
