//! Quantities of worlds that were put together by hand.

use super::*;
use crate::tasks;

#[test]
fn quantities_are_those_of_the_constructed_world() {
    let handover = tasks::find("handover").unwrap();
    let close = |a: f32, b: f32| (a - b).abs() < 1e-5;
    let rest = Facts::at_rest(handover);
    assert!(close(rest.lift_m("bottle"), 0.0) && close(rest.tilt_rad("bottle"), 0.0));
    assert!(close(rest.clone().raised("bottle", 0.07).lift_m("bottle"), 0.07));
    for (axis, angle_rad, tilt_rad) in
        [(Vector::X, 0.4, 0.4), (Vector::Y, -0.4, 0.4), (Vector::X, 3.0, 3.0), (Vector::Z, 2.0, 0.0)]
    {
        let turned = rest.clone().turned("bottle", axis, angle_rad);
        assert!((turned.tilt_rad("bottle") - tilt_rad).abs() < 1e-3, "{axis} {angle_rad}");
    }
}

#[test]
fn a_hold_is_of_one_hand_and_a_touch_is_no_hold() {
    use Side::{Left, Right};
    let rest = Facts::at_rest(tasks::find("handover").unwrap());
    assert!(rest.hands_off(A, "bottle") && !rest.holds_any(A, "bottle"));
    let held = rest.clone().grip(A, Right, "bottle", Grip::Holding);
    assert!(held.holds(A, Right, "bottle") && held.holds_any(A, "bottle") && !held.hands_off(A, "bottle"));
    assert!(!held.holds(A, Left, "bottle") && !held.holds(B, Right, "bottle") && held.hands_off(B, "bottle"));
    let touched = rest.grip(A, Right, "bottle", Grip::Touching);
    assert!(!touched.holds_any(A, "bottle") && !touched.hands_off(A, "bottle"));
}

#[test]
#[should_panic(expected = "name \"vase\"")]
fn a_condition_on_something_that_is_not_there_is_a_bug() {
    Facts::at_rest(tasks::find("handover").unwrap()).lift_m("vase");
}
