//! Tests at both sides of every threshold of TrashCollection.

use tandem_sim::Side::{Left, Right};
use tandem_sim::Vector;

use crate::scoring::Grip::Touching;
use crate::scoring::{A, B, Facts};

conditions! { "trash_collection":
    lifted = 0 Done,
    delivered = 1 Done,
    swept = 2 Done,
}

fn held() -> Facts {
    Facts::at_rest(&task()).held_by(&[A], "bin")
}

/// Places the bin in A's hands, offset by `beside_m` from the carry point and with its base at `base_m`.
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
    assert!(!lifted(&Facts::at_rest(&task()).held_by(&[B], "bin").raised("bin", 0.0201)));
    let touched = held().grip(A, Left, "bin", Touching).grip(A, Right, "bin", Touching);
    assert!(!lifted(&touched.raised("bin", 0.0201)));
    // The lowest point counts: at a tilt of 5 degrees, it is on a long side, 85 mm from the middle.
    let leaning = |lift_m: f32| held().raised("bin", lift_m).turned("bin", Vector::X, 5_f32.to_radians());
    assert!(lifted(&leaning(0.0276)));
    assert!(!lifted(&leaning(0.0272)));
}

#[test]
fn deliver_on_both_sides_of_every_threshold() {
    for (beside_m, base_m, expected) in [
        (Vector::ZERO, 0.0201, true),
        (Vector::ZERO, 0.0199, false),
        // The bin is 0.721 m tall, and the bench is 0.80 m high.
        (Vector::ZERO, 0.0888, true),
        (Vector::ZERO, 0.0892, false),
        (Vector::X * 0.2499, 0.06, true),
        (Vector::X * 0.2501, 0.06, false),
        (Vector::new(0.17, 0.18, 0.0), 0.06, true),
        (Vector::new(-0.18, 0.18, 0.0), 0.06, false),
    ] {
        assert_eq!(delivered(&held_at(beside_m, base_m)), expected, "{beside_m} {base_m}");
    }
    // The highest point of the rim counts. At a tilt of 5 degrees, it is on a long side: 0.715 m up, 82 mm
    // from the middle, on a rim 6 mm thick.
    for degrees in [5_f32, -5.0] {
        let leaning =
            |base_m: f32| held_at(Vector::ZERO, base_m).turned("bin", Vector::X, degrees.to_radians());
        assert!(delivered(&leaning(0.0844)), "{degrees}");
        assert!(!delivered(&leaning(0.0848)), "{degrees}");
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
