//! Tests at both sides of every threshold of FrameHang.

use tandem_sim::Side::{Left, Right};
use tandem_sim::{Pose, Rotation, Vector};

use crate::scoring::{A, B, Facts};
use crate::scoring::{Grip::Holding, ObjectFacts};

conditions! { "frame_hang":
    held_by_both = 0 Done,
    lifted = 1 Done,
    threaded_while_held = 2 First,
    hangs = 2 Then,
    off_the_peg = 2 Broken,
}

fn held() -> Facts {
    Facts::at_rest(&task()).grip(A, Left, "frame", Holding).grip(B, Right, "frame", Holding)
}

/// Places the loop's centre at `offset_m` from the middle of the peg's free part.
fn on_peg(offset_m: Vector) -> Facts {
    let mut facts = Facts::at_rest(&task());
    let middle_m = (facts.site_m("wall_peg", "root") + facts.site_m("wall_peg", "tip")) * 0.5;
    let loop_m = facts.site("frame", "loop").position_m();
    facts.object_mut("frame").pose_in_world.translation = middle_m + offset_m - loop_m;
    facts
}

#[test]
fn both_robots_hold_and_lift_on_both_sides_of_10_cm() {
    assert!(held_by_both(&held()));
    assert!(!held_by_both(&Facts::at_rest(&task()).grip(A, Left, "frame", Holding)));
    assert!(lifted(&held().raised("frame", 0.1001)));
    assert!(!lifted(&held().raised("frame", 0.0999)));
    assert!(!lifted(&Facts::at_rest(&task()).grip(B, Right, "frame", Holding).raised("frame", 0.1001)));
}

#[test]
fn the_peg_is_in_the_loop_or_beside_it() {
    for (offset_m, expected) in [
        (Vector::ZERO, true),
        (Vector::new(0.0359, 0.0, 0.0), true),
        (Vector::new(0.0361, 0.0, 0.0), false),
        (Vector::new(0.0, 0.0, -0.0359), true),
        (Vector::new(0.0, 0.0, -0.0361), false),
        // The ends of the peg are 53.5 mm from its middle.
        (Vector::new(0.0, 0.053, 0.0), true),
        (Vector::new(0.0, 0.054, 0.0), false),
        (Vector::new(0.0, -0.053, 0.0), true),
        (Vector::new(0.0, -0.054, 0.0), false),
    ] {
        assert_eq!(off_the_peg(&on_peg(offset_m)), !expected, "{offset_m}");
        assert_eq!(hangs(&on_peg(offset_m)), expected, "{offset_m}");
    }
}

#[test]
fn the_peg_passes_the_loop_while_both_robots_hold_the_frame() {
    let by_a = |facts: Facts| facts.grip(A, Left, "frame", Holding);
    let by_b = |facts: Facts| facts.grip(B, Right, "frame", Holding);
    let beside = on_peg(Vector::new(0.0361, 0.0, 0.0));
    for (facts, expected) in [
        (by_b(by_a(on_peg(Vector::ZERO))), true),
        (by_a(on_peg(Vector::ZERO)), false),
        (by_b(on_peg(Vector::ZERO)), false),
        (by_b(by_a(beside)), false),
    ] {
        assert_eq!(threaded_while_held(&facts), expected, "{facts:?}");
    }
}

#[test]
fn hanging_on_both_sides_of_every_threshold() {
    let changed = |change: &dyn Fn(&mut ObjectFacts)| {
        let mut facts = on_peg(Vector::ZERO);
        change(facts.object_mut("frame"));
        facts
    };
    let moving = |m_s| changed(&|frame| frame.velocity_m_s = Vector::X * m_s);
    let turning = |rad_s| changed(&|frame| frame.angular_velocity_rad_s = Vector::Y * rad_s);
    let untouched = |for_s| changed(&|frame| frame.untouched_s = for_s);
    // Rotated in the plane of the picture frame, about the loop.
    let tilted = |degrees: f32| {
        let mut facts = on_peg(Vector::ZERO);
        let (loop_m, loop_in_frame_m) =
            (facts.site_m("frame", "loop"), facts.site("frame", "loop").position_m());
        let rotation = Rotation::from_rotation_y(degrees.to_radians());
        facts.object_mut("frame").pose_in_world =
            Pose::from_parts(loop_m - rotation * loop_in_frame_m, rotation);
        facts
    };
    for (what, inside, outside) in [
        ("tilt", tilted(34.9), tilted(35.1)),
        ("speed", moving(0.199), moving(0.201)),
        ("turning", turning(0.799), turning(0.801)),
        ("release", untouched(0.2), untouched(0.18)),
    ] {
        assert!(hangs(&inside), "{what} inside");
        assert!(!hangs(&outside), "{what} outside");
    }
}
