//! Tests at both sides of every threshold of CartService.

use tandem_sim::Side::{Left, Right};
use tandem_sim::Vector;

use crate::scoring::Grip::{Holding, Touching};
use crate::scoring::placement::sides::still_and_released;
use crate::scoring::{A, B, Facts};

conditions! { "cart_service":
    parked = 0 Done,
    bottle_lifted = 1 Done,
    carried_to_goal = 2 First,
    served = 2 Then,
    away_from_goal = 2 Broken,
}

fn bottle_at(beside_m: Vector) -> Facts {
    let mut facts = Facts::at_rest(&task());
    let patch_m = facts.position_m("serving_patch");
    facts.object_mut("bottle").pose_in_world.translation = patch_m + beside_m;
    facts
}

#[test]
fn park_on_both_sides_of_35_cm() {
    let trolley_at = |x_m: f32, y_m: f32| {
        let mut facts = Facts::at_rest(&task());
        facts.object_mut("service_trolley").pose_in_world.translation = Vector::new(x_m, y_m, 0.0);
        facts
    };
    assert!(parked(&trolley_at(0.0, 0.3499)));
    assert!(!parked(&trolley_at(0.0, 0.3501)));
    assert!(parked(&trolley_at(-0.24, -0.25)));
    assert!(!parked(&trolley_at(-0.25, -0.25)));
}

#[test]
fn bottle_is_lifted_by_b_on_both_sides_of_10_cm() {
    let held = |robot, side, lift_m| {
        Facts::at_rest(&task()).grip(robot, side, "bottle", Holding).raised("bottle", lift_m)
    };
    assert!(bottle_lifted(&held(B, Right, 0.1001)) && bottle_lifted(&held(B, Left, 0.1001)));
    assert!(!bottle_lifted(&held(B, Right, 0.0999)));
    assert!(!bottle_lifted(&held(A, Right, 0.1001)));
}

#[test]
fn bottle_is_carried_to_15_cm_by_b_and_is_away_beyond() {
    let held = |beside_m: Vector| bottle_at(beside_m).grip(B, Right, "bottle", Holding);
    for (beside_m, expected) in [
        (Vector::new(0.1499, 0.0, 0.2), true),
        (Vector::new(0.1501, 0.0, 0.2), false),
        (Vector::new(0.10, -0.11, 0.0), true),
        (Vector::new(0.11, -0.11, 0.0), false),
    ] {
        assert_eq!(carried_to_goal(&held(beside_m)), expected, "{beside_m}");
        assert_eq!(away_from_goal(&held(beside_m)), !expected, "{beside_m}");
        assert!(!carried_to_goal(&bottle_at(beside_m).grip(B, Right, "bottle", Touching)), "{beside_m}");
    }
}

#[test]
fn serve_on_both_sides_of_every_threshold() {
    let tilted = |degrees: f32| bottle_at(Vector::ZERO).turned("bottle", Vector::Y, degrees.to_radians());
    for (what, inside, outside) in [
        ("x", bottle_at(Vector::X * 0.0599), bottle_at(Vector::X * 0.0601)),
        ("-x", bottle_at(Vector::X * -0.0599), bottle_at(Vector::X * -0.0601)),
        ("y", bottle_at(Vector::Y * 0.0599), bottle_at(Vector::Y * 0.0601)),
        ("-y", bottle_at(Vector::Y * -0.0599), bottle_at(Vector::Y * -0.0601)),
        ("-z", bottle_at(Vector::Z * -0.0599), bottle_at(Vector::Z * -0.0601)),
        ("z", bottle_at(Vector::Z * 0.0599), bottle_at(Vector::Z * 0.0601)),
        ("tilt", tilted(14.9), tilted(15.1)),
    ]
    .into_iter()
    .chain(still_and_released(&bottle_at(Vector::ZERO), "bottle"))
    {
        assert!(served(&inside), "{what} inside");
        assert!(!served(&outside), "{what} outside");
    }
}
