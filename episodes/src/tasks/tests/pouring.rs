//! Tests at both sides of every threshold of Pouring.

use tandem_sim::{Side::Right, Vector};

use crate::scoring::Grip::{Holding, Touching};
use crate::scoring::{A, B, Done, Facts};

conditions! { "pouring":
    both_aloft = 0 Done,
    tipped = 1 Done,
    marble_in_glass = 2 Lasting,
    glass_aloft = 2 AtEnd,
}

fn lifted(cup_m: f32, glass_m: f32) -> Facts {
    Facts::at_rest(&task()).raised("cup", cup_m).raised("glass", glass_m)
}

#[test]
fn both_vessels_on_both_sides_of_3_cm() {
    for (cup_m, glass_m, expected) in
        [(0.0301, 0.0301, true), (0.0299, 0.0301, false), (0.0301, 0.0299, false)]
    {
        assert_eq!(both_aloft(&lifted(cup_m, glass_m)), expected, "{cup_m} {glass_m}");
    }
}

#[test]
fn tip_on_both_sides_of_60_degrees() {
    let held = |grip, lift_m, degrees: f32| {
        let cup = lifted(lift_m, 0.1).grip(A, Right, "cup", grip);
        cup.turned("cup", Vector::X, degrees.to_radians())
    };
    for (facts, expected) in [
        (held(Holding, 0.1, 60.1), true),
        (held(Holding, 0.1, 59.9), false),
        (held(Touching, 0.1, 60.1), false),
        // Tipped onto its side, the cup is widest at its rim, which is then lower than its base was.
        (held(Holding, 0.06, 90.0), false),
        (held(Holding, 0.08, 90.0), true),
        (lifted(0.1, 0.1).grip(B, Right, "cup", Holding).turned("cup", Vector::X, 1.5), false),
    ] {
        assert_eq!(tipped(&facts), expected);
    }
}

#[test]
fn marble_on_both_sides_of_the_glass() {
    let marble = |offset_m: Vector| {
        let mut facts = lifted(0.1, 0.1);
        let glass = facts.object("glass").pose_in_world;
        facts.object_mut("marble").pose_in_world.translation = glass * offset_m;
        facts
    };
    for (offset_m, expected) in [
        (Vector::new(0.0, 0.0, 0.02), true),
        // The wall is closer to the axis at the bottom (29.6 mm) than at the flared mouth (46.5 mm).
        (Vector::new(0.0290, 0.0, 0.02), true),
        (Vector::new(0.0300, 0.0, 0.02), false),
        (Vector::new(0.0450, 0.0, 0.02), false),
        (Vector::new(0.0460, 0.0, 0.139), true),
        (Vector::new(0.0470, 0.0, 0.139), false),
        (Vector::new(0.0, 0.0, 0.145), true),
        (Vector::new(0.0, 0.0, 0.147), false),
        (Vector::new(0.0, 0.0, 0.009), true),
        (Vector::new(0.0, 0.0, -0.001), false),
    ] {
        assert_eq!(marble_in_glass(&marble(offset_m)), expected, "{offset_m}");
    }
}

#[test]
fn marble_stays_for_half_a_second_and_the_glass_is_up_on_both_sides_of_3_cm() {
    let Done::Lasting { for_s, at_end, .. } = &task().phases[2].done else { panic!("it has to last") };
    assert_eq!(*for_s, 0.5);
    assert!(at_end.is_some() && glass_aloft(&lifted(0.0, 0.0301)));
    assert!(!glass_aloft(&lifted(0.1, 0.0299)));
}
