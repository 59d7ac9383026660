//! Tests of phases on both sides of every published threshold, in modified worlds, for the tasks with
//! walking.

use std::f32::consts::FRAC_PI_2;

use tandem_episodes::{A, B, C, Done, Facts, Grip};
use tandem_sim::{Pose, Rotation, Sides, Vector};

use super::scene::{Scene, changed, held_by, put, raise, tilt};
use super::table;

const SIDEWAYS: [Vector; 4] = [Vector::X, Vector::NEG_X, Vector::Y, Vector::NEG_Y];

#[test]
fn trash_collection() {
    let scene = Scene::of("trash_collection");
    scene.threshold(1, table::BIN_LIFT_M, true, |facts, lift_m| {
        held_by(facts, &[A], "bin");
        raise(facts, "bin", lift_m);
    });
    let deliver = |facts: &mut Facts, beside_m: Vector| {
        put(facts, "bin", "carry_point", beside_m + Vector::Z * 0.05);
        held_by(facts, &[A], "bin");
    };
    for axis in SIDEWAYS {
        scene.threshold(2, table::BIN_DELIVERED_M, false, |facts, off_m| deliver(facts, axis * off_m));
    }
    // Height of the bench on which the bottle stands.
    let bench_m = |facts: &Facts| {
        let bottle = facts.object("pet_bottle");
        bottle.model.lowest_m(&bottle.pose_in_world)
    };
    scene.threshold(2, table::BIN_RIM_ABOVE_BENCH_M, false, |facts, above_m| {
        deliver(facts, Vector::ZERO);
        let up_m = bench_m(facts) + above_m - facts.highest_m("bin");
        changed(facts, "bin").pose_in_world.translation.z += up_m;
    });
    let swept = |facts: &mut Facts, holds: bool| {
        deliver(facts, Vector::ZERO);
        let in_bin_m = facts.point_m("bin", Vector::Z * 0.1);
        changed(facts, "pet_bottle").pose_in_world.translation = in_bin_m;
        if !holds {
            let hands_off = hands_off(facts);
            changed(facts, "bin").hands = hands_off;
        }
    };
    assert!(scene.done(3, |facts| swept(facts, true)));
    assert!(!scene.done(3, |facts| swept(facts, false)), "A has let go of the bin");
    assert!(!scene.done(3, |facts| deliver(facts, Vector::ZERO)), "the bottle is on the bench");
}

/// Returns the state of hands without contacts, for all robots.
fn hands_off(facts: &Facts) -> Vec<Sides<Grip>> {
    vec![Sides::both(Grip::Off); facts.robots.len()]
}

#[test]
fn cart_service() {
    let scene = Scene::of("cart_service");
    for axis in SIDEWAYS {
        scene.threshold(1, table::TROLLEY_PARKED_M, false, |facts, off_m| {
            put(facts, "service_trolley", "parking_mark", axis * off_m);
        });
    }
    scene.threshold(2, table::WINE_LIFT_M, true, |facts, lift_m| {
        held_by(facts, &[B], "bottle");
        raise(facts, "bottle", lift_m);
    });
    for axis in SIDEWAYS {
        scene.beginning(3, table::WINE_CARRIED_M, false, |facts, off_m| {
            put(facts, "bottle", "serving_patch", axis * off_m + Vector::Z * 0.2);
            held_by(facts, &[B], "bottle");
        });
    }
    let serve = |facts: &mut Facts, beside_m: Vector| put(facts, "bottle", "serving_patch", beside_m);
    for axis in [Vector::X, Vector::NEG_X, Vector::Y, Vector::NEG_Y, Vector::Z] {
        scene.threshold(3, table::WINE_PLACE_M, false, |facts, off_m| serve(facts, axis * off_m));
    }
    scene.threshold(3, table::PLACED.tilt_deg, false, |facts, by_deg| {
        serve(facts, Vector::ZERO);
        tilt(facts, "bottle", by_deg);
    });
    scene.rest(3, "bottle", &table::PLACED, |facts| serve(facts, Vector::ZERO));
}

#[test]
fn co_carry() {
    let scene = Scene::of("co_carry");
    scene.threshold(1, table::BASKET_LIFT_M, true, |facts, lift_m| {
        held_by(facts, &[A, B], "basket");
        raise(facts, "basket", lift_m);
    });
    let carry = |facts: &mut Facts, beside_m: Vector| {
        put(facts, "basket", "basket_patch", beside_m);
        held_by(facts, &[A, B], "basket");
    };
    let place = |facts: &mut Facts, beside_m: Vector| put(facts, "basket", "basket_patch", beside_m);
    for axis in SIDEWAYS {
        scene.threshold(2, table::BASKET_BOUNDS_M, false, |facts, off_m| {
            carry(facts, axis * off_m + Vector::Z * 0.05);
        });
        scene.threshold(3, table::BASKET_BOUNDS_M, false, |facts, off_m| place(facts, axis * off_m));
    }
    scene.threshold(2, table::BASKET_CLEAR_M, true, |facts, clear_m| carry(facts, Vector::Z * clear_m));
    for axis in [Vector::Z, Vector::NEG_Z] {
        scene.threshold(3, table::BASKET_HEIGHT_M, false, |facts, off_m| place(facts, axis * off_m));
    }
    scene.threshold(3, table::PLACED.tilt_deg, false, |facts, by_deg| {
        place(facts, Vector::ZERO);
        tilt(facts, "basket", by_deg);
    });
    scene.rest(3, "basket", &table::PLACED, |facts| place(facts, Vector::ZERO));
}

#[test]
fn table_align() {
    let scene = Scene::of("table_align");
    scene.threshold(1, table::TABLE_LIFT_M, true, |facts, lift_m| {
        held_by(facts, &[A, B], "office_table");
        raise(facts, "office_table", lift_m);
    });
    scene.threshold(2, table::TABLE_CLEAR_M, true, |facts, clear_m| {
        put(facts, "office_table", "table_patch", Vector::Z * clear_m);
        held_by(facts, &[A, B], "office_table");
    });
    let align = |facts: &mut Facts, beside_m: Vector, turned_deg: f32| {
        let turn = Rotation::from_rotation_z(FRAC_PI_2 + turned_deg.to_radians());
        let chair = facts.object("office_chair").pose_in_world;
        let table = changed(facts, "office_table");
        table.pose_in_world = chair * Pose::from_parts(beside_m, turn);
        table.untouched_s = 10.0;
    };
    let [near_m, far_m] = table::TABLE_BEFORE_CHAIR_M;
    scene.threshold(3, near_m, true, |facts, before_m| align(facts, Vector::X * before_m, 0.0));
    scene.threshold(3, far_m, false, |facts, before_m| align(facts, Vector::X * before_m, 0.0));
    let middle = Vector::X * 0.4;
    for side in [1.0, -1.0] {
        scene.threshold(3, table::TABLE_ACROSS_M, false, |facts, off_m| {
            align(facts, middle + Vector::Y * off_m * side, 0.0);
        });
        scene.threshold(3, table::TABLE_SQUARE_DEG, false, |facts, off_deg| {
            align(facts, middle, off_deg * side)
        });
        scene.threshold(3, table::TABLE_HEIGHT_M, false, |facts, off_m| {
            align(facts, middle + Vector::Z * off_m * side, 0.0);
        });
    }
    scene.rest(3, "office_table", &table::PLACED, |facts| align(facts, middle, 0.0));
}

#[test]
fn move_house() {
    let scene = Scene::of("move_house");
    let open = |facts: &mut Facts, angle_rad: f32| {
        changed(facts, "lever_door leaf").pose_in_world.rotation = Rotation::from_rotation_z(angle_rad);
    };
    let lift = |facts: &mut Facts, lift_m: f32| {
        held_by(facts, &[B, C], "console_table");
        raise(facts, "console_table", lift_m);
    };
    scene.threshold(1, table::CONSOLE_LIFT_M, true, |facts, lift_m| {
        open(facts, 1.5);
        lift(facts, lift_m);
    });
    scene.threshold(1, table::DOOR_OPEN_RAD, true, |facts, angle_rad| {
        open(facts, angle_rad);
        lift(facts, 0.05);
    });
    let Done::Milestones(milestones) = &scene.task.phases[0].done else { panic!("in either order") };
    assert_eq!(milestones.iter().map(|milestone| milestone.for_s).fold(0.0, f64::max), table::DOOR_OPEN_S);
    let place = |facts: &mut Facts, beside_m: Vector| put(facts, "console_table", "foot_marks", beside_m);
    for axis in SIDEWAYS {
        scene.beginning(3, table::CONSOLE_CARRIED_M, false, |facts, off_m| {
            place(facts, axis * off_m + Vector::Z * 0.05);
            held_by(facts, &[B, C], "console_table");
        });
        // The whole foot, 28 mm square, must be on its mark.
        let beside_m = table::CONSOLE_MARK_M / 2.0 - 0.014;
        scene.threshold(3, beside_m, false, |facts, off_m| place(facts, axis * off_m));
    }
    for axis in [Vector::Z, Vector::NEG_Z] {
        scene.threshold(3, table::CONSOLE_HEIGHT_M, false, |facts, off_m| place(facts, axis * off_m));
    }
    scene.rest(3, "console_table", &table::PLACED, |facts| place(facts, Vector::ZERO));
}

#[test]
fn big_table() {
    let scene = Scene::of("big_table");
    scene.threshold(1, table::ROUND_LIFT_M, true, |facts, lift_m| {
        held_by(facts, &[A, B, C], "round_table");
        raise(facts, "round_table", lift_m);
    });
    scene.threshold(2, table::ROUND_CLEAR_M, true, |facts, clear_m| {
        put(facts, "round_table", "goal_disc", Vector::Z * clear_m);
        held_by(facts, &[A, B, C], "round_table");
    });
    let place = |facts: &mut Facts, beside_m: Vector| put(facts, "round_table", "goal_disc", beside_m);
    for axis in [Vector::Z, Vector::NEG_Z] {
        scene.threshold(3, table::ROUND_HEIGHT_M, false, |facts, off_m| place(facts, axis * off_m));
    }
    scene.threshold(3, table::PLACED.tilt_deg, false, |facts, by_deg| {
        place(facts, Vector::ZERO);
        tilt(facts, "round_table", by_deg);
    });
    scene.rest(3, "round_table", &table::PLACED, |facts| place(facts, Vector::ZERO));
}
