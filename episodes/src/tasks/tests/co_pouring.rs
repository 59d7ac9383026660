//! Tests at both sides of every threshold of CoPouring.

use tandem_sim::Side::{Left, Right};
use tandem_sim::Vector;

use crate::scoring::Grip::{Holding, Touching};
use crate::scoring::{A, B, Facts};

const APPLES: [&str; 6] = ["apple_1", "apple_2", "apple_3", "apple_4", "apple_5", "apple_6"];

conditions! { "co_pouring":
    lifted = 0 Done,
    tipped = 1 Done,
    poured = 2 Done,
}

fn held() -> Facts {
    Facts::at_rest(&task()).grip(A, Left, "tub", Holding).grip(B, Right, "tub", Holding)
}

#[test]
fn lift_on_both_sides_of_3_cm_and_with_both_robots() {
    assert!(lifted(&held().raised("tub", 0.0301)));
    assert!(!lifted(&held().raised("tub", 0.0299)));
    assert!(!lifted(&held().grip(A, Left, "tub", Touching).raised("tub", 0.0301)));
    assert!(!lifted(&held().grip(B, Right, "tub", Touching).raised("tub", 0.0301)));
    // The lowest point counts: here an end of the tub, 88 mm from its middle.
    let tilted = |lift_m: f32| held().raised("tub", lift_m).turned("tub", Vector::X, 0.02);
    assert!(lifted(&tilted(0.0319)));
    assert!(!lifted(&tilted(0.0316)));
}

#[test]
fn tip_on_both_sides_of_25_degrees() {
    let turned = |degrees: f32| held().turned("tub", Vector::X, degrees.to_radians());
    assert!(tipped(&turned(-25.1)));
    assert!(!tipped(&turned(-24.9)));
    assert!(!tipped(&turned(-25.1).grip(A, Left, "tub", Touching)));
}

#[test]
fn every_apple_has_to_be_in_the_crate() {
    let with_last_at = |offset_m: Vector| {
        let mut facts = held();
        let crate_in_world = facts.object("crate").pose_in_world;
        for apple in APPLES {
            facts.object_mut(apple).pose_in_world.translation = crate_in_world * Vector::new(0.0, 0.0, 0.05);
        }
        facts.object_mut(APPLES[5]).pose_in_world.translation = crate_in_world * offset_m;
        facts
    };
    for (offset_m, expected) in [
        (Vector::new(0.227, 0.0, 0.05), true),
        (Vector::new(0.229, 0.0, 0.05), false),
        (Vector::new(0.0, -0.167, 0.05), true),
        (Vector::new(0.0, -0.169, 0.05), false),
        (Vector::new(0.0, 0.0, 0.189), true),
        (Vector::new(0.0, 0.0, 0.191), false),
        (Vector::new(-0.227, 0.0, 0.05), true),
        (Vector::new(-0.229, 0.0, 0.05), false),
        (Vector::new(0.0, 0.167, 0.05), true),
        (Vector::new(0.0, 0.169, 0.05), false),
        (Vector::new(0.0, 0.0, 0.001), true),
        (Vector::new(0.0, 0.0, -0.001), false),
    ] {
        assert_eq!(poured(&with_last_at(offset_m)), expected, "{offset_m}");
    }
    assert!(!poured(&with_last_at(Vector::new(0.0, 0.0, 0.05)).grip(B, Right, "tub", Touching)));
}
