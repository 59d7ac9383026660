//! CoCarry: two robots lift a laundry basket by its rim, side-step with it to another shelf and set it down there.
//!
//! Conditions, tolerances and randomisation are the benchmark's. Where it is silent we chose what two G1s carry: a basket of
//! 2 kg with its rim at 0.91 m, and 1.2 m from shelf to shelf, so that it is carried over a metre whatever the seed and
//! wherever within the bounds it is set down.

use std::f32::consts::PI;

use super::{Offset, RobotSpot, Task, spot, uniform_xy};
use crate::scoring::nearness::{all, beside, come, grips, in_hands, is, standing};
use crate::scoring::placement::{above_box, stands_as_high, stands_released};
use crate::scoring::{A, B, Done, Facts, Phase};

const SHELF_M: f32 = 0.67;
const START_XY_M: [f32; 2] = [0.628, 0.0];
const CARRY_M: f32 = 1.2;
const LIFTED_M: f32 = 0.03;
const CLEAR_M: f32 = 0.01;
/// How far the basket may be from the middle of the patch, on each horizontal axis.
const ON_PATCH_M: f32 = 0.15;
const AS_HIGH_M: f32 = 0.06;

pub const TASK: Task = Task {
    id: "co_carry",
    scene: "laundromat_143",
    robots: &[
        RobotSpot {
            name: "A",
            position_m: [0.0, 0.0],
            yaw_rad: 0.0,
            instruction: "Take the rim at your end of the basket with both hands. Lift the basket together with your \
                          partner, step sideways to your right with it, level, and set it down on the green patch.",
        },
        RobotSpot {
            name: "B",
            position_m: [2.0 * START_XY_M[0], 0.0],
            yaw_rad: PI,
            instruction: "Take the rim at your end of the basket with both hands. Lift the basket together with your \
                          partner, step sideways to your left with it, level, and set it down on the green patch.",
        },
    ],
    objects: &[
        spot("basket", [START_XY_M[0], START_XY_M[1], SHELF_M]),
        spot("basket_patch", [START_XY_M[0], START_XY_M[1] - CARRY_M, SHELF_M]),
    ],
    randomize: &[Offset { wider_yaw_rad: 0.1, ..uniform_xy(&["basket"], 0.05, 0.05) }],
    instruction: "Both robots take the laundry basket by its rim, carry it level to the green patch on the other shelf, set it \
                  down there and let go.",
    benchmark_steps: 1000,
    phases: &[
        Phase {
            id: "joint_grasp_and_lift",
            description: "Both robots hold the basket, its base at least 3 cm above the shelf.",
            collaborative: true,
            done: Done::When(&lifted),
            nearness: &|f| {
                in_hands(grips(f, &[A, B], "basket"), &[come(f.clearance_m("basket"), 0.0, LIFTED_M)])
            },
        },
        Phase {
            id: "carry",
            description: "Both robots hold the basket within 15 cm of the patch on each horizontal axis, its base at least \
                          1 cm above the shelf.",
            collaborative: true,
            done: Done::When(&carried),
            nearness: &|f| {
                all(&[is(held_above(f, CLEAR_M)), beside(f, "basket", "basket_patch", [CARRY_M, ON_PATCH_M])])
            },
        },
        Phase {
            id: "release",
            description: "The basket stands within 15 cm of the patch on each horizontal axis, as high as on the first shelf to \
                          6 cm, upright within 15 degrees and still, and no robot has touched it for 0.2 s.",
            collaborative: true,
            done: Done::When(&released),
            nearness: &|f| all(&[is(on_patch(f)), standing(f, "basket"), is(released(f))]),
        },
    ],
    file: None,
};

fn held_above(f: &Facts, clear_m: f32) -> bool {
    f.held_by_all(&[A, B], "basket") && f.clearance_m("basket") >= clear_m
}

fn on_patch(f: &Facts) -> bool {
    above_box(f, "basket", "basket_patch", ON_PATCH_M)
}

/// Both robots hold the basket off its shelf.
fn lifted(f: &Facts) -> bool {
    held_above(f, LIFTED_M)
}

/// Both robots hold the basket over the patch.
fn carried(f: &Facts) -> bool {
    held_above(f, CLEAR_M) && on_patch(f)
}

/// The basket stands on the patch, released.
fn released(f: &Facts) -> bool {
    stands_released(f, "basket") && on_patch(f) && stands_as_high(f, "basket", AS_HIGH_M)
}

#[cfg(test)]
mod tests;
