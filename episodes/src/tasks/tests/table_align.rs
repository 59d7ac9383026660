//! Tests at both sides of every threshold of TableAlign.

use std::f32::consts::FRAC_PI_2;

use tandem_sim::{Pose, Rotation, Side::Left, Vector};

use crate::scoring::Grip::Touching;
use crate::scoring::ObjectFacts;
use crate::scoring::placement::sides::still_and_released;
use crate::scoring::{A, B, Facts};

conditions! { "table_align":
    lifted = 0 Done,
    carried = 1 Done,
    aligned = 2 Done,
}

fn held() -> Facts {
    Facts::at_rest(&task()).held_by(&[A, B], "office_table")
}

/// Places the table `before_m` in front of the chair and `across_m` to its side, rotated by `degrees`
/// from square.
fn placed(before_m: f32, across_m: f32, degrees: f32) -> Facts {
    let mut facts = Facts::at_rest(&task());
    let turn = Rotation::from_rotation_z(FRAC_PI_2 + degrees.to_radians());
    let chair = facts.object("office_chair").pose_in_world;
    facts.object_mut("office_table").pose_in_world =
        chair * Pose::from_parts(Vector::new(before_m, across_m, 0.0), turn);
    facts
}

#[test]
fn lift_on_both_sides_of_3_cm_and_with_both_robots() {
    assert!(lifted(&held().raised("office_table", 0.0301)));
    assert!(!lifted(&held().raised("office_table", 0.0299)));
    let by_b_alone = Facts::at_rest(&task()).held_by(&[B], "office_table");
    assert!(!lifted(&by_b_alone.raised("office_table", 0.0301)));
    let by_a_alone = held().held_by(&[A], "office_table").grip(B, Left, "office_table", Touching);
    assert!(lifted(&by_a_alone.raised("office_table", 0.0301)), "one hand is enough");
}

#[test]
fn carry_on_both_sides_of_the_patch_and_of_1_cm() {
    let at = |x_m: f32, y_m: f32, z_m: f32| {
        let mut facts = held();
        let patch_m = facts.position_m("table_patch");
        facts.object_mut("office_table").pose_in_world.translation = patch_m + Vector::new(x_m, y_m, z_m);
        facts
    };
    for (position_m, expected) in [
        ([0.0, 0.0, 0.0101], true),
        ([0.0, 0.0, 0.0099], false),
        ([0.1999, -0.1999, 0.05], true),
        ([0.2001, 0.0, 0.05], false),
        ([-0.2001, 0.0, 0.05], false),
        ([0.0, 0.2001, 0.05], false),
        ([0.0, -0.2001, 0.05], false),
    ] {
        let [x_m, y_m, z_m] = position_m;
        assert_eq!(carried(&at(x_m, y_m, z_m)), expected, "{position_m:?}");
    }
    // The tilt lowers one of the foot bars.
    assert!(!carried(&at(0.0, 0.0, 0.0101).turned("office_table", Vector::Y, 0.01)));
}

#[test]
fn align_on_both_sides_of_every_threshold() {
    let changed = |change: &dyn Fn(&mut ObjectFacts)| {
        let mut facts = placed(0.40, 0.0, 0.0);
        change(facts.object_mut("office_table"));
        facts
    };
    let tilted = |degrees: f32| {
        let turn = Rotation::from_rotation_x(degrees.to_radians());
        changed(&|table| table.pose_in_world.rotation *= turn)
    };
    for (what, inside, outside) in [
        ("near", placed(0.3351, 0.0, 0.0), placed(0.3349, 0.0, 0.0)),
        ("far", placed(0.4649, 0.0, 0.0), placed(0.4651, 0.0, 0.0)),
        ("left", placed(0.40, 0.1299, 0.0), placed(0.40, 0.1301, 0.0)),
        ("right", placed(0.40, -0.1299, 0.0), placed(0.40, -0.1301, 0.0)),
        ("turned left", placed(0.40, 0.0, 3.9), placed(0.40, 0.0, 4.1)),
        ("turned right", placed(0.40, 0.0, -3.9), placed(0.40, 0.0, -4.1)),
        ("half a turn", placed(0.40, 0.0, 180.0), placed(0.40, 0.0, 90.0)),
        (
            "height",
            placed(0.40, 0.0, 0.0).raised("office_table", 0.0399),
            placed(0.40, 0.0, 0.0).raised("office_table", 0.0401),
        ),
        (
            "depth",
            placed(0.40, 0.0, 0.0).raised("office_table", -0.0399),
            placed(0.40, 0.0, 0.0).raised("office_table", -0.0401),
        ),
        ("tilt", tilted(14.9), tilted(15.1)),
    ]
    .into_iter()
    .chain(still_and_released(&placed(0.40, 0.0, 0.0), "office_table"))
    {
        assert!(aligned(&inside), "{what} inside");
        assert!(!aligned(&outside), "{what} outside");
    }
}
