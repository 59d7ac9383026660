//! Tests of phases on both sides of every published threshold, in modified worlds, for the tasks without
//! walking.

use tandem_episodes::{A, B, Done, Facts};
use tandem_sim::{Rotation, Side, Vector};

use super::scene::{Scene, changed, hold, raise, tilt};
use super::table;

#[test]
fn handover() {
    let scene = Scene::of("handover");
    scene.threshold(1, table::HANDOVER_LIFT_M, true, |facts, lift_m| {
        hold(facts, A, Side::Right, "bottle");
        raise(facts, "bottle", lift_m);
    });
    let place = |facts: &mut Facts, beside_m: Vector| {
        let target_m = facts.position_m("target_pad");
        let bottle = changed(facts, "bottle");
        bottle.pose_in_world.translation = target_m + beside_m;
        bottle.pose_in_world.rotation = Rotation::IDENTITY;
        bottle.untouched_s = 10.0;
    };
    for axis in [Vector::X, Vector::NEG_X, Vector::Y, Vector::NEG_Y, Vector::Z] {
        scene.threshold(3, table::HANDOVER_PLACE_M, false, |facts, off_m| place(facts, axis * off_m));
    }
    scene.threshold(3, table::PLACED.tilt_deg, false, |facts, by_deg| {
        place(facts, Vector::ZERO);
        tilt(facts, "bottle", by_deg);
    });
    scene.rest(3, "bottle", &table::PLACED, |facts| place(facts, Vector::ZERO));
}

#[test]
fn pouring() {
    let scene = Scene::of("pouring");
    for (vessel, other) in [("cup", "glass"), ("glass", "cup")] {
        scene.threshold(1, table::POURING_LIFT_M, true, |facts, lift_m| {
            raise(facts, vessel, lift_m);
            raise(facts, other, 0.2);
        });
    }
    scene.threshold(2, table::POURING_TIP_DEG, true, |facts, by_deg| {
        hold(facts, A, Side::Right, "cup");
        raise(facts, "cup", 0.2);
        tilt(facts, "cup", by_deg);
    });
    scene.threshold(3, table::POURING_LIFT_M, true, |facts, lift_m| {
        raise(facts, "glass", lift_m);
        let in_glass_m = facts.point_m("glass", Vector::new(0.0, 0.0, 0.02));
        changed(facts, "marble").pose_in_world.translation = in_glass_m;
    });
    let Done::Lasting { for_s, .. } = &scene.task.phases[2].done else { panic!("the marble has to stay") };
    assert_eq!(*for_s, table::POURING_INSIDE_S);
}

#[test]
fn frame_hang() {
    let scene = Scene::of("frame_hang");
    let held = |facts: &mut Facts| {
        hold(facts, A, Side::Left, "frame");
        hold(facts, B, Side::Right, "frame");
    };
    assert!(scene.done(1, held));
    scene.threshold(2, table::FRAME_LIFT_M, true, |facts, lift_m| {
        held(facts);
        raise(facts, "frame", lift_m);
    });
    // Places the loop of the picture frame at the middle of the peg, rotated about the peg in the plane of
    // the frame.
    let hang = |facts: &mut Facts, turned_deg: f32| {
        let peg_m = (facts.site_m("wall_peg", "root") + facts.site_m("wall_peg", "tip")) * 0.5;
        let rotation = Rotation::from_rotation_y(turned_deg.to_radians());
        let loop_m = facts.site("frame", "loop").position_m();
        let frame = changed(facts, "frame");
        frame.pose_in_world.rotation = rotation;
        frame.pose_in_world.translation = peg_m - rotation * loop_m;
        frame.untouched_s = 10.0;
    };
    scene.threshold(3, table::HUNG.tilt_deg, false, hang);
    scene.rest(3, "frame", &table::HUNG, |facts| hang(facts, 0.0));
}

#[test]
fn co_pouring() {
    let scene = Scene::of("co_pouring");
    let held = |facts: &mut Facts| {
        hold(facts, A, Side::Left, "tub");
        hold(facts, B, Side::Right, "tub");
    };
    scene.threshold(1, table::TUB_LIFT_M, true, |facts, lift_m| {
        held(facts);
        raise(facts, "tub", lift_m);
    });
    scene.threshold(2, table::TUB_TIP_DEG, true, |facts, by_deg| {
        held(facts);
        tilt(facts, "tub", by_deg);
    });
    let pour = |facts: &mut Facts, left: usize| {
        held(facts);
        let in_crate_m = facts.point_m("crate", Vector::new(0.0, 0.0, 0.05));
        let apples = facts.objects.iter_mut().filter(|object| object.name.starts_with("apple"));
        apples.skip(left).for_each(|apple| apple.pose_in_world.translation = in_crate_m);
    };
    assert!(scene.done(3, |facts| pour(facts, 0)));
    assert!(!scene.done(3, |facts| pour(facts, 1)), "an apple is still in the tub");
}
