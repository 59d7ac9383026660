//! Handover: A takes a bottle from the counter and gives it, hand to hand, to B, who stands it on a target.
//!
//! Conditions, tolerances and randomisation are the benchmark's. Where it is silent we chose what two G1s reach without
//! stepping: the robots face each other over a counter, the bottle before A's right hand, the target before B's.

use std::f32::consts::PI;

use tandem_sim::Side::Right;

use super::{Offset, RobotSpot, Task, spot, uniform_xy};
use crate::scoring::nearness::{all, beside, come, grip, in_hands, is, standing};
use crate::scoring::placement::{stands_released, within_box};
use crate::scoring::{A, B, Done, Facts, Phase};

/// Height of the counter's top above the floor.
const COUNTER_M: f32 = 0.80;
const LIFTED_M: f32 = 0.03;
/// How far the bottle may stand from the target, on each axis.
const ON_TARGET_M: f32 = 0.06;

pub const TASK: Task = Task {
    id: "handover",
    scene: "kitchen_084",
    robots: &[
        RobotSpot {
            name: "A",
            position_m: [0.0, 0.0],
            yaw_rad: 0.0,
            instruction: "Take the bottle in front of you with your right hand, lift it, and hold it out until your \
                          partner's right hand has closed on it. Then let go.",
        },
        RobotSpot {
            name: "B",
            position_m: [0.74, -0.12],
            yaw_rad: PI,
            instruction: "Close your right hand on the bottle that your partner holds out. When your partner has let \
                          go, stand it upright on the target in front of you and let go.",
        },
    ],
    objects: &[spot("bottle", [0.30, -0.07, COUNTER_M]), spot("target_pad", [0.44, -0.06, COUNTER_M])],
    randomize: &[
        Offset { wider_yaw_rad: 0.3, ..uniform_xy(&["bottle"], 0.025, 0.025) },
        Offset { wider_yaw_rad: 0.3, ..uniform_xy(&["target_pad"], 0.025, 0.025) },
    ],
    instruction: "Robot A picks up the bottle with its right hand and passes it straight into Robot B's right hand; \
                  Robot B stands it upright on the target and lets go.",
    benchmark_steps: 1000,
    phases: &[
        Phase {
            id: "grasp_and_lift",
            description: "A's right hand holds the bottle at least 3 cm above where it rested.",
            collaborative: false,
            done: Done::When(&grasped_and_lifted),
            nearness: &|f| in_hands(grip(f, A, Right, "bottle"), &[come(f.lift_m("bottle"), 0.0, LIFTED_M)]),
        },
        Phase {
            id: "transfer",
            description: "The right hands of A and B hold the bottle together, then B's right hand holds it with both \
                          of A's hands off; at no time in between has every hand let go.",
            collaborative: true,
            done: Done::Sequence { first: &held_together, then: &held_by_b_alone, broken: &held_by_nobody },
            nearness: &|f| all(&[grip(f, B, Right, "bottle"), is(held_by_b_alone(f))]),
        },
        Phase {
            id: "place",
            description: "The bottle stands within 6 cm of the target on each axis, upright within 15 degrees and \
                          still, and no robot has touched it for 0.2 s.",
            collaborative: false,
            done: Done::When(&placed),
            nearness: &|f| {
                all(&[
                    beside(f, "bottle", "target_pad", [0.6, ON_TARGET_M]),
                    standing(f, "bottle"),
                    is(placed(f)),
                ])
            },
        },
    ],
    file: None,
};

/// A's right hand holds the bottle at least 3 cm above where it rested.
fn grasped_and_lifted(f: &Facts) -> bool {
    f.holds(A, Right, "bottle") && f.lift_m("bottle") >= LIFTED_M
}

/// The right hands of A and B hold the bottle at the same time.
fn held_together(f: &Facts) -> bool {
    f.holds(A, Right, "bottle") && f.holds(B, Right, "bottle")
}

/// B's right hand holds the bottle and neither of A's hands touches it.
fn held_by_b_alone(f: &Facts) -> bool {
    f.holds(B, Right, "bottle") && f.hands_off(A, "bottle")
}

/// No hand of either robot holds the bottle.
fn held_by_nobody(f: &Facts) -> bool {
    !f.holds_any(A, "bottle") && !f.holds_any(B, "bottle")
}

/// The bottle stands on the target, released.
fn placed(f: &Facts) -> bool {
    stands_released(f, "bottle") && within_box(f, "bottle", "target_pad", ON_TARGET_M)
}

#[cfg(test)]
mod tests;
