//! Presses on both sides of every threshold, and how long they last.

use super::*;

fn contacts(thumb_n: Vector, fingers_n: Vector, palm_n: Vector) -> HandContacts {
    HandContacts { thumb_n, fingers_n, palm_n }
}

/// Thumb and fingers on opposite sides, each pressing with `force_n`.
fn pinch(force_n: f32) -> HandContacts {
    contacts(Vector::Y * force_n, Vector::Y * -force_n, Vector::ZERO)
}

#[test]
fn only_opposed_presses_hold() {
    let (none, weak, strong) = (Vector::ZERO, HOLD_BEGINS_N - 0.01, HOLD_BEGINS_N + 0.01);
    let tilted = |degrees: f32| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        Vector::new(sine, cosine, 0.0) * strong
    };
    let thumb = Vector::Y * strong;
    for (what, contacts, expected) in [
        ("nothing", contacts(none, none, none), Grip::Off),
        ("thumb alone", contacts(thumb, none, none), Grip::Touching),
        ("fingers and palm", contacts(none, thumb, -thumb), Grip::Touching),
        ("thumb and fingers", pinch(strong), Grip::Holding),
        ("thumb and palm", contacts(thumb, none, -thumb), Grip::Holding),
        ("too weak", pinch(weak), Grip::Touching),
        ("one side too weak", contacts(thumb * 9.0, -Vector::Y * weak, none), Grip::Touching),
        ("same side", contacts(thumb, thumb, none), Grip::Touching),
        ("121 degrees", contacts(thumb, tilted(121.0), none), Grip::Holding),
        ("119 degrees", contacts(thumb, tilted(119.0), none), Grip::Touching),
    ] {
        let mut detector = GraspDetector::default();
        (0..STEPS_TO_CHANGE).for_each(|_| detector.update(&contacts));
        assert_eq!(detector.grip(), expected, "{what}");
    }
}

#[test]
fn a_hold_takes_60_ms_to_begin_and_to_end_and_does_not_flicker() {
    let between = (HOLD_BEGINS_N + HOLD_ENDS_N) / 2.0;
    let (strong, off) = (HOLD_BEGINS_N + 1.0, 0.0);
    let steps = [
        (strong, false),
        (strong, false),
        (off, false), // starts over
        (strong, false),
        (strong, false),
        (strong, true),
        (between, true), // above the lower threshold
        (off, true),
        (off, true),
        (strong, true), // starts over
        (off, true),
        (off, true),
        (off, false),
        (between, false), // below the upper threshold
        (between, false),
        (between, false),
    ];
    let mut detector = GraspDetector::default();
    for (index, (force_n, holding)) in steps.into_iter().enumerate() {
        detector.update(&pinch(force_n));
        assert_eq!(detector.grip() == Grip::Holding, holding, "step {index}");
    }
}
