//! BigTable: three robots lift a round table by its edge, carry it to a disc on the floor and set it down.
//!
//! Conditions, tolerances and randomisation are the benchmark's. Where it is silent we chose what three G1s carry: a pedestal table
//! of 0.80 m and 3.55 kg, 1.25 m, so that it is carried over a metre whatever the seed, and a disc of
//! 0.70 m under a foot of 0.40 m.

use std::f32::consts::PI;

use super::{Offset, RobotSpot, Task, spot, uniform_xy};
use crate::scoring::nearness::{all, beside, come, grips, in_hands, is, standing};
use crate::scoring::placement::{stands_as_high, stands_released};
use crate::scoring::{A, B, C, Done, Facts, Phase};

/// How far the robots stand from the middle of the table, which they look at.
const HOLDER_M: f32 = 0.803;
/// B stands a third of a turn after A, C before.
const SINE: f32 = 0.866_025_4;
const CARRY_M: f32 = 1.25;
const LIFTED_M: f32 = 0.03;
const CLEAR_M: f32 = 0.01;
const AS_HIGH_M: f32 = 0.05;

pub const TASK: Task = Task {
    id: "big_table",
    scene: "dining_046",
    robots: &[
        RobotSpot {
            name: "A",
            position_m: [0.0, 0.0],
            yaw_rad: 0.0,
            instruction: "Take the edge of the table before you with both hands. Lift the table together with your partners, walk \
                          straight ahead with it, level, until its foot is over the green disc, set it down and let go.",
        },
        RobotSpot {
            name: "B",
            position_m: [HOLDER_M * 1.5, -HOLDER_M * SINE],
            yaw_rad: PI * 2.0 / 3.0,
            instruction: "Take the edge of the table before you with both hands. Lift the table together with your partners, walk \
                          backwards and to your right with it, level, until its foot is over the green disc, set it down and \
                          let go.",
        },
        RobotSpot {
            name: "C",
            position_m: [HOLDER_M * 1.5, HOLDER_M * SINE],
            yaw_rad: -PI * 2.0 / 3.0,
            instruction: "Take the edge of the table before you with both hands. Lift the table together with your partners, walk \
                          backwards and to your left with it, level, until its foot is over the green disc, set it down and \
                          let go.",
        },
    ],
    objects: &[spot("round_table", [HOLDER_M, 0.0, 0.0]), spot("goal_disc", [HOLDER_M + CARRY_M, 0.0, 0.0])],
    randomize: &[Offset {
        yaw_rad: -4.0 * PI / 180.0..=4.0 * PI / 180.0,
        ..uniform_xy(&["round_table"], 0.04, 0.04)
    }],
    instruction: "All three robots take the round table by its edge, lift it together, carry it level until its foot is over the \
                  green disc, set it down there and let go.",
    benchmark_steps: 1000,
    phases: &[
        Phase {
            id: "joint_grasp_and_lift",
            description: "All three robots hold the table, its foot at least 3 cm off the floor.",
            collaborative: true,
            done: Done::When(&lifted),
            nearness: &|f| {
                in_hands(
                    grips(f, &[A, B, C], "round_table"),
                    &[come(f.clearance_m("round_table"), 0.0, LIFTED_M)],
                )
            },
        },
        Phase {
            id: "carry",
            description: "All three robots hold the table with the whole of its foot over the disc and at least 1 cm off the \
                          floor.",
            collaborative: true,
            done: Done::When(&carried),
            nearness: &|f| {
                all(&[
                    is(held_above(f, CLEAR_M)),
                    beside(f, "round_table", "goal_disc", [CARRY_M, 0.05]),
                    is(carried(f)),
                ])
            },
        },
        Phase {
            id: "release",
            description: "The whole foot of the table is on the disc, the table as high as at first to 5 cm, upright within 15 \
                          degrees and still, and no robot has touched it for 0.2 s.",
            collaborative: true,
            done: Done::When(&released),
            nearness: &|f| all(&[is(over_disc(f)), standing(f, "round_table"), is(released(f))]),
        },
    ],
    file: None,
};

fn held_above(f: &Facts, clear_m: f32) -> bool {
    f.held_by_all(&[A, B, C], "round_table") && f.clearance_m("round_table") >= clear_m
}

/// No part of the foot is beyond the rim of the disc.
fn over_disc(f: &Facts) -> bool {
    let apart_m = (f.site_m("round_table", "foot") - f.site_m("goal_disc", "disc")).truncate().length();
    apart_m + f.site("round_table", "foot").radius_m() <= f.site("goal_disc", "disc").radius_m()
}

/// All three hold the table off the floor.
fn lifted(f: &Facts) -> bool {
    held_above(f, LIFTED_M)
}

/// All three hold the table over the disc.
fn carried(f: &Facts) -> bool {
    held_above(f, CLEAR_M) && over_disc(f)
}

/// The table stands on the disc, released.
fn released(f: &Facts) -> bool {
    stands_released(f, "round_table") && over_disc(f) && stands_as_high(f, "round_table", AS_HIGH_M)
}

#[cfg(test)]
mod tests;
