//! Tests at both sides of every threshold of Handover.

use tandem_sim::Side::{Left, Right};
use tandem_sim::{Side, Vector};

use crate::scoring::Grip::{self, Holding, Off, Touching};
use crate::scoring::{A, B, Facts};

conditions! { "handover":
    grasped_and_lifted = 0 Done,
    held_together = 1 First,
    held_by_b_alone = 1 Then,
    held_by_nobody = 1 Broken,
    placed = 2 Done,
}

fn at_rest() -> Facts {
    Facts::at_rest(&task())
}

fn gripped(grips: &[(usize, Side, Grip)]) -> Facts {
    grips.iter().fold(at_rest(), |facts, &(robot, side, grip)| facts.grip(robot, side, "bottle", grip))
}

#[test]
fn grasp_and_lift_on_both_sides_of_3_cm() {
    let held = |robot, side, lift_m| gripped(&[(robot, side, Holding)]).raised("bottle", lift_m);
    for (facts, expected) in [
        (held(A, Right, 0.0301), true),
        (held(A, Right, 0.0299), false),
        (held(A, Left, 0.0301), false),
        (held(B, Right, 0.0301), false),
        (gripped(&[(A, Right, Touching)]).raised("bottle", 0.0301), false),
    ] {
        assert_eq!(grasped_and_lifted(&facts), expected, "{facts:?}");
    }
}

#[test]
fn transfer_conditions() {
    for (grips, together, b_alone, nobody) in [
        (&[(A, Right, Holding), (B, Right, Holding)][..], true, false, false),
        (&[(A, Right, Holding), (B, Right, Touching)], false, false, false),
        (&[(A, Left, Holding), (B, Right, Holding)], false, false, false),
        (&[(A, Right, Off), (B, Right, Holding)], false, true, false),
        (&[(A, Right, Touching), (B, Right, Holding)], false, false, false),
        (&[(A, Left, Touching), (B, Right, Holding)], false, false, false),
        (&[(B, Left, Holding)], false, false, false),
        (&[(A, Right, Touching), (B, Right, Touching)], false, false, true),
        (&[], false, false, true),
    ] {
        let facts = gripped(grips);
        let found = (held_together(&facts), held_by_b_alone(&facts), held_by_nobody(&facts));
        assert_eq!(found, (together, b_alone, nobody), "{grips:?}");
    }
}

/// Places the bottle on the target; it has been untouched for 10 s.
fn on_target() -> Facts {
    let mut facts = at_rest();
    facts.object_mut("bottle").pose_in_world = facts.object("target_pad").pose_in_world;
    facts
}

fn changed(change: impl Fn(&mut crate::scoring::ObjectFacts)) -> Facts {
    let mut facts = on_target();
    change(facts.object_mut("bottle"));
    facts
}

#[test]
fn place_on_both_sides_of_every_threshold() {
    let shifted = |by_m: Vector| changed(|bottle| bottle.pose_in_world.translation += by_m);
    let tilted = |degrees: f32| on_target().turned("bottle", Vector::Y, degrees.to_radians());
    let moving = |m_s| changed(|bottle| bottle.velocity_m_s = Vector::new(0.0, m_s, 0.0));
    let turning = |rad_s| changed(|bottle| bottle.angular_velocity_rad_s = Vector::new(0.0, 0.0, rad_s));
    let untouched = |for_s| changed(|bottle| bottle.untouched_s = for_s);
    for (what, inside, outside) in [
        ("x", shifted(Vector::X * 0.0599), shifted(Vector::X * 0.0601)),
        ("-x", shifted(Vector::X * -0.0599), shifted(Vector::X * -0.0601)),
        ("y", shifted(Vector::Y * 0.0599), shifted(Vector::Y * 0.0601)),
        ("-y", shifted(Vector::Y * -0.0599), shifted(Vector::Y * -0.0601)),
        ("-z", shifted(Vector::Z * -0.0599), shifted(Vector::Z * -0.0601)),
        ("z", shifted(Vector::Z * 0.0599), shifted(Vector::Z * 0.0601)),
        ("tilt", tilted(14.9), tilted(15.1)),
        ("speed", moving(0.0499), moving(0.0501)),
        ("turning", turning(0.1499), turning(0.1501)),
        ("release", untouched(0.2), untouched(0.18)),
    ] {
        assert!(placed(&inside), "{what} inside");
        assert!(!placed(&outside), "{what} outside");
    }
}
