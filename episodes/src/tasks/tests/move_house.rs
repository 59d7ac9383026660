//! Tests at both sides of every threshold of MoveHouse.

use tandem_sim::Side::{Left, Right};
use tandem_sim::{Pose, Rotation, Vector};

use crate::scoring::Grip::Touching;
use crate::scoring::placement::sides::still_and_released;
use crate::scoring::{A, B, C, Done, Facts};

conditions! { "move_house":
    lifted = 0 Milestone,
    open = 0 Milestone [1],
    passed = 1 Done,
    carried_to_goal = 2 First,
    placed = 2 Then,
    away_from_goal = 2 Broken,
}

fn held() -> Facts {
    Facts::at_rest(&task()).held_by(&[B, C], "console_table")
}

/// Places the table's middle on the middle of the marks, offset by `beside_m` and rotated by `degrees`.
fn at_marks(mut facts: Facts, beside_m: Vector, degrees: f32) -> Facts {
    let marks_m = facts.position_m("foot_marks");
    facts.object_mut("console_table").pose_in_world =
        Pose::from_parts(marks_m + beside_m, Rotation::from_rotation_z(degrees.to_radians()));
    facts
}

#[test]
fn lift_on_both_sides_of_3_cm_of_every_foot_and_by_b_and_c() {
    assert!(lifted(&held().raised("console_table", 0.0301)));
    assert!(!lifted(&held().raised("console_table", 0.0299)));
    for lean_rad in [0.01, -0.01] {
        assert!(!lifted(&held().raised("console_table", 0.0301).turned(
            "console_table",
            Vector::Y,
            lean_rad
        )));
    }
    let let_go = |robot| {
        [Left, Right]
            .into_iter()
            .fold(held(), |facts, side| facts.grip(robot, side, "console_table", Touching))
    };
    for robot in [B, C] {
        assert!(!lifted(&let_go(robot).held_by(&[A], "console_table").raised("console_table", 0.0301)));
    }
}

#[test]
fn the_door_is_open_on_both_sides_of_its_angle() {
    let turned = |angle_rad: f32| Facts::at_rest(&task()).turned("lever_door leaf", Vector::Z, angle_rad);
    assert!(open(&turned(1.4501)));
    assert!(!open(&turned(1.4499)));
    assert!(!open(&turned(0.0)));
    let Done::Milestones(milestones) = &task().phases[0].done else { panic!("two milestones") };
    assert_eq!(milestones.len(), 2);
    assert!(
        milestones.iter().any(|milestone| milestone.for_s == 0.5 && milestone.condition.holds(&turned(1.5)))
    );
}

/// Places the table and its carriers, B and C, which hold it at this height. The rearmost points of the
/// table and of each robot are these distances beyond the middle of the wall.
fn beyond(table_m: f32, b_m: f32, c_m: f32, lift_m: f32) -> Facts {
    let mut facts = held();
    facts.object_mut("console_table").pose_in_world.translation.z = lift_m;
    let by_m = table_m + facts.reach_m("console_table", Vector::NEG_X);
    facts.object_mut("console_table").pose_in_world.translation.x += by_m;
    [(B, b_m), (C, c_m)].into_iter().fold(facts, |facts, (robot, rear_m)| {
        let by_m = rear_m + facts.robot_reach_m(robot, Vector::NEG_X);
        facts.with_robot_moved(robot, Vector::X * by_m)
    })
}

#[test]
fn all_of_table_and_carriers_passes_the_plane_together() {
    for (table_m, b_m, c_m, lift_m, expected) in [
        (0.6, 1.0, 0.3, 0.05, true),
        (0.2001, 1.0, 0.3, 0.05, true),
        (0.1999, 1.0, 0.3, 0.05, false),
        (0.6, 0.2001, 0.3, 0.05, true),
        (0.6, 0.1999, 0.3, 0.05, false),
        (0.6, 1.0, 0.2001, 0.05, true),
        (0.6, 1.0, 0.1999, 0.05, false),
        (0.6, 1.0, 0.3, 0.0101, true),
        (0.6, 1.0, 0.3, 0.0099, false),
    ] {
        let facts = beyond(table_m, b_m, c_m, lift_m);
        assert_eq!(passed(&facts), expected, "{table_m} {b_m} {c_m} {lift_m}");
    }
    let let_go = beyond(0.6, 1.0, 0.3, 0.05).grip(C, Left, "console_table", Touching);
    assert!(!passed(&let_go.grip(C, Right, "console_table", Touching)));
}

#[test]
fn a_heel_behind_the_plane_is_not_through_the_door() {
    // C's pelvis is farther beyond the wall than its rearmost point.
    let facts = beyond(0.6, 1.0, 0.15, 0.05);
    let pelvis_m = facts.robots[C].pelvis_in_world.translation.x;
    assert!(pelvis_m > 0.2 && !passed(&facts), "{pelvis_m}");
}

#[test]
fn table_is_carried_to_15_cm_and_is_away_beyond() {
    for (beside_m, expected) in [
        (Vector::new(0.1499, 0.0, 0.05), true),
        (Vector::new(0.0, -0.1501, 0.05), false),
        (Vector::new(0.11, 0.10, 0.0101), true),
        (Vector::new(0.11, 0.11, 0.05), false),
    ] {
        assert_eq!(carried_to_goal(&at_marks(held(), beside_m, 0.0)), expected, "{beside_m}");
        assert_eq!(away_from_goal(&at_marks(held(), beside_m, 0.0)), !expected, "{beside_m}");
    }
    assert!(!carried_to_goal(&at_marks(held(), Vector::Z * 0.0099, 0.0)));
}

#[test]
fn place_on_both_sides_of_every_threshold() {
    let stands = |beside_m: Vector, degrees: f32| at_marks(Facts::at_rest(&task()), beside_m, degrees);
    for (what, inside, outside) in [
        // Feet 28 mm wide on marks of 100 mm.
        ("x", stands(Vector::X * 0.0359, 0.0), stands(Vector::X * 0.0361, 0.0)),
        ("-x", stands(Vector::X * -0.0359, 0.0), stands(Vector::X * -0.0361, 0.0)),
        ("y", stands(Vector::Y * 0.0359, 0.0), stands(Vector::Y * 0.0361, 0.0)),
        ("-y", stands(Vector::Y * -0.0359, 0.0), stands(Vector::Y * -0.0361, 0.0)),
        // The feet, 0.37 m from the middle, move sideways by 3.5 cm; their corners move by one millimetre
        // more.
        ("turned", stands(Vector::ZERO, 5.1), stands(Vector::ZERO, 5.5)),
        ("turned back", stands(Vector::ZERO, -5.1), stands(Vector::ZERO, -5.5)),
        ("height", stands(Vector::Z * 0.0399, 0.0), stands(Vector::Z * 0.0401, 0.0)),
        ("depth", stands(Vector::Z * -0.0399, 0.0), stands(Vector::Z * -0.0401, 0.0)),
    ]
    .into_iter()
    .chain(still_and_released(&stands(Vector::ZERO, 0.0), "console_table"))
    {
        assert!(placed(&inside), "{what} inside");
        assert!(!placed(&outside), "{what} outside");
    }
    // A tilt of 15 degrees would lift feet off their marks; the limit is the one that all placements share.
    assert!(!placed(&stands(Vector::ZERO, 0.0).turned("console_table", Vector::X, 0.3)));
}
