//! CoPouring: two robots lift a tub of apples by the bars at its ends and tip it into a crate beside them.
//!
//! Conditions, tolerances and randomisation are the benchmark's. Where it is silent we chose what two G1s carry: a 0.8 kg
//! tub with six apples of 0.12 kg, on a stack that puts the bars at elbow height; the crate stands on A's left.

use std::f32::consts::PI;

use super::{ObjectSpot, Offset, RobotSpot, Task, spot, uniform_xy};
use crate::scoring::nearness::{all, come, grips, in_hands, is};
use crate::scoring::{A, B, Done, Facts, Phase};

const TUB_STACK_M: f32 = 0.75;
const CRATE_STACK_M: f32 = 0.45;
const TUB_XY_M: [f32; 2] = [0.53, 0.13];
const CRATE_XY_M: [f32; 2] = [0.53, 0.49];
const LIFTED_M: f32 = 0.03;
const TIPPED_RAD: f32 = 25.0 * PI / 180.0;
const APPLES: [&str; 6] = ["apple_1", "apple_2", "apple_3", "apple_4", "apple_5", "apple_6"];

/// An apple on the floor of the tub, `x_m`, `y_m` from its middle.
const fn apple(name: &'static str, x_m: f32, y_m: f32) -> ObjectSpot {
    let position_m = [TUB_XY_M[0] + x_m, TUB_XY_M[1] + y_m, TUB_STACK_M + 0.0402];
    ObjectSpot { file: "apple", ..spot(name, position_m) }
}

pub const TASK: Task = Task {
    id: "co_pouring",
    scene: "grocery_102",
    robots: &[
        RobotSpot {
            name: "A",
            position_m: [0.0, 0.0],
            yaw_rad: 0.0,
            instruction: "Take the yellow bar at your end of the tub with your left hand. Lift the tub together with your \
                          partner, keep it level, then tip it to your left until all apples lie in the crate.",
        },
        RobotSpot {
            name: "B",
            position_m: [1.06, 0.0],
            yaw_rad: PI,
            instruction: "Take the yellow bar at your end of the tub with your right hand. Lift the tub together with your \
                          partner, keep it level, then tip it to your right until all apples lie in the crate.",
        },
    ],
    objects: &[
        spot("tub", [TUB_XY_M[0], TUB_XY_M[1], TUB_STACK_M]),
        spot("tub_stack", [TUB_XY_M[0], TUB_XY_M[1], TUB_STACK_M]),
        spot("crate", [CRATE_XY_M[0], CRATE_XY_M[1], CRATE_STACK_M]),
        spot("crate_stack", [CRATE_XY_M[0], CRATE_XY_M[1], CRATE_STACK_M]),
        apple(APPLES[0], -0.08, -0.04),
        apple(APPLES[1], -0.08, 0.04),
        apple(APPLES[2], 0.0, -0.04),
        apple(APPLES[3], 0.0, 0.04),
        apple(APPLES[4], 0.08, -0.04),
        apple(APPLES[5], 0.08, 0.04),
    ],
    randomize: &[
        Offset {
            wider_yaw_rad: 0.15,
            ..uniform_xy(
                &["tub", "tub_stack", APPLES[0], APPLES[1], APPLES[2], APPLES[3], APPLES[4], APPLES[5]],
                0.02,
                0.01,
            )
        },
        Offset { wider_yaw_rad: 0.05, ..uniform_xy(&["crate", "crate_stack"], 0.06, 0.005) },
        uniform_xy(&[APPLES[0]], 0.008, 0.008),
        uniform_xy(&[APPLES[1]], 0.008, 0.008),
        uniform_xy(&[APPLES[2]], 0.008, 0.008),
        uniform_xy(&[APPLES[3]], 0.008, 0.008),
        uniform_xy(&[APPLES[4]], 0.008, 0.008),
        uniform_xy(&[APPLES[5]], 0.008, 0.008),
    ],
    instruction: "Both robots take the tub by its bars, lift it together and pour all its apples into the crate beside them.",
    benchmark_steps: 1000,
    phases: &[
        Phase {
            id: "joint_grasp_and_lift",
            description: "Both robots hold the tub, its lowest point at least 3 cm above its stack.",
            collaborative: true,
            done: Done::When(&lifted),
            nearness: &|f| in_hands(grips(f, &[A, B], "tub"), &[come(f.clearance_m("tub"), 0.0, LIFTED_M)]),
        },
        Phase {
            id: "tip",
            description: "Both robots hold the tub, tilted by at least 25 degrees.",
            collaborative: true,
            done: Done::When(&tipped),
            nearness: &|f| in_hands(grips(f, &[A, B], "tub"), &[come(f.tilt_rad("tub"), 0.0, TIPPED_RAD)]),
        },
        Phase {
            id: "pour",
            description: "All apples are inside the crate, and both robots still hold the tub.",
            collaborative: true,
            done: Done::When(&poured),
            nearness: &|f| all(&[grips(f, &[A, B], "tub"), all(&APPLES.map(|apple| is(in_crate(f, apple))))]),
        },
    ],
    file: None,
};

fn held_by_both(f: &Facts) -> bool {
    f.holds_any(A, "tub") && f.holds_any(B, "tub")
}

/// Both robots hold the tub off its stack.
fn lifted(f: &Facts) -> bool {
    held_by_both(f) && f.clearance_m("tub") >= LIFTED_M
}

/// Both robots hold the tub aslant.
fn tipped(f: &Facts) -> bool {
    held_by_both(f) && f.tilt_rad("tub") >= TIPPED_RAD
}

fn in_crate(f: &Facts, apple: &str) -> bool {
    f.inside_box(apple, "crate", "inside")
}

/// Every apple lies in the crate, and nobody has dropped the tub.
fn poured(f: &Facts) -> bool {
    held_by_both(f) && APPLES.iter().all(|apple| in_crate(f, apple))
}

#[cfg(test)]
mod tests;
