//! TrashCollection: A carries a bin to the end of a bench and holds it there; B sweeps a bottle off the bench into it.
//!
//! Conditions, tolerances and randomisation are the benchmark's. Where it is silent we chose what a G1 carries between its
//! hands: a bin of 1.5 kg, 0.72 m tall, which stands so far away that it walks at least 1.2 m before
//! it counts as delivered; and a bench of 0.80 m, over whose end a bottle rolls that lies across it. A bin is held aloft if
//! it is held as high off the floor as for the first phase.

use std::f32::consts::FRAC_PI_2;

use super::{Offset, RobotSpot, Task, spot, uniform_xy};
use crate::scoring::nearness::{all, beside, come, grips, in_hands, is};
use crate::scoring::{A, Done, Facts, Phase};

/// Height of the bench's top, whose end is at y = 0.
const BENCH_M: f32 = 0.80;
/// Half the thickness of the bottle.
const BOTTLE_M: f32 = 0.033;
const BIN_Y_M: f32 = 1.77;
const CARRY_POINT_Y_M: f32 = 0.105;
const LIFTED_M: f32 = 0.02;
const DELIVERED_M: f32 = 0.25;
/// How far the rim of the bin, its highest part, may be above the bench's top.
const RIM_ABOVE_M: f32 = 0.01;

pub const TASK: Task = Task {
    id: "trash_collection",
    scene: "laboratory_147",
    robots: &[
        RobotSpot {
            name: "A",
            position_m: [0.0, BIN_Y_M + 0.55],
            yaw_rad: -FRAC_PI_2,
            instruction: "Walk to the bin, bend your knees a little and take it by the rim of its sides, one in each hand. Carry it upright \
                          straight ahead to the end of the bench, and hold it there with its rim a little lower than the \
                          bench's top until the bottle is in it.",
        },
        RobotSpot {
            name: "B",
            position_m: [-0.52, -0.40],
            yaw_rad: 0.0,
            instruction: "Wait until your partner holds the bin at the end of the bench on your left. Then sweep the bottle, which \
                          lies before you, along the bench and over its end into the bin. It rolls: push it straight.",
        },
    ],
    objects: &[
        spot("bin", [0.0, BIN_Y_M, 0.0]),
        spot("pet_bottle", [0.0, -0.42, BENCH_M + BOTTLE_M]),
        spot("carry_point", [0.0, CARRY_POINT_Y_M, 0.0]),
    ],
    randomize: &[
        Offset { y_m: -0.15..=-0.04, wider_yaw_rad: 0.08, ..uniform_xy(&["bin"], 0.15, 0.0) },
        Offset { y_m: -0.04..=0.12, wider_yaw_rad: 0.3, ..uniform_xy(&["pet_bottle"], 0.10, 0.0) },
    ],
    instruction: "Robot A brings the bin to the end of the bench and holds it there; Robot B sweeps the bottle off the bench into \
                  it.",
    benchmark_steps: 1000,
    phases: &[
        Phase {
            id: "lift_bin",
            description: "A holds the bin, all of it at least 2 cm off the floor.",
            collaborative: false,
            done: Done::When(&lifted),
            nearness: &|f| in_hands(grips(f, &[A], "bin"), &[come(f.clearance_m("bin"), 0.0, LIFTED_M)]),
        },
        Phase {
            id: "deliver_bin",
            description: "A holds the bin, all of it at least 2 cm off the floor, its middle within 25 cm of the taped mark at the end \
                          of the bench, no point of its rim more than 1 cm higher than the bench's top.",
            collaborative: false,
            done: Done::When(&delivered),
            nearness: &|f| {
                all(&[is(lifted(f)), beside(f, "bin", "carry_point", [2.0, DELIVERED_M]), is(delivered(f))])
            },
        },
        Phase {
            id: "sweep",
            description: "The bottle is inside the bin, and A still holds the bin.",
            collaborative: true,
            done: Done::When(&swept),
            nearness: &|f| {
                all(&[grips(f, &[A], "bin"), beside(f, "pet_bottle", "bin", [1.2, 0.1]), is(swept(f))])
            },
        },
    ],
    file: None,
};

/// A holds the bin off the floor.
fn lifted(f: &Facts) -> bool {
    f.holds_any(A, "bin") && f.clearance_m("bin") >= LIFTED_M
}

/// A holds the bin at the end of the bench, so low that a bottle falls into it.
fn delivered(f: &Facts) -> bool {
    lifted(f) && f.apart_m("bin", "carry_point") <= DELIVERED_M && f.highest_m("bin") <= BENCH_M + RIM_ABOVE_M
}

/// The bottle lies in the bin, which A has not let go of.
fn swept(f: &Facts) -> bool {
    f.holds_any(A, "bin") && f.inside_box("pet_bottle", "bin", "inside")
}

#[cfg(test)]
mod tests;
