//! Tests at both sides of every threshold of CoCarry.

use tandem_sim::Side::{Left, Right};
use tandem_sim::Vector;

use crate::scoring::Grip::{Holding, Touching};
use crate::scoring::placement::sides::still_and_released;
use crate::scoring::{A, B, Facts};

conditions! { "co_carry":
    lifted = 0 Done,
    carried = 1 Done,
    released = 2 Done,
}

fn held() -> Facts {
    Facts::at_rest(&task()).grip(A, Left, "basket", Holding).grip(B, Right, "basket", Holding)
}

/// Places the basket's base on the patch, offset by `beside_m` from its middle.
fn at_patch(mut facts: Facts, beside_m: Vector) -> Facts {
    let patch_m = facts.position_m("basket_patch");
    facts.object_mut("basket").pose_in_world.translation = patch_m + beside_m;
    facts
}

#[test]
fn lift_on_both_sides_of_3_cm_and_with_both_robots() {
    assert!(lifted(&held().raised("basket", 0.0301)));
    assert!(!lifted(&held().raised("basket", 0.0299)));
    assert!(!lifted(&held().grip(A, Left, "basket", Touching).raised("basket", 0.0301)));
    assert!(!lifted(&held().grip(B, Right, "basket", Touching).raised("basket", 0.0301)));
    // The lowest point of the base counts.
    assert!(!lifted(&held().raised("basket", 0.0301).turned("basket", Vector::Y, 0.02)));
}

#[test]
fn carry_on_both_sides_of_every_bound() {
    let carried_at = |x_m, y_m, z_m| carried(&at_patch(held(), Vector::new(x_m, y_m, z_m)));
    for (position_m, expected) in [
        ([0.0, 0.0, 0.0101], true),
        ([0.0, 0.0, 0.0099], false),
        ([0.1499, 0.1499, 0.1], true),
        ([0.1501, 0.0, 0.1], false),
        ([-0.1501, 0.0, 0.1], false),
        ([0.0, 0.1501, 0.1], false),
        ([0.0, -0.1501, 0.1], false),
    ] {
        let [x_m, y_m, z_m] = position_m;
        assert_eq!(carried_at(x_m, y_m, z_m), expected, "{position_m:?}");
    }
    assert!(!carried(&at_patch(held().grip(B, Right, "basket", Touching), Vector::Z * 0.1)));
}

#[test]
fn release_on_both_sides_of_every_threshold() {
    let placed = |beside_m: Vector| at_patch(Facts::at_rest(&task()), beside_m);
    let tilted = |degrees: f32| placed(Vector::ZERO).turned("basket", Vector::Y, degrees.to_radians());
    for (what, inside, outside) in [
        ("x", placed(Vector::X * 0.1499), placed(Vector::X * 0.1501)),
        ("-x", placed(Vector::X * -0.1499), placed(Vector::X * -0.1501)),
        ("y", placed(Vector::Y * 0.1499), placed(Vector::Y * 0.1501)),
        ("-y", placed(Vector::Y * -0.1499), placed(Vector::Y * -0.1501)),
        ("height", placed(Vector::Z * 0.0599), placed(Vector::Z * 0.0601)),
        ("depth", placed(Vector::Z * -0.0599), placed(Vector::Z * -0.0601)),
        ("tilt", tilted(14.9), tilted(15.1)),
    ]
    .into_iter()
    .chain(still_and_released(&placed(Vector::ZERO), "basket"))
    {
        assert!(released(&inside), "{what} inside");
        assert!(!released(&outside), "{what} outside");
    }
}
