//! Tests at both sides of every threshold of BigTable.

use tandem_sim::Vector;

use crate::scoring::placement::sides::still_and_released;
use crate::scoring::{A, B, C, Facts};

conditions! { "big_table":
    lifted = 0 Done,
    carried = 1 Done,
    released = 2 Done,
}

fn over_goal(mut facts: Facts, beside_m: Vector) -> Facts {
    let disc_m = facts.position_m("goal_disc");
    facts.object_mut("round_table").pose_in_world.translation = disc_m + beside_m;
    facts
}

#[test]
fn lift_on_both_sides_of_3_cm_and_with_all_three() {
    let held_by = |robots: &[usize]| Facts::at_rest(&task()).held_by(robots, "round_table");
    assert!(lifted(&held_by(&[A, B, C]).raised("round_table", 0.0301)));
    assert!(!lifted(&held_by(&[A, B, C]).raised("round_table", 0.0299)));
    for two in [[A, B], [A, C], [B, C]] {
        assert!(!lifted(&held_by(&two).raised("round_table", 0.0301)), "{two:?}");
    }
    // The lowest point of the foot counts.
    assert!(!lifted(&held_by(&[A, B, C]).raised("round_table", 0.0301).turned(
        "round_table",
        Vector::X,
        0.02
    )));
}

#[test]
fn carry_on_both_sides_of_the_disc_and_of_1_cm() {
    let held = || Facts::at_rest(&task()).held_by(&[A, B, C], "round_table");
    for (beside_m, expected) in [
        (Vector::new(0.0, 0.0, 0.0101), true),
        (Vector::new(0.0, 0.0, 0.0099), false),
        (Vector::new(0.1499, 0.0, 0.05), true),
        (Vector::new(0.1501, 0.0, 0.05), false),
        (Vector::new(0.0, -0.1501, 0.05), false),
        (Vector::new(-0.105, 0.105, 0.05), true),
        (Vector::new(-0.107, 0.107, 0.05), false),
    ] {
        assert_eq!(carried(&over_goal(held(), beside_m)), expected, "{beside_m}");
    }
    let by_two = Facts::at_rest(&task()).held_by(&[A, C], "round_table");
    assert!(!carried(&over_goal(by_two, Vector::Z * 0.05)));
}

#[test]
fn release_on_both_sides_of_every_threshold() {
    let placed = |beside_m: Vector| over_goal(Facts::at_rest(&task()), beside_m);
    let tilted = |degrees: f32| placed(Vector::ZERO).turned("round_table", Vector::Y, degrees.to_radians());
    for (what, inside, outside) in [
        ("beside", placed(Vector::Y * 0.1499), placed(Vector::Y * 0.1501)),
        ("height", placed(Vector::Z * 0.0499), placed(Vector::Z * 0.0501)),
        ("depth", placed(Vector::Z * -0.0499), placed(Vector::Z * -0.0501)),
        ("tilt", tilted(14.9), tilted(15.1)),
    ]
    .into_iter()
    .chain(still_and_released(&placed(Vector::ZERO), "round_table"))
    {
        assert!(released(&inside), "{what} inside");
        assert!(!released(&outside), "{what} outside");
    }
}
